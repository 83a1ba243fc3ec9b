"""`dmc conform`: check by the conformance table whether a controller answers as a DMC-41x3 does."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from dmc41x3.address import SerialAddress
from dmc41x3.cli import console
from dmc41x3.cli.console import OutputSettings, Site, controller_address
from dmc41x3.conformance import Demand, Vector, VectorDifference, load, run
from dmc41x3.conformance.runner import freshen, restart
from dmc41x3.conformance.vectors import sources
from dmc41x3.driver import Driver
from dmc41x3.errors import ConnectFailed, InvalidValue, LinkTimeout, MachineError, WrongController
from dmc41x3.i18n import marked, phrase, translate
from dmc41x3.wire.transport import TcpTransport

PATIENCE = 1.0
"""Longest wait for an answer [s]."""

_ASK = "MG _BV{F1.0}"
"""Command for the number of axes. It sets its format, because an earlier client may have changed the default."""


class TcpChannel:
    """A TCP connection to a controller, in real time.

    If the controller refuses the connection, `connected` is false and `reason` states why.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket: socket.socket | None = None
        self.reason = ""
        try:
            self._socket = socket.create_connection((host, port), timeout=PATIENCE)
        except OSError as error:
            self.reason = error.strerror or str(error)
        else:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    @property
    def connected(self) -> bool:
        """Whether the connection is open."""
        return self._socket is not None

    def send(self, data: bytes) -> None:
        """Send bytes; does nothing after the connection ended."""
        if self._socket is not None:
            try:
                self._socket.sendall(data)
            except OSError:
                self.close()

    def receive(self) -> bytes:
        """Return the received bytes, or b"" if none arrive within `PATIENCE`."""
        return self._read(PATIENCE)

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)

    def ended(self) -> bool:
        """Return whether the other side has ended the connection; drops received bytes."""
        while self._read(PATIENCE):
            continue
        return self._socket is None

    def close(self) -> None:
        """Close the connection; idempotent."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _read(self, patience: float) -> bytes:
        if self._socket is None:
            return b""
        self._socket.settimeout(patience)
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.close()
        return data


@dataclass(frozen=True, slots=True)
class ConformanceOutcome:
    """Result of the table: number of axes, number of vectors that passed, differences, and vectors left out."""

    axes: int
    right: int
    differences: list[VectorDifference]
    left_out: list[Vector]


def conform(address: str, moves: bool, bench: bool, settings: OutputSettings) -> int:
    """Check a controller against the table and print the differences; return 0 if there are none, else 1.

    Motors stay as they are unless `moves`; `bench` allows every test. Raises `ConnectFailed`,
    `LinkTimeout`, `WrongController`, `ControllerOwned`, and `InvalidValue` for a serial port.
    """
    place = controller_address(settings.site.meant(address, settings.config), "HOST")
    if isinstance(place, SerialAddress):
        reason = phrase("the check needs several connections at once, so it needs a network address")
        raise InvalidValue(key="HOST", value=str(place), reason=reason)
    host, port = place
    allowed = set(Demand) if bench else {Demand.MOVES} if moves else set[Demand]()
    outcome = held(host, port, allowed, settings.site)
    console.answer(_report(outcome), "\n".join(_lines(outcome, settings.language)), settings)
    return console.FAILED if outcome.differences else console.DONE


def held(host: str, port: int, allowed: set[Demand], site: Site) -> ConformanceOutcome:
    """Check the controller at an address with all vectors whose demands are allowed.

    With `Demand.FRESH` allowed, restore the factory settings before each vector, and reset before each group.
    """
    axes = axes_of(host, port)
    asyncio.run(_require_free(host, port, site))
    fitting = [vector for vector in load() if vector.fits(axes)]
    chosen = [vector for vector in fitting if vector.demands <= allowed]

    def dial() -> TcpChannel:
        return TcpChannel(host, port)

    bench = Demand.FRESH in allowed
    found: list[VectorDifference | None] = []
    group = ""
    for vector in chosen:
        if bench and vector.group != group:
            restart(dial, axes)
        elif bench:
            freshen(dial, axes)
        group = vector.group
        found.append(run(vector, dial, axes))
    differences = [difference for difference in found if difference is not None]
    left_out = [vector for vector in fitting if not vector.demands <= allowed]
    return ConformanceOutcome(axes, len(chosen) - len(differences), differences, left_out)


async def _require_free(host: str, port: int, site: Site) -> None:
    driver = await Driver.open(await TcpTransport.connect(host, port, PATIENCE), timeout=PATIENCE)
    try:
        with suppress(MachineError):  # the check runs whatever the controller answers
            await site.require_free(driver, f"{host}:{port}")
    finally:
        await driver.close()


def axes_of(host: str, port: int) -> int:
    """Return the number of axes that the controller at an address reports.

    Raises `ConnectFailed`, `LinkTimeout`, and `WrongController` if the answer is not a number of axes.
    """
    channel = TcpChannel(host, port)
    address = f"{host}:{port}"
    if not channel.connected:
        raise ConnectFailed(address=address, reason=channel.reason)
    try:
        channel.send(f"{_ASK}\r".encode("ascii"))
        answer = b""
        while answer[-1:] not in (b":", b"?"):
            more = channel.receive()
            if not more:
                raise LinkTimeout(address=address, command=_ASK, seconds=PATIENCE)
            answer += more
    finally:
        channel.close()
    text = answer.decode("latin-1").strip(" \r\n:")
    if len(text) != 1 or text not in "12345678":
        raise WrongController(address=address, found=repr(text))
    return int(text)


def _report(outcome: ConformanceOutcome) -> dict[str, object]:
    return {
        "axes": outcome.axes,
        "right": outcome.right,
        "differences": [_difference(difference) for difference in outcome.differences],
        "left_out": {demand.name.lower(): _count(outcome.left_out, demand) for demand in Demand},
    }


def _difference(difference: VectorDifference) -> dict[str, object]:
    vector = difference.vector
    return {
        "group": vector.group,
        "name": vector.name,
        "sent": difference.sent,
        "expected": list(difference.expected),
        "received": difference.received.decode("latin-1"),
        "sources": [sources()[letter] for letter in vector.sources],
        "certainty": vector.certainty,
    }


_CERTAINTIES = {"two": marked("two sources"), "one": marked("one source"), "inferred": marked("inferred")}


def _count(vectors: list[Vector], demand: Demand) -> int:
    return sum(demand in vector.demands for vector in vectors)


def _lines(outcome: ConformanceOutcome, language: str) -> Iterator[str]:
    for difference in outcome.differences:
        vector = difference.vector
        yield f"{vector.group}: {vector.name}"
        texts = marked("sent"), marked("expected"), marked("received"), marked("known from")
        sent, expected, received, known = (translate(text, language) for text in texts)
        yield f"  {sent:10} {difference.sent!r}"
        for place, text in enumerate(difference.expected):
            yield f"  {expected if place == 0 else '':10} {text!r}"
        yield f"  {received:10} {difference.received.decode('latin-1')!r}"
        named = "; ".join(sources()[letter] for letter in vector.sources)
        yield f"  {known:10} {named} ({translate(_CERTAINTIES[vector.certainty], language)})"
    yield translate(
        "{right} answers are right, {differ} differ. {left} checks were skipped; --moves and --bench run more of them.",
        language,
        right=outcome.right,
        differ=len(outcome.differences),
        left=len(outcome.left_out),
    )
