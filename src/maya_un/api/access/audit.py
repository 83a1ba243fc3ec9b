"""The audit log: who asked for what, from where, and what came of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from maya_un.api.access import tokens
from maya_un.api.access.caller import Caller
from maya_un.api.access.operations import Operation
from maya_un.errors import NotSignedIn
from maya_un.process.journal.rows import AuditRow

SIGN_IN = "sign in"
"""The operation of a failed attempt to sign in."""

TOGETHER = 10.0
"""Held jogs that follow each other within so long are written down once [s, real time]."""

_LONGEST = 200
_OFTEN = frozenset({Operation.JOG})


class Audit:
    """Writes rows by `note`, with the date of `now`; `speed` is how fast the loop's clock runs.

    A held jog asks several times a second: of one by the same caller with the same outcome the first is written.
    """

    def __init__(self, note: Callable[[AuditRow], None], now: Callable[[], str], speed: float = 1.0) -> None:
        self._note = note
        self._date = now
        self._together = TOGETHER * max(1.0, speed)
        self._latest: tuple[object, ...] = ()
        self._until = 0.0

    def asked(self, caller: Caller, operation: Operation, code: int, detail: str) -> None:
        """Write down an operation that passed the gate or was refused there."""
        this = (caller.name, caller.source, operation, code, detail)
        time = asyncio.get_running_loop().time()
        again = operation in _OFTEN and this == self._latest and time < self._until
        self._latest, self._until = this, time + self._together
        if not again:
            self._write(caller.name, caller.role.word, caller.source, operation.value, code, detail)

    def not_signed_in(self, name: str, source: str) -> None:
        """Write down a failed attempt to sign in, by `name` where it is known."""
        self._write(name or "unknown", "", source, SIGN_IN, NotSignedIn.code, "")

    def _write(self, who: str, role: str, source: str, operation: str, code: int, detail: str) -> None:
        plain = tokens.hidden(detail).encode("utf-8", "replace").decode()[:_LONGEST]
        self._note(AuditRow(self._date(), who, role, source, operation, code, plain))
