"""`dmc capture` and `dmc replay`: record the traffic of a client and a controller, and replay it."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

from dmc41x3.address import SIM
from dmc41x3.cli import connection, console
from dmc41x3.cli.connection import TIMEOUT, Dial
from dmc41x3.cli.console import OutputSettings, Site
from dmc41x3.cli.signals import asked_to_end
from dmc41x3.driver import Driver
from dmc41x3.errors import AddressInUse, FileUnreadable, InvalidValue, MachineError
from dmc41x3.files import open_own, unreadable, unwritable, writable_place
from dmc41x3.i18n import translate
from dmc41x3.listening import Listener, listen
from dmc41x3.loops import run, run_virtual
from dmc41x3.wire.transcript import ConnectionTranscript, Side, WirePiece, conversations, difference, header, read
from dmc41x3.wire.transport import Transport

_PIECE = 65536
"""Most bytes read at once."""


def capture(address: str, host: str, port: int, out: str, settings: OutputSettings) -> int:
    """Forward bytes between clients on `host`:`port` and a controller, and write them to `out`, until Ctrl-C.

    Prints the address on which it listens. Each client gets its own connection to the controller. Forwards TCP only:
    the controller's UDP traffic bypasses the proxy. Raises `FileUnwritable` and `AddressInUse`.
    """
    place = connection.meant(address, settings)
    try:
        descriptor = open_own(writable_place(Path(out)), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        with os.fdopen(descriptor, "w", encoding="utf-8", buffering=1) as file:
            print(header(place), file=file)
            asyncio.run(_capture(place, host, port, file, settings))
    except OSError as error:
        raise unwritable(out, error) from error
    return console.DONE


async def _capture(place: str, host: str, port: int, file: TextIO, settings: OutputSettings) -> None:
    async with connection.reached(place, settings.site) as way:
        between = CaptureProxy(way, file)
        try:
            listening = await between.listen(host, port)
            text = translate(
                "Listening on {address} for {controller}. Ctrl-C ends the recording.",
                settings.language,
                address=listening,
                controller=place,
            )
            console.answer({"address": listening, "controller": place}, text, settings)
            await asked_to_end()
        finally:
            await between.close()


class CaptureProxy:
    """A proxy between clients and a controller that records the traffic."""

    def __init__(self, dial: Dial, file: TextIO) -> None:
        self._dial = dial
        self._file = file
        self._start = asyncio.get_running_loop().time()
        self._server: Listener | None = None
        self._count = 0
        self._links: set[asyncio.Task[None]] = set()

    async def listen(self, host: str, port: int) -> str:
        """Accept clients from now on and return the address; raises `AddressInUse`."""
        try:
            self._server = await listen(host, port, self._connected)
        except OSError as error:
            raise AddressInUse(address=f"{host}:{port}") from error
        name, number = self._server.address
        return f"{name}:{number}"

    def _connected(self) -> asyncio.StreamReaderProtocol:
        return asyncio.StreamReaderProtocol(asyncio.StreamReader(), self._client)

    async def close(self) -> None:
        """Accept no more clients and end the existing connections."""
        if self._server is not None:
            self._server.close()
        for task in tuple(self._links):
            task.cancel()
        if self._links:
            await asyncio.wait(set(self._links))

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._links.add(task)
        self._count += 1
        try:
            await self._carry(self._count, reader, writer)
        except asyncio.CancelledError:
            pass  # the end of the recording ends every connection
        finally:
            self._links.discard(task)
            writer.close()

    async def _carry(self, link: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._note(link, "client", event="open")
        try:
            controller = await self._dial()
        except MachineError:
            self._note(link, "controller", event="end")
            return
        ways = [
            asyncio.create_task(self._from_client(link, reader, controller)),
            asyncio.create_task(self._from_controller(link, controller, writer)),
        ]
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for way in ways:
                way.cancel()
            await asyncio.wait(ways)
            await controller.close()

    async def _from_client(self, link: int, reader: asyncio.StreamReader, controller: Transport) -> None:
        try:
            while data := await reader.read(_PIECE):
                self._note(link, "client", data)
                controller.write(data)
        except (OSError, MachineError):
            pass  # one side broke the connection; record only its end
        self._note(link, "client", event="end")

    async def _from_controller(self, link: int, controller: Transport, writer: asyncio.StreamWriter) -> None:
        try:
            while data := await controller.read():
                self._note(link, "controller", data)
                writer.write(data)
                await writer.drain()
        except (OSError, MachineError):
            pass
        self._note(link, "controller", event="end")

    def _note(self, link: int, side: Side, data: bytes = b"", event: str = "") -> None:
        time = asyncio.get_running_loop().time() - self._start
        print(WirePiece(time, link, side, data, event).line(), file=self._file)


class AnswerDifference(NamedTuple):
    """An answer that differs now: time of the command [s], its connection and text, and how the answers differ."""

    time: float
    link: int
    command: str
    how: str


class ReplayOutcome(NamedTuple):
    """Result of a replay."""

    commands: int
    differences: list[AnswerDifference]


def replay(file: str, address: str, tolerance: float, settings: OutputSettings) -> int:
    """Replay a recording and print the differences; return 0 if there are none, else 1.

    Sends at the recorded pace; a twin runs in virtual time. Raises `InvalidValue`, `FileUnreadable`, `ConnectFailed`,
    `ControllerOwned`.
    """
    if not tolerance >= 0.0:
        raise InvalidValue(key="--tolerance", value=tolerance, reason="it is 0 or more")
    pieces = _pieces(Path(file))
    place = connection.meant(address, settings)
    outcome = (run_virtual if place == SIM else run)(_replay(place, pieces, tolerance, settings.site))
    report = {"commands": outcome.commands, "differences": [found._asdict() for found in outcome.differences]}
    lines = [_line(found) for found in outcome.differences]
    count = translate(
        "{commands} commands; {differences} answers differ from the recording.",
        settings.language,
        commands=outcome.commands,
        differences=len(lines),
    )
    console.answer(report, "\n".join([*lines, count]), settings)
    return console.FAILED if lines else console.DONE


def _line(found: AnswerDifference) -> str:
    return f"{found.time:9.3f} s  link {found.link}  {found.command!r}: {found.how}"


def _pieces(path: Path) -> list[WirePiece]:
    try:
        with path.open(encoding="utf-8") as file:
            return read(file)
    except OSError as error:
        raise unreadable(path, error) from error
    except ValueError as error:
        raise FileUnreadable(path=path, reason=str(error)) from error


async def _replay(place: str, pieces: Sequence[WirePiece], tolerance: float, site: Site) -> ReplayOutcome:
    async with connection.reached(place, site) as way:
        await _require_free(way, place, site)
        return await compared(way, pieces, tolerance)


async def _require_free(way: Dial, place: str, site: Site) -> None:
    driver = await Driver.open(await way(), timeout=TIMEOUT)
    try:
        await site.require_free(driver, place)
    finally:
        await driver.close()


async def compared(way: Dial, pieces: Sequence[WirePiece], tolerance: float) -> ReplayOutcome:
    """Send the client's side of a recording to a controller; return how its answers differ from the recorded ones."""
    before = conversations(pieces)
    after = await _again(way, [piece for piece in pieces if piece.side == "client"])
    found: list[AnswerDifference] = []
    for link, conversation in before.items():
        found += _differences(link, conversation, after.get(link, ConnectionTranscript()), tolerance)
    found.sort()
    return ReplayOutcome(sum(len(conversation.exchanges) for conversation in before.values()), found)


def _differences(
    link: int, before: ConnectionTranscript, after: ConnectionTranscript, tolerance: float
) -> list[AnswerDifference]:
    found: list[AnswerDifference] = []
    for one, other in zip(before.exchanges, after.exchanges, strict=False):
        if one.reply is not None and (how := difference(one.command, one.reply, other.reply, tolerance)):
            found.append(AnswerDifference(one.time, link, one.command, how))
    return found


async def _again(way: Dial, pieces: Sequence[WirePiece]) -> dict[int, ConnectionTranscript]:
    """Send every piece at its time, but not before the earlier commands of its connection are answered."""
    links: dict[int, _Link] = {}
    start = asyncio.get_running_loop().time()
    try:
        for piece in pieces:
            await asyncio.sleep(max(0.0, start + piece.time - asyncio.get_running_loop().time()))
            if piece.link not in links:
                links[piece.link] = _Link(await way())
            await links[piece.link].say(piece)
        for link in links.values():
            await link.answered()
    finally:
        for link in links.values():
            await link.close()
    return {number: link.conversation for number, link in links.items()}


class _Link:
    """One connection of the replay."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._heard = asyncio.Event()
        self.conversation = ConnectionTranscript()
        self._reader = asyncio.create_task(self._read())

    async def say(self, piece: WirePiece) -> None:
        await self.answered()
        if piece.event == "end":
            await self.close()
        elif piece.data:
            self.conversation.said(piece.data, piece.time)
            try:
                self._transport.write(piece.data)
            except MachineError:
                return  # the controller ended the connection; the missing answers show it

    async def answered(self) -> None:
        """Wait until every command sent is answered, the connection ends, or `TIMEOUT` passes."""
        try:
            async with asyncio.timeout(TIMEOUT):
                while not self.conversation.complete and not self._reader.done():
                    self._heard.clear()
                    await self._heard.wait()
        except TimeoutError:
            return

    async def close(self) -> None:
        self._reader.cancel()
        await asyncio.wait({self._reader})
        await self._transport.close()

    async def _read(self) -> None:
        try:
            while data := await self._transport.read():
                self.conversation.heard(data)
                self._heard.set()
        except MachineError:
            pass  # handled as an end: the other commands stay unanswered
        self._heard.set()
