"""The audit log: who asked for what, from where, and what came of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace

from maya_un.errors import NotSignedIn
from maya_un.process.journal.protocol import AuditRow
from maya_un.service.access import tokens
from maya_un.service.access.attempts import counted
from maya_un.service.access.operations import Caller, Operation

SIGN_IN = "sign in"
"""The operation of a failed attempt to sign in."""

TOGETHER = 10.0
"""Held jogs that follow each other within so long are written down once [s, real time]."""

_LONGEST = 200
_OFTEN = frozenset({Operation.JOG})

SINGLY = 10
"""Number of refusals and stops of one caller from one machine that get a row each; further ones are counted."""

COUNTED = 60.0
"""First period of counting [s, real time]; one row ends each period, and the next is twice as long."""

LONGEST = 3600.0
"""Longest period of counting [s, real time]."""

_REPEATED = frozenset({Operation.STOP, Operation.ABORT})
_MOST_CALLERS = 10_000


class _Spell:
    """Recent refusals and stops of one caller from one machine: their number, and when their common row began."""

    def __init__(self, length: float) -> None:
        self.length = length
        self.written = 0
        self.more = 0
        self.silent = False
        self.last: AuditRow | None = None


class Audit:
    """Writes rows by `note`, with the date of `now`; `speed` is how fast the loop's clock runs.

    A held jog asks several times a second: of one by the same caller with the same outcome the first is written.
    Anybody may cause refusals and stops without limit, so many of them are only counted.
    """

    def __init__(self, note: Callable[[AuditRow], None], now: Callable[[], str], speed: float = 1.0) -> None:
        self._note = note
        self._date = now
        self._together = TOGETHER * max(1.0, speed)
        self._speed = max(1.0, speed)
        self._spells: dict[tuple[str, str], _Spell] = {}
        self._latest: tuple[object, ...] = ()
        self._until = 0.0

    def asked(self, caller: Caller, operation: Operation, code: int, detail: str) -> None:
        """Write down an operation that passed the gate or was refused there."""
        this = (caller.name, caller.source, operation, code, detail)
        time = asyncio.get_running_loop().time()
        again = operation in _OFTEN and this == self._latest and time < self._until
        self._latest, self._until = this, time + self._together
        if not again:
            row = self._row(caller.name, caller.role.word, caller.source, operation.value, code, detail)
            if code or operation in _REPEATED:
                self._write_or_count(row)
            else:
                self._note(row)

    def not_signed_in(self, name: str, source: str) -> None:
        """Write down a failed attempt to sign in, by `name` where it is known."""
        self._write_or_count(self._row(name or "unknown", "", source, SIGN_IN, NotSignedIn.code, ""))

    def _row(self, who: str, role: str, source: str, operation: str, code: int, detail: str) -> AuditRow:
        plain = tokens.hidden(detail).encode("utf-8", "replace").decode()[:_LONGEST]
        return AuditRow(self._date(), who, role, source, operation, code, plain)

    def _write_or_count(self, row: AuditRow) -> None:
        key = (row.who, counted(row.source))
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

    def _end_later(self, key: tuple[str, str], spell: _Spell) -> None:
        asyncio.get_running_loop().call_later(spell.length * self._speed, self._end, key, spell)

    def _end(self, key: tuple[str, str], spell: _Spell) -> None:
        """Write the number of further ones and begin a longer period; forget a caller without any."""
        if spell.last is not None:
            self._note(replace(spell.last, date=self._date(), detail=f"and {spell.more} more in {spell.length:.0f} s"))
            spell.more, spell.last, spell.length = 0, None, min(2.0 * spell.length, LONGEST)
        if not spell.silent:
            spell.silent = True
            self._end_later(key, spell)
        elif self._spells.get(key) is spell:
            del self._spells[key]
