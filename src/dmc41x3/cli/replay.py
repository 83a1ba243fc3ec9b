"""`dmc replay`: the client's side of a recording said again, and the answers compared."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from dmc41x3.address import SIM
from dmc41x3.cli import dial, output
from dmc41x3.cli.dial import Dial
from dmc41x3.cli.send import TIMEOUT
from dmc41x3.cli.settings import OutputSettings
from dmc41x3.cli.site import Site
from dmc41x3.driver import Driver
from dmc41x3.errors import FileUnreadable, InvalidValue, MachineError
from dmc41x3.i18n import translate
from dmc41x3.loops import run, run_virtual
from dmc41x3.wire.transcript import ConnectionTranscript, WirePiece, conversations, difference, read
from dmc41x3.wire.transport import Transport


class AnswerDifference(NamedTuple):
    """One answer that is another now: when [s] and on which connection the command was said, and how they differ."""

    time: float
    link: int
    command: str
    how: str


class ReplayOutcome(NamedTuple):
    """What came of a replay."""

    commands: int
    differences: list[AnswerDifference]


def replay(file: str, address: str, tolerance: float, settings: OutputSettings) -> int:
    """Replay a recording and print what differs; return 0 where nothing does, else 1.

    The client speaks at its own pace, on a twin in virtual time. Raises `FileUnreadable`, `ConnectFailed`,
    `ControllerOwned`.
    """
    if not tolerance >= 0.0:
        raise InvalidValue(key="--tolerance", value=tolerance, reason="it is 0 or more")
    pieces = _pieces(Path(file))
    place = dial.meant(address, settings)
    outcome = (run_virtual if place == SIM else run)(_replay(place, pieces, tolerance, settings.site))
    report = {"commands": outcome.commands, "differences": [found._asdict() for found in outcome.differences]}
    lines = [_line(found) for found in outcome.differences]
    count = translate(
        "{commands} commands; {differences} answers differ from the recording.",
        settings.language,
        commands=outcome.commands,
        differences=len(lines),
    )
    output.answer(report, "\n".join([*lines, count]), settings)
    return output.FAILED if lines else output.DONE


def _line(found: AnswerDifference) -> str:
    return f"{found.time:9.3f} s  link {found.link}  {found.command!r}: {found.how}"


def _pieces(path: Path) -> list[WirePiece]:
    try:
        with path.open(encoding="utf-8") as file:
            return read(file)
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    except ValueError as error:
        raise FileUnreadable(path=path, reason=str(error)) from error


async def _replay(place: str, pieces: Sequence[WirePiece], tolerance: float, site: Site) -> ReplayOutcome:
    async with dial.reached(place, site) as way:
        await _require_free(way, place, site)
        return await compared(way, pieces, tolerance)


async def _require_free(way: Dial, place: str, site: Site) -> None:
    driver = await Driver.open(await way(), timeout=TIMEOUT)
    try:
        await site.require_free(driver, place)
    finally:
        await driver.close()


async def compared(way: Dial, pieces: Sequence[WirePiece], tolerance: float) -> ReplayOutcome:
    """Say the client's side of a recording to a controller; return how its answers differ from those recorded."""
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
    """Say every piece at its time, but not before what its connection said earlier is answered."""
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
                return  # the controller ended it; the answers that lack tell

    async def answered(self) -> None:
        """Wait for what was said to be answered, or given up."""
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
            pass  # as where it ends: what is not answered by then is not
        self._heard.set()
