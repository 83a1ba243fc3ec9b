"""`dmc send`: send commands to a controller in its own language."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import asdict

from dmc41x3.cli import output
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.cli.values import host_and_port
from dmc41x3.driver import Driver
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, DataRecord
from dmc41x3.wire.framing import LineSplitter
from dmc41x3.wire.transport import TcpTransport

TIMEOUT = 5.0
"""Longest wait for a reply of a controller [s]."""


def send(address: str, commands: Sequence[str], settings: OutputSettings) -> int:
    """Send commands one after the other and print their replies; ends at the first that is refused.

    Each may be several with `;` between them.

    Raises `ConnectFailed`, `LinkTimeout`, and `CommandRejected` with the controller's own code.
    """
    host, port = host_and_port(settings.site.meant(address, settings.config), "HOST")
    replies = asyncio.run(_converse(host, port, commands, settings))
    if settings.json:
        output.emit({"address": f"{host}:{port}", "replies": replies})
    return output.DONE


async def _converse(host: str, port: int, commands: Sequence[str], settings: OutputSettings) -> list[dict[str, object]]:
    driver = await Driver.open(await TcpTransport.connect(host, port, TIMEOUT), timeout=TIMEOUT)
    replies: list[dict[str, object]] = []
    try:
        for command in _single(commands):
            reply = await _reply(driver, command)
            record = isinstance(reply, DataRecord)
            replies.append({"command": command, "reply": asdict(reply) if record else reply})
            if not settings.json:
                output.say(_record_text(reply) if record else reply or ":")
    finally:
        await driver.close()
    return replies


def _single(commands: Sequence[str]) -> Iterator[str]:
    """Yield single commands; a `;` ends one as on the wire, also where another follows (`SH;TP`)."""
    for command in commands:
        if not command.isascii() or ";" not in command:
            yield command
        else:
            splitter = LineSplitter()
            splitter.limit = len(command)  # each goes in a line of its own
            yield from filter(None, splitter.feed(f"{command}\r".encode("ascii")))


async def _reply(driver: Driver, command: str) -> str | DataRecord:
    """Return a reply as text; QR answers with a record."""
    return await driver.record() if command.strip().upper() == "QR" else await driver.send(command)


def _record_text(record: DataRecord) -> str:
    """Return a record for people: one line an axis, in the controller's units."""
    return "\n".join(_axis_text(letter, axis) for letter, axis in zip(LETTERS, record.axes, strict=False))


def _axis_text(letter: str, axis: AxisRecord) -> str:
    facts = {
        "moving": axis.moving,
        "motor off": axis.motor_off,
        "forward limit": axis.forward_limit_active,
        "reverse limit": axis.reverse_limit_active,
    }
    numbers = (
        f"{letter}  position {axis.position}  reference {axis.reference}  error {axis.error}  "
        f"velocity {axis.velocity:g}  torque {axis.torque:.3f} V  stop code {axis.stop_code}"
    )
    return "  ".join((numbers, *(name for name, holds in facts.items() if holds)))
