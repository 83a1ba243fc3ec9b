"""Access control as a whole: the lease, the users, their callers, and the audit log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from maya_un.errors import InvalidValue
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow
from maya_un.process.lease import ControlLease
from maya_un.service.access.audit import Audit
from maya_un.service.access.callers import Callers, Hasher
from maya_un.service.access.users import Calendar, MemoryStore, Store, UserRegistry

_LONGEST = 200


def require_note(note: str) -> None:
    """Raise `InvalidValue` for what is not one line of at most 200 characters."""
    if len(note) > _LONGEST or not note.isprintable():
        raise InvalidValue(key="note", value=repr(note), reason=f"it is one line of at most {_LONGEST} characters")


class FixedCalendar:
    """The calendar of a stack that nobody shares: it always is the same day."""

    def now(self) -> str:
        """Return the first day of all."""
        return "1970-01-01T00:00:00+00:00"

    def after(self, seconds: float) -> str:
        """Return the same day, whatever `seconds`."""
        return self.now()


@dataclass(frozen=True, slots=True)
class AccessControl:
    """The caller and the driver. The gate calls `audit.asked`."""

    lease: ControlLease
    register: UserRegistry
    callers: Callers
    calendar: Calendar
    hasher: Hasher
    audit: Audit

    @classmethod
    def new(
        cls,
        lease: ControlLease,
        *,
        store: Store | None = None,
        calendar: Calendar | None = None,
        note: Callable[[AuditRow], None] = lambda row: None,
        speed: float = 1.0,
        hasher: Hasher | None = None,
    ) -> AccessControl:
        """Return an entrance whose users stand in `store`; `await entrance.register.open()` reads them.

        `note` keeps a row of the audit log. Without a store and a calendar it is for a stack that nobody shares.
        """
        days = FixedCalendar() if calendar is None else calendar
        hasher = hasher or Hasher()
        audit = Audit(note, days.now, speed)
        register = UserRegistry(MemoryStore() if store is None else store)
        callers = Callers(register, days, speed=speed, hasher=hasher, refused=audit.not_signed_in)
        return cls(lease, register, callers, days, hasher, audit)

    @classmethod
    def alone(cls, events: EventLog, speed: float = 1.0) -> AccessControl:
        """Return the entrance of a stack that nobody shares."""
        return cls.new(ControlLease(events, speed), speed=speed)
