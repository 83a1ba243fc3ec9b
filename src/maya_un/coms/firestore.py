"""Supervisors by Firestore: firestore://PROJECT.

    /robots/ROBOT                  {"database_url"?, "default_command"?}; read once at each connect
    /robots/ROBOT/commands/KEY     {"command", "args", "id"?, "robot"?, "deadline"?}; a supervisor adds it
    /robots/ROBOT/progress/KEY     {"id", "state", "date"}: the step is accepted or begins; removed with its command
    /robots/ROBOT/results/KEY      the result; written and the command removed in one commit
    /robots/ROBOT/state/presence   {"state": "ONLINE" or "OFFLINE", "at": the server's time}, every 10 s
    /robots/ROBOT/state/session    which robot of this name is served, and which commands were taken: see session.py

If the robot's document names a Realtime Database, that carries the steps, and nothing else of Firestore is used. A
command without an id has its KEY as id. REST reports no changes, so this module asks for commands every `INTERVAL`. A
result is written only if its command still exists: Firestore checks that in the same commit.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from maya_un.coms.agent import LONGEST
from maya_un.coms.documents import Documents
from maya_un.coms.firebase_auth import TokenSource
from maya_un.coms.rtdb import HEARTBEAT, MOST_AT_ONCE, Rtdb, as_id, beat_with, beside, leaving, robot_path
from maya_un.coms.session import SessionClaims, SupervisorSession
from maya_un.coms.settings import where_of
from maya_un.coms.transport import Report, ReportKind, SupervisorChannel, SupervisorCommand
from maya_un.errors import InvalidRequest, MayaError
from maya_un.graph.step_text import id_of

INTERVAL = 0.5
"""Pause between two queries for commands while there are none [s]; a query costs a read, so a day 172 800 reads.

It is shorter than `maya_un.graph.steps.QUIET`: the robot refuses a command that was there before a stop only if the
command reaches the robot within that time after the stop.
"""


class Firestore:
    """The Firestore of a project at firestore://PROJECT; `default_command` is known after the first connect.

    `interval` and `heartbeat` are in seconds.
    """

    def __init__(
        self, url: str, tokens: TokenSource, *, interval: float = INTERVAL, heartbeat: float = HEARTBEAT
    ) -> None:
        self.default_command: str | None = None
        self.needs_journal = True
        self._project = urlsplit(url).hostname or ""
        self._where = where_of(url)
        self._tokens = tokens
        self._interval = interval
        self._heartbeat = heartbeat
        self._session = SupervisorSession(self._where)

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return self._where

    @asynccontextmanager
    async def connected(self, robot: str, journal: str) -> AsyncIterator[SupervisorChannel]:
        """Connect to the database that the document of the robot names, or to Firestore if it names none.

        Raises as `Rtdb.connected` does.
        """
        path = robot_path(robot)
        documents = Documents(self._project, self._where, self._tokens)
        try:
            identity = await _identity(documents, path)
            found = identity.get("default_command")
            self.default_command = found if isinstance(found, str) else None
            url = identity.get("database_url")
            if url is None:
                async with self._by_documents(documents, robot, journal) as channel:
                    yield channel
                return
            if not isinstance(url, str) or urlsplit(where_of(url)).scheme not in {"http", "https"}:
                raise documents.error(f"the database_url of robots/{robot} is not like https://NAME.firebaseio.com")
            database = Rtdb(url, self._tokens, session=self._session)
            async with database.connected(robot, journal) as other:
                self.default_command = self.default_command or database.default_command
                yield other
        finally:
            await documents.close()

    @asynccontextmanager
    async def _by_documents(self, documents: Documents, robot: str, journal: str) -> AsyncIterator[SupervisorChannel]:
        path = robot_path(robot)
        set_presence = partial(_set_presence, documents, path)
        claims = await self._session.begin(_FirestoreSession(documents, path), robot, journal)
        async with leaving(claims, set_presence):
            channel = _FirestoreChannel(documents, path, self._interval, claims)
            await set_presence("ONLINE")
            async with beside(channel.fail, partial(beat_with, claims, set_presence, self._heartbeat)):
                yield channel


class _FirestoreSession:
    """The entry of the session in Firestore."""

    def __init__(self, documents: Documents, path: tuple[str, ...]) -> None:
        self._documents = documents
        self._path = (*path, "state", "session")
        self._date: str | None = None

    @property
    def where(self) -> str:
        """The address of the database."""
        return self._documents.where

    async def read(self) -> Any:
        """Return it, and note the date of its last change."""
        try:
            found, self._date = await self._documents.read_dated(self._path)
        except (AttributeError, RecursionError, TypeError, ValueError) as error:
            raise self._documents.error(f"the document {'/'.join(self._path)} cannot be read") from error
        return found

    async def swap(self, data: Mapping[str, Any]) -> bool:
        """Write it if its last change still has the date."""
        if self._date is None:
            return False
        self._date = await self._documents.swap(self._path, data, self._date)
        return self._date is not None


class _FirestoreChannel:
    """A connection to Firestore: it delivers the open commands and writes reports of them."""

    def __init__(self, documents: Documents, path: tuple[str, ...], interval: float, claims: SessionClaims) -> None:
        self._documents = documents
        self._path = path
        self._claims = claims
        self._interval = interval
        self._waiting: list[str] = []
        self._ids: dict[str, str | None] = {}  # of the commands that are delivered and not answered, by key
        self._error: MayaError | None = None

    def fail(self, error: MayaError) -> None:
        """End the connection before the next query for commands."""
        self._error = self._error or error

    async def receive(self) -> SupervisorCommand:
        """Wait for the next command, in the order of creation, and return it."""
        while True:
            if self._error is not None:
                raise self._error
            if not self._waiting:
                await self._look()
            if not self._waiting:
                await asyncio.sleep(self._interval)
                continue
            if self._waiting[0] not in self._claims:
                await self._claims.claim(self._waiting)
            command = await self._delivered(self._waiting.pop(0))
            if command is None:
                continue
            if not self._claims.is_elsewhere(command.key):
                return command
            await self.send(self._claims.refusal(command, self._ids[command.key]))

    async def send(self, report: Report) -> None:
        """Write a report; with a result, remove its command. Do nothing for a command that is no longer open."""
        key = report.key if report.key in self._ids else self._key_of(report.id)
        if key is None:
            return
        data, progress = json.loads(report.text), (*self._path, "progress", key)
        if report.kind is not ReportKind.RESULT:
            await self._documents.commit(self._documents.put(progress, data))
            return
        command = (*self._path, "commands", key)
        await self._documents.commit(
            self._documents.remove(command, there=True),
            self._documents.remove(progress),
            self._documents.put((*self._path, "results", key), data),
            needed=command,
        )
        self._close(key)

    def _close(self, key: str) -> None:
        self._ids.pop(key, None)
        self._claims.forget(key)

    async def _look(self) -> None:
        """Read the keys of the open commands."""
        before = set(self._ids)
        keys = await self._documents.keys((*self._path, "commands"), MOST_AT_ONCE)
        for key in before - set(keys):
            self._close(key)  # somebody removed it
        if len(keys) < MOST_AT_ONCE:
            self._claims.keep_only(keys)
        self._waiting = [key for key in keys if key not in self._ids]

    async def _delivered(self, key: str) -> SupervisorCommand | None:
        """Return a command and note that it is delivered; None if it is no longer there."""
        try:
            data = await self._documents.read((*self._path, "commands", key))
        except (AttributeError, RecursionError, TypeError, ValueError):  # too long, or no document
            self._ids[key] = as_id(key)
            return SupervisorCommand(key, b" " * (LONGEST + 1), as_id(key))
        if data is None:
            self._claims.forget(key)
            return None
        self._ids[key] = as_id(key)
        with suppress(InvalidRequest):
            self._ids[key] = id_of(data) or as_id(key)
        return SupervisorCommand(key, json.dumps(data, sort_keys=True).encode(), as_id(key))

    def _key_of(self, id_: str | None) -> str | None:
        """Return the key of the open command with an id, None if there is none."""
        return next((key for key, found in self._ids.items() if id_ is not None and found == id_), None)


async def _identity(documents: Documents, path: tuple[str, ...]) -> dict[str, object]:
    """Return the document of a robot; raises `SupervisorsNotReached` if there is none."""
    try:
        found = await documents.read(path)
    except (AttributeError, RecursionError, TypeError, ValueError) as error:
        raise documents.error(f"the document {'/'.join(path)} cannot be read") from error
    if found is None:
        raise documents.error(f"there is no document {'/'.join(path)}: write it, it may be empty")
    return found


async def _set_presence(documents: Documents, path: tuple[str, ...], state: str) -> None:
    await documents.commit(documents.put((*path, "state", "presence"), {"state": state}, time="at"))
