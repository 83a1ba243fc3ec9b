"""A twin on a bench for the tools, reached as they reach any controller, and a voice that remembers."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from dmc41x3.cli.terminal.session import TerminalSession
from dmc41x3.cli.terminal.words import carry_out
from dmc41x3.driver import Driver
from dmc41x3.errors import ConnectFailed
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from dmc41x3.wire.transport import Transport


class Bench:
    """A controller with three ideal axes that can be reached unless it is `away`."""

    def __init__(self) -> None:
        self.controller = VirtualController(VirtualDmc(BenchPlant(), motors_off=False))
        self.away = False

    async def dial(self) -> Transport:
        if self.away:
            raise ConnectFailed(address="bench", reason="nobody there")
        return self.controller.loopback()


@asynccontextmanager
async def benched() -> AsyncIterator[Bench]:
    bench = Bench()
    try:
        yield bench
    finally:
        await bench.controller.close()


@asynccontextmanager
async def driven() -> AsyncIterator[Driver]:
    async with benched() as bench:
        driver = await Driver.open(await bench.dial(), timeout=5.0)
        try:
            yield driver
        finally:
            await driver.close()


class Heard:
    """Stores the output of a session, as (kind, text)."""

    def __init__(self) -> None:
        self.said: list[tuple[str, str]] = []

    def answer(self, text: str) -> None:
        self.said.append(("answer", text))

    def refused(self, text: str) -> None:
        self.said.append(("refused", text))

    def message(self, text: str) -> None:
        self.said.append(("message", text))

    def note(self, text: str) -> None:
        self.said.append(("note", text))

    def trouble(self, text: str) -> None:
        self.said.append(("trouble", text))

    def all(self, kind: str) -> list[str]:
        """Return the output of one kind."""
        return [text for found, text in self.said if found == kind]

    @property
    def last(self) -> tuple[str, str]:
        return self.said[-1]


@asynccontextmanager
async def talking() -> AsyncIterator[tuple[TerminalSession, Heard, Bench]]:
    """Give a session that is connected and carried, as the terminal carries it."""
    async with benched() as bench:
        heard = Heard()
        session = TerminalSession(bench.dial, "bench", heard)
        await session.connect()
        tasks = [asyncio.create_task(session.work(carry_out)), asyncio.create_task(session.watch())]
        try:
            yield session, heard, bench
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            await session.close()


async def say(session: TerminalSession, *lines: str) -> None:
    """Enter lines and wait until all that came of them is done."""
    for line in lines:
        session.enter(line)
    await session.settled()
