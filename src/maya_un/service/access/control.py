"""Access control: the lease, the users, their callers, and the audit log.

The audit log records who requested which operation, from where, and the outcome.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidValue, NotSignedIn
from maya_un.events import EventLog
from maya_un.process.journal.protocol import AuditRow
from maya_un.process.lease import ControlLease
from maya_un.schema.choices import RoleName
from maya_un.service.access import callers
from maya_un.service.access.callers import Callers, Hasher, counted
from maya_un.service.access.operations import Caller, Operation
from maya_un.service.access.users import Calendar, MemoryStore, Store, UserRegistry

SIGN_IN = "sign in"
"""The operation of an attempt to sign in with a password, or of a failed one with a token."""

TOGETHER = 10.0
"""Repeated requests of a held jog within this time are logged once [s, real time]."""

_LONGEST_DETAIL = 200
_OFTEN = frozenset({Operation.JOG})

SINGLY = 10
"""Number of repeatable rows of one caller from one machine that are written; further ones are counted."""

COUNTED = 60.0
"""First period of counting [s, real time]; one row ends each period, and the next is twice as long."""

LONGEST = 3600.0
"""Longest period of counting [s, real time]."""

_REPEATED = frozenset({Operation.STOP, Operation.ABORT})
"""Operations without limit that anybody may repeat. Each row of them could displace the row of a change."""

_OWN = frozenset({Operation.ME, Operation.LEASE})
"""Operations like `_REPEATED`, which may also change something that lasts, like the own password."""

_MOST_CALLERS = 10_000


class _Spell:
    """Recent rows of one caller that are counted together: their number, and the last one only counted."""

    def __init__(self, length: float) -> None:
        self.length = length
        self.written = 0
        self.more = 0
        self.silent = False
        self.last: AuditRow | None = None


class Audit:
    """Writes audit rows by `note`, with the date of `now`; `speed` is that of the loop's clock relative to real time.

    A held jog sends several requests a second: repeated requests of the same caller with the same outcome are logged
    once. Refusals, stops, sign-ins, and requests about the caller or the lease can occur without limit, so many of them
    are only counted. Successful requests about the caller or the lease are counted by operation and subject, so that
    other rows do not hide them.
    """

    def __init__(self, note: Callable[[AuditRow], None], now: Callable[[], str], speed: float = 1.0) -> None:
        self._note = note
        self._date = now
        self._together = TOGETHER * max(1.0, speed)
        self._speed = max(1.0, speed)
        self._spells: dict[tuple[str, ...], _Spell] = {}
        self._latest: tuple[object, ...] = ()
        self._until = 0.0

    def asked(self, caller: Caller, operation: Operation, code: int, detail: str) -> None:
        """Log an operation that passed the gate or was refused there."""
        this = (caller.name, caller.source, operation, code, detail)
        time = asyncio.get_running_loop().time()
        again = operation in _OFTEN and this == self._latest and time < self._until
        self._latest, self._until = this, time + self._together
        if not again:
            row = self._row(caller.name, caller.role.word, caller.source, operation.value, code, detail)
            if code or operation in _REPEATED:
                self._write_or_count(row)
            elif operation in _OWN:
                self._write_or_count(row, row.operation, row.detail)
            else:
                self._note(row)

    def signed_in(self, name: str, role: RoleName, source: str) -> None:
        """Log that a user has signed in with the password."""
        self._write_or_count(self._row(name, role, source, SIGN_IN, 0, ""))

    def not_signed_in(self, name: str, source: str) -> None:
        """Log a failed attempt to sign in, by `name` if it is known."""
        self._write_or_count(self._row(name or "unknown", "", source, SIGN_IN, NotSignedIn.code, ""))

    def _row(
        self, who: str, role: RoleName | Literal[""], source: str, operation: str, code: int, detail: str
    ) -> AuditRow:
        plain = callers.hidden(detail).encode("utf-8", "replace").decode()[:_LONGEST_DETAIL]
        return AuditRow(self._date(), who, role, source, operation, code, plain)

    def _write_or_count(self, row: AuditRow, *apart: str) -> None:
        """Write a row, or count it with the rows of its caller, apart from those with another `apart`."""
        key = (row.who, counted(row.source), *apart)
        spell = self._spells.get(key)
        if spell is None:
            spell = self._spells[key] = _Spell(COUNTED)
            self._end_later(key, spell)
            if len(self._spells) > _MOST_CALLERS:
                del self._spells[next(iter(self._spells))]
        spell.silent = False
        if spell.written < SINGLY:
            spell.written += 1
            self._note(row)
        else:
            spell.more += 1
            spell.last = row

    def _end_later(self, key: tuple[str, ...], spell: _Spell) -> None:
        asyncio.get_running_loop().call_later(spell.length * self._speed, self._end, key, spell)

    def _end(self, key: tuple[str, ...], spell: _Spell) -> None:
        """Write the number of rows that were only counted, and start a longer period; forget a caller without any."""
        if spell.last is not None:
            self._note(replace(spell.last, date=self._date(), detail=f"and {spell.more} more in {spell.length:.0f} s"))
            spell.more, spell.last, spell.length = 0, None, min(2.0 * spell.length, LONGEST)
        if not spell.silent:
            spell.silent = True
            self._end_later(key, spell)
        elif self._spells.get(key) is spell:
            del self._spells[key]


_LONGEST = 200


def require_note(note: str) -> None:
    """Raise `InvalidValue` if a note is not one line of at most 200 characters."""
    if len(note) > _LONGEST or not note.isprintable():
        raise InvalidValue(
            key="note",
            value=repr(note),
            reason=phrase("it must be one line of at most {most} characters", most=_LONGEST),
        )


class FixedCalendar:
    """The calendar of a stack without shared access: its date is constant."""

    def now(self) -> str:
        """Return the constant date."""
        return "1970-01-01T00:00:00+00:00"

    def after(self, seconds: float) -> str:
        """Return the constant date for any `seconds`."""
        return self.now()


@dataclass(frozen=True, slots=True)
class AccessControl:
    """Access control: the lease, the users and the audit log. The gate calls `audit.asked`."""

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
        """Return access control with the users in `store`; `await access.register.open()` reads them.

        `note` stores a row of the audit log. Without a store and a calendar, it is for a stack without shared access.
        """
        days = FixedCalendar() if calendar is None else calendar
        hasher = hasher or Hasher()
        audit = Audit(note, days.now, speed)
        register = UserRegistry(MemoryStore() if store is None else store)
        callers = Callers(register, days, speed=speed, hasher=hasher, refused=audit.not_signed_in)
        return cls(lease, register, callers, days, hasher, audit)

    @classmethod
    def alone(cls, events: EventLog, speed: float = 1.0) -> AccessControl:
        """Return the access control of a stack without shared access."""
        return cls.new(ControlLease(events, speed), speed=speed)
