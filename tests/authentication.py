"""Authentication for tests: cheap hashes, a calendar that the test sets, a readable audit log."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow
from maya_un.process.lease import ControlLease
from maya_un.service.access.callers import Hasher
from maya_un.service.access.control import AccessControl
from maya_un.service.access.operations import LOCAL, Caller, Role
from maya_un.service.access.users import Store
from maya_un.service.people import LeaseService, UserService

FIRST_DAY = datetime(2026, 11, 21, 9, 0, 0, tzinfo=UTC)


class Days:
    """A calendar that advances on request."""

    def __init__(self) -> None:
        self.today = FIRST_DAY

    def now(self) -> str:
        """Return the date of now."""
        return self.today.isoformat(timespec="seconds")

    def after(self, seconds: float) -> str:
        """Return the date in so many seconds."""
        return (self.today + timedelta(seconds=seconds)).isoformat(timespec="seconds")


@dataclass(slots=True)
class CallerRegistry:
    """Everything about who asks, with nobody yet; `halts` counts how often held jogs were stopped."""

    access: AccessControl
    people: UserService
    leasing: LeaseService
    events: EventLog
    days: Days
    audit: list[AuditRow]
    halts: list[str] = field(default_factory=list[str])

    async def admin(self) -> Caller:
        """Add the first user and return him, signed in."""
        return await self.caller("root", "admin")

    async def caller(self, name: str, role: str) -> Caller:
        """Add a user and return him, signed in by his first token."""
        made = await self.people.add(name, role)
        return await self.resolve(made.token)

    async def resolve(self, token: str | None, lease: str = "", source: str = "10.0.0.1") -> Caller:
        """Return who shows a token from another machine."""
        header = None if token is None else f"Bearer {token}"
        return await self.access.callers.resolve(header, lease, source, loopback=False)


def caller_registry(store: Store | None = None, speed: float = 1.0) -> CallerRegistry:
    """Return an authentication service; `await house.access.register.open()` reads a store."""
    events, days, rows, halts = EventLog(asyncio.get_running_loop().time), Days(), list[AuditRow](), list[str]()
    cheap = Hasher(memory=8, passes=1)
    access = AccessControl.new(
        ControlLease(events, speed), store=store, calendar=days, note=rows.append, speed=speed, hasher=cheap
    )
    leasing = LeaseService(access, lambda: halts.append("halt"))
    return CallerRegistry(access, UserService(access, leasing.rights_ended), leasing, events, days, rows, halts)


def somebody(role: Role, name: str = "", lease: str = "") -> Caller:
    """Return a caller of a role."""
    return Caller(name or role.word, role, "10.0.0.1", lease)


__all__ = ["FIRST_DAY", "LOCAL", "CallerRegistry", "Days", "caller_registry", "somebody"]
