"""The other end of the wire for tests of the driver: answers from a script, not from a machine."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from dmc41x3.driver import Driver
from dmc41x3.wire.framing import LineSplitter
from dmc41x3.wire.transport import LoopbackTransport, loopback_pair

TIMEOUT = 2.0


class Peer:
    """Answers every command by `answer` (bytes, or None for silence) and keeps what it was sent.

    While `held`, it takes commands and does not answer; `release` answers them.
    """

    def __init__(self, end: LoopbackTransport, answer: Callable[[str], bytes | None]) -> None:
        self.end = end
        self.answer = answer
        self.wire = b""
        self.commands: list[str] = []
        self.held = False
        self._kept: list[str] = []

    async def run(self) -> None:
        splitter = LineSplitter()
        while data := await self.end.read():
            self.wire += data
            commands = splitter.feed(data)
            self.commands += commands
            self._kept += commands
            if not self.held:
                self.release()

    def release(self) -> None:
        self.held = False
        kept, self._kept = self._kept, []
        for command in kept:
            reply = self.answer(command)
            if reply is not None:
                self.end.write(reply)


@asynccontextmanager
async def conversation(answer: Callable[[str], bytes | None]) -> AsyncIterator[tuple[Driver, Peer]]:
    """Give a driver and the peer at its other end; both end with the block."""
    ours, theirs = loopback_pair("box")
    peer = Peer(theirs, answer)
    serving = asyncio.create_task(peer.run())
    driver = await Driver.open(ours, timeout=TIMEOUT)
    try:
        yield driver, peer
    finally:
        if peer.held and not driver.lost.done():
            peer.release()
        await driver.close()
        await serving
