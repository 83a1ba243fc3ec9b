"""A transport within the process, for tests: supervisors put commands in and read reports."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from maya_un.coms.transport import Report, ReportKind, SupervisorCommand
from maya_un.errors import SupervisorsNotReached


class Memory:
    """Keeps commands until their result is sent, every report, and the journal of every connection.

    While `away` nothing gets through.
    """

    def __init__(self, default_command: str | None = None) -> None:
        self.commands: dict[str, bytes] = {}
        self.reports: list[Report] = []
        self.journals: list[str] = []
        self.away = False
        self.default_command = default_command
        self.needs_journal = True
        self._changed = asyncio.Condition()

    @property
    def where(self) -> str:
        """Its address."""
        return "memory"

    async def put(self, key: str, text: bytes) -> None:
        """Send a command."""
        self.commands[key] = text
        await self._notify()

    async def set_away(self, away: bool) -> None:
        """Cut the connection, or let it come back."""
        self.away = away
        await self._notify()

    async def results(self, count: int) -> list[Report]:
        """Return the results when there are so many."""
        async with self._changed:
            await self._changed.wait_for(lambda: len(self._results()) >= count)
        return self._results()

    def _results(self) -> list[Report]:
        return [report for report in self.reports if report.kind is ReportKind.RESULT]

    @asynccontextmanager
    async def connected(self, robot: str, journal: str) -> AsyncIterator[_Channel]:
        """Connect for a robot."""
        del robot
        self.journals.append(journal)
        self.require_there()
        yield _Channel(self)

    def require_there(self) -> None:
        """Raise `SupervisorsNotReached` while the connection is cut."""
        if self.away:
            raise SupervisorsNotReached(where=self.where, reason="it is away")

    async def _notify(self) -> None:
        async with self._changed:
            self._changed.notify_all()

    async def next(self, delivered: set[str]) -> SupervisorCommand:
        """Return the first command that was not delivered."""

        def first() -> str | None:
            return next((key for key in self.commands if key not in delivered), None)

        async with self._changed:
            await self._changed.wait_for(lambda: self.away or first() is not None)
        self.require_there()
        key = first()
        assert key is not None
        delivered.add(key)
        return SupervisorCommand(key, self.commands[key], key)

    async def take(self, report: Report) -> None:
        """Keep a report; a result ends its command."""
        self.require_there()
        self.reports.append(report)
        if report.kind is ReportKind.RESULT and report.key is not None:
            self.commands.pop(report.key, None)
        await self._notify()


class _Channel:
    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._delivered: set[str] = set()

    async def receive(self) -> SupervisorCommand:
        return await self._memory.next(self._delivered)

    async def send(self, report: Report) -> None:
        await self._memory.take(report)
