"""The session of a database: which robot it serves under a name, and which commands that robot has claimed.

    {"id", "host", "claims": {KEY: JOURNAL}}

The entry belongs to the session that started last. Before a session sends a command to its robot, it claims the
command: it adds the command's key and the journal of its robot to the entry. A write succeeds only if no other program
has written the entry since it was read. So no session claims a command after another one has started, and every session
sees the claims of all earlier ones. A session does not send commands that another journal may contain. This depends on
no clock and no heartbeat.
"""

from __future__ import annotations

import asyncio
import hashlib
import socket
from collections.abc import Collection, Mapping, Set
from typing import Any, Protocol
from uuid import uuid4

from dmc41x3.i18n import phrase
from maya_un.coms.transport import Report, ReportKind, SupervisorCommand
from maya_un.errors import SessionTakenOver, StepTakenElsewhere, SupervisorsNotReached
from maya_un.http import dates
from maya_un.steps.text import StepEnd

_LONGEST_KEY = 64
"""Maximum length of a key that is stored unchanged [characters]; Firestore allows 1500 bytes, and 1 MiB for all claims.
"""

_MOST_ATTEMPTS = 20
"""Attempts to write the entry before the connection ends, so that the next attempts follow after a pause."""


class SessionRecord(Protocol):
    """An entry in the database at `where`, with compare-and-swap."""

    @property
    def where(self) -> str:
        """The address of the database."""
        ...

    async def read(self) -> Any:
        """Return the data of the entry, None if it has none."""
        ...

    async def swap(self, data: Mapping[str, Any]) -> bool:
        """Write data and return True; if the stored data may have changed since the last call, only return False."""
        ...


class SupervisorSession:
    """The session of a program in the database at `where`. It outlives the connections of the program."""

    def __init__(self, where: str) -> None:
        self.id = uuid4().hex
        self.where = where
        self._begun: set[str] = set()

    async def begin(self, entry: SessionRecord, robot: str, journal: str) -> SessionClaims:
        """Start the session, or resume it after a lost connection.

        This ends the session of an earlier program at once: after a crash it may be the earlier session of this robot.
        Raises `SessionTakenOver` if a later session has started meanwhile, `SupervisorsNotReached` if other programs
        change the entry at every attempt.
        """
        claims = SessionClaims(self, entry, robot, journal)
        for _ in range(_MOST_ATTEMPTS):
            holder = await (claims.require() if entry.where in self._begun else claims.read())
            if holder == self.id or await claims.write():
                self._begun.add(entry.where)
                return claims
        raise _contested(entry)


class SessionClaims:
    """The claimed commands, as known to one connection of a session."""

    def __init__(self, session: SupervisorSession, entry: SessionRecord, robot: str, journal: str) -> None:
        self._session = session
        self._entry = entry
        self._robot = robot
        self._journal = journal
        self._claims: dict[str, str] = {}
        self._ended: set[str] = set()  # claims of closed commands that the entry may still contain
        self._is_lost = False
        self._turn = asyncio.Lock()

    async def claim(self, keys: Collection[str]) -> None:
        """Claim commands that no session has claimed.

        Raises `SessionTakenOver`, and `SupervisorsNotReached` if other programs change the entry at every attempt.
        """
        wanted = set(map(_short, keys))
        async with self._turn:
            self._ended -= wanted
            for _ in range(_MOST_ATTEMPTS):
                if await self.write(dict.fromkeys(wanted - self._ended, self._journal) | self._claims):
                    return
                self._check(await self.read())
            raise _contested(self._entry)

    def forget(self, key: str) -> None:
        """Record that a command is closed. Its claim does not apply to a later command with the same key."""
        self._forget({_short(key)})

    def keep_only(self, keys: Collection[str]) -> None:
        """Record that no other commands than these are open."""
        self._forget(self._claims.keys() - set(map(_short, keys)))

    def _forget(self, gone: Set[str]) -> None:
        self._claims = {key: owner for key, owner in self._claims.items() if key not in gone}
        self._ended |= gone

    def __contains__(self, key: str) -> bool:
        """Return whether a session has claimed a command."""
        return _short(key) in self._claims

    def is_elsewhere(self, key: str) -> bool:
        """Return whether another journal may contain a command."""
        return self._claims.get(_short(key), self._journal) != self._journal

    def refusal(self, command: SupervisorCommand, id_: str | None) -> Report:
        """Return the result that refuses a command which another journal may contain."""
        result = StepEnd.refused(id_, StepTakenElsewhere(name=self._robot), dates.now())
        return Report(id_, ReportKind.RESULT, result.text, command.key)

    async def require(self) -> str | None:
        """Read the entry, as `read` does; raises `SessionTakenOver` if a later session has started."""
        async with self._turn:
            return self._check(await self.read())

    def _check(self, holder: str | None) -> str | None:
        self._is_lost = self._is_lost or holder not in {None, self._session.id}
        if self._is_lost:
            raise SessionTakenOver(where=self._session.where, name=self._robot)
        return holder

    async def read(self) -> str | None:
        """Read the entry; return the id of its session, None if it has none."""
        found = await self._entry.read()
        claims = found.get("claims") if isinstance(found, dict) else None
        claims = claims if isinstance(claims, dict) else {}
        self._ended &= claims.keys()
        self._claims |= {str(key): str(owner) for key, owner in claims.items() if key not in self._ended}
        holder = found.get("id") if isinstance(found, dict) else None
        return holder if isinstance(holder, str) else None

    async def write(self, claims: dict[str, str] | None = None) -> bool:
        """Write the entry, by default with the known claims; return whether no other program wrote it before.

        Raises `SessionTakenOver` if a later session is known to have started.
        """
        self._check(self._session.id)
        before = frozenset(self._ended)
        claims = self._claims if claims is None else claims
        entry = {"id": self._session.id, "host": socket.gethostname(), "claims": claims}
        if not await self._entry.swap(entry):
            return False
        self._ended = (self._ended - before) & claims.keys()
        self._claims = {key: owner for key, owner in claims.items() if key not in self._ended}
        return True


def _contested(entry: SessionRecord) -> SupervisorsNotReached:
    reason = phrase("another program changes the robot's session all the time, so no command can be claimed")
    return SupervisorsNotReached(where=entry.where, reason=reason)


def _short(key: str) -> str:
    """Return a key as stored in the entry: a long one as its digest."""
    if len(key) <= _LONGEST_KEY:
        return key
    return f"sha256-{hashlib.sha256(key.encode(errors='surrogatepass')).hexdigest()}"
