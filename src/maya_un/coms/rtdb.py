"""Supervisors by a Firebase Realtime Database, over REST and server-sent events.

    /robots/ROBOT/commands/KEY   {"command", "args", "id"?, "robot"?, "deadline"?}; a supervisor pushes it in one write
    /robots/ROBOT/progress/KEY   {"id", "state", "date"}: the step is accepted or begins; removed with its command
    /robots/ROBOT/results/KEY    the result; it is written and its command removed in one write
    /robots/ROBOT/presence       {"state": "ONLINE" or "OFFLINE", "at": the server's time}, every 10 s
    /robots/ROBOT/session        which robot of this name is served, and which commands were taken: see session.py
    /robots/ROBOT/document       {"default_command"?}: what a step without a command means

A command without an id has its KEY as id. The database stores a command until its result is written, and sends all open
commands after each connect. A result is written only while its command is open, so no command is answered twice after a
lost connection. Before delivery, a command is claimed in the session with an ETag, so only one of two robots with the
same name gets it. The database drops null and empty values: a result without `error` has none.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import aclosing, asynccontextmanager, suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from typing import Any
from urllib.parse import parse_qs, urlsplit

from dmc41x3.i18n import phrase
from maya_un.coms.agent import LONGEST
from maya_un.coms.database import Database, FixedToken, ServerSentEvent, TokenSource, data_of, events
from maya_un.coms.session import SessionClaims, SupervisorSession
from maya_un.coms.settings import where_of
from maya_un.coms.transport import Report, ReportKind, SupervisorCommand
from maya_un.errors import InvalidRequest, InvalidValue, MayaError, SessionTakenOver, SupervisorsNotReached
from maya_un.steps.text import as_id, id_of

HEARTBEAT = 10.0
"""Interval at which presence is written [s]."""

_SILENCE = 45.0
"""A stream without an event for this time has ended [s]; the database sends one every 30 s."""

_PATIENCE = 10.0
"""Timeout of the answer to a request [s]."""

FAREWELL = 1.0
"""Longest wait for the final write to the database [s]."""

_LONGEST_EVENT = 1 << 20
"""Maximum size of an event [bytes]; the commands of a longer one are read one by one."""

MOST_AT_ONCE = 1000
"""Maximum number of commands that are delivered and not answered: the capacity of the robot's queue of steps."""

_FORBIDDEN = frozenset(".$#[]/")
_LIMIT = 1 << 31


def robot_path(robot: str) -> tuple[str, ...]:
    """Return the path of a robot; raises `InvalidValue` for a name that is invalid as a key."""
    if not robot or not robot.isprintable() or set(robot) & _FORBIDDEN:
        reason = phrase("in a Realtime Database it must not be empty or contain . $ # [ ] or /")
        raise InvalidValue(key="NAME", value=robot, reason=reason)
    return ("robots", robot)


class Rtdb:
    """A database at an http:// or https:// URL; raises `InvalidValue` for one that contains credentials or needs TLS.

    `default_command` is available after the first connect. `heartbeat` and `silence` are in seconds. `session` is by
    default a new one.
    """

    def __init__(
        self,
        url: str,
        credentials: TokenSource | None = None,
        *,
        heartbeat: float = HEARTBEAT,
        silence: float = _SILENCE,
        session: SupervisorSession | None = None,
    ) -> None:
        self.default_command: str | None = None
        self.needs_journal = True
        self._url = url
        self._credentials = credentials or FixedToken("")
        self._heartbeat = heartbeat
        self._silence = silence
        _check(url, self.where, self._credentials)
        self._session = session or SupervisorSession(self.where)

    @property
    def where(self) -> str:
        """The address without credentials."""
        return where_of(self._url).rstrip("/")

    @asynccontextmanager
    async def connected(self, robot: str, journal: str) -> AsyncIterator[_RtdbChannel]:
        """Connect; raises `SupervisorsNotReached`, `SessionTakenOver`, `InvalidValue` for an invalid robot name."""
        path = robot_path(robot)
        database = Database(self._url, self._credentials, _PATIENCE, self._silence)
        try:
            self.default_command = await _default_command(database, path)
            claims = await self._session.begin(_RtdbSession(database, path), robot, journal)
            async with leaving(claims, partial(_set_presence, database, path)):
                stream = database.stream((*path, "commands"))
                async with stream as chunks, aclosing(events(chunks, _LONGEST_EVENT)) as heard:
                    channel = _RtdbChannel(database, path, claims)
                    await channel.apply_next(heard)
                    await _set_presence(database, path, "ONLINE")
                    beat = partial(beat_with, claims, partial(_set_presence, database, path), self._heartbeat)
                    async with beside(channel.fail, beat, partial(channel.listen, heard)):
                        yield channel
        finally:
            await database.close()


class _RtdbSession:
    """The entry of the session in a database."""

    def __init__(self, database: Database, path: tuple[str, ...]) -> None:
        self._database = database
        self._path = (*path, "session")
        self._tag: str | None = None

    @property
    def where(self) -> str:
        """The address of the database."""
        return self._database.where

    async def read(self) -> Any:
        """Return the entry, and store its ETag."""
        text, self._tag = await self._database.read_tagged(self._path, _LONGEST_EVENT)
        try:
            found = data_of(text)
        except ValueError:
            return None
        return (found | {"claims": _children(found.get("claims"))}) if isinstance(found, dict) else None

    async def swap(self, data: Mapping[str, Any]) -> bool:
        """Write the entry if its ETag is still the stored one; return whether that succeeded."""
        if self._tag is None:
            return False
        written, self._tag = await self._database.write_if(self._path, data, self._tag, _LONGEST_EVENT)
        return written


@dataclass(frozen=True, slots=True)
class _WaitingCommand:
    """A command in the database that is not delivered yet; both fields are None until it is read."""

    id: str | None = None
    text: bytes | None = None


class _RtdbChannel:
    """A connection to a database: it receives open commands from a stream, and writes their progress and results."""

    def __init__(self, database: Database, path: tuple[str, ...], claims: SessionClaims) -> None:
        self._database = database
        self._path = path
        self._claims = claims
        self._waiting: dict[str, _WaitingCommand] = {}
        self._ids: dict[str, str | None] = {}  # of the commands that are delivered and not answered, by key
        self._answered: set[str] = set()  # keys of commands whose removal, with their result, is in progress
        self._changed = asyncio.Event()
        self._error: MayaError | None = None

    def fail(self, error: MayaError) -> None:
        """End the connection."""
        self._error = self._error or error
        self._changed.set()

    async def receive(self) -> SupervisorCommand:
        """Return the next command in the order of their keys."""
        while True:
            self._changed.clear()
            if self._error is not None:
                raise self._error
            key = self._next()
            if key is None:
                await self._changed.wait()
                continue
            if key not in self._claims:
                most = MOST_AT_ONCE - len(self._ids)
                self._claims.keep_only(self._waiting.keys() | self._ids.keys())
                await self._claims.claim(tuple(islice(self._waiting, most)))
                continue
            command = await self._delivered(key)
            if command is None:
                continue
            if not self._claims.is_elsewhere(key):
                return command
            await self.send(self._claims.refusal(command, self._ids[key]))

    async def send(self, report: Report) -> None:
        """Write a report; with a result, remove its command. Do nothing for a command that is no longer open."""
        key = report.key if self._is_open(report.key) else self._key_of(report.id)
        if key is None:
            return
        data = json.loads(report.text)
        if report.kind is ReportKind.RESULT:
            changes = {f"results/{key}": data, f"progress/{key}": None, f"commands/{key}": None}
            self._answered.add(key)
            await self._database.write("PATCH", self._path, changes)
            if key in self._answered:  # else the stream removed it first, and another command may use the key
                self._close(key)
            self._changed.set()
        else:
            await self._database.write("PUT", (*self._path, "progress", key), data)

    async def listen(self, heard: AsyncIterator[ServerSentEvent]) -> None:
        """Follow the stream until it ends; raises `SupervisorsNotReached` then."""
        while True:
            await self.apply_next(heard)

    async def apply_next(self, heard: AsyncIterator[ServerSentEvent]) -> None:
        """Apply the next event of the stream; raises `SupervisorsNotReached` if the event ends the stream."""
        event = await anext(heard, None)
        if event is None:
            raise SupervisorsNotReached(where=self._database.where, reason="it ended the stream of commands")
        if event.name in {"cancel", "auth_revoked"}:
            raise SupervisorsNotReached(where=self._database.where, reason=_ENDS[event.name])
        if event.name in {"put", "patch"}:
            await self._apply(event)
            self._changed.set()

    async def _apply(self, event: ServerSentEvent) -> None:
        try:
            data: Any = data_of(event.data) if event.whole else None
            path, value = _parts(str(data["path"])), data["data"]
        except (KeyError, TypeError, ValueError):
            await self._read_keys()
            return
        if event.name == "patch":
            for name, child in _entries(value).items():  # null removes a child
                self._put((*path, *_parts(name)), child)
        else:
            self._put(path, value)

    def _put(self, path: tuple[str, ...], value: object) -> None:
        """Apply a new value at a path below the commands."""
        if not path:
            found = _children(value)
            self._keep_only(set(found))
            for key in sorted(found, key=_order):
                self._put((key,), found[key])
            return
        key, *deeper = path
        if value is None:
            if not deeper:
                self._close(key)
        elif not self._is_open(key):  # of a partly changed command, the whole is read before its delivery
            self._waiting[key] = _WaitingCommand() if deeper else _WaitingCommand(_id(key, value), _text(value))

    def _keep_only(self, keys: set[str]) -> None:
        for key in (self._waiting.keys() | self._ids.keys()) - keys:
            self._close(key)
        self._claims.keep_only(keys)

    def _close(self, key: str) -> None:
        self._waiting.pop(key, None)
        self._ids.pop(key, None)
        self._answered.discard(key)
        self._claims.forget(key)

    def _is_open(self, key: str | None) -> bool:
        return key in self._waiting or key in self._ids

    async def _read_keys(self) -> None:
        """Read the keys of the open commands, after an event that was too long."""
        text = await self._database.read((*self._path, "commands"), _LONGEST_EVENT, shallow="true")
        try:
            keys = _children(data_of(text))
        except ValueError as error:
            raise SupervisorsNotReached(where=self._database.where, reason="it holds too many commands") from error
        self._keep_only(set(keys))
        for key in sorted(keys, key=_order):
            if not self._is_open(key):
                self._waiting[key] = _WaitingCommand()

    def _next(self) -> str | None:
        """Return the key of the next command to deliver, None if none may be delivered now."""
        return next(iter(self._waiting), None) if len(self._ids) < MOST_AT_ONCE else None

    async def _delivered(self, key: str) -> SupervisorCommand | None:
        """Return a command and record its delivery; None if it is no longer open."""
        waiting = one = self._waiting[key]
        if one.text is None:
            one = _read(key, await self._database.read((*self._path, "commands", key), LONGEST))
        if self._waiting.get(key) is not waiting:
            return None
        if one.text is None:
            self._close(key)
            return None
        del self._waiting[key]
        self._ids[key] = one.id
        return SupervisorCommand(key, one.text, as_id(key))

    def _key_of(self, id_: str | None) -> str | None:
        """Return the key of the open command with an id, None if there is none."""
        ids = chain(self._ids.items(), ((key, one.id) for key, one in self._waiting.items()))
        return next((key for key, found in ids if id_ is not None and found == id_), None)


_ENDS = {
    "cancel": phrase("its rules no longer let this robot read its commands"),
    "auth_revoked": phrase("the credential is no longer valid"),
}


def _check(url: str, where: str, credentials: TokenSource) -> None:
    """Raise `InvalidValue` for an address that contains credentials, or would expose them on the network."""
    parts = urlsplit(url)
    if "@" in parts.netloc or parse_qs(parts.query).keys() - {"ns"}:
        reason = phrase("it must hold no credentials: put them into MAYA_COMS_USER and MAYA_COMS_PASSWORD")
        raise InvalidValue(key="MAYA_COMS_URL", value=where, reason=reason)
    if credentials.secrets and parts.scheme == "http" and parts.hostname not in {"localhost", "127.0.0.1", "::1"}:
        reason = phrase("with credentials it must begin with https://")
        raise InvalidValue(key="MAYA_COMS_URL", value=where, reason=reason)


async def _default_command(database: Database, path: tuple[str, ...]) -> str | None:
    """Return the default command in a robot's document."""
    try:
        document = data_of(await database.read((*path, "document"), LONGEST))
    except ValueError:
        document = None
    found = document.get("default_command") if isinstance(document, dict) else None
    return found if isinstance(found, str) else None


async def _set_presence(database: Database, path: tuple[str, ...], state: str) -> None:
    presence = {"state": state, "at": {".sv": "timestamp"}}
    await database.write("PUT", (*path, "presence"), presence)


async def beat_with(claims: SessionClaims, set_presence: Callable[[str], Awaitable[None]], period: float) -> None:
    """Write presence every `period` seconds; raises `SessionTakenOver` if another robot has taken the session."""
    while True:
        await asyncio.sleep(period)
        await claims.require()
        await set_presence("ONLINE")


@asynccontextmanager
async def leaving(claims: SessionClaims, set_presence: Callable[[str], Awaitable[None]]) -> AsyncIterator[None]:
    """Write at the end of the block that the robot is offline, if that succeeds within `FAREWELL`.

    If the connection was lost or another robot has the name now, write nothing.
    """
    try:
        yield
    except asyncio.CancelledError:
        await _leave(claims, set_presence)
        raise
    await _leave(claims, set_presence)


async def _leave(claims: SessionClaims, set_presence: Callable[[str], Awaitable[None]]) -> None:
    with suppress(TimeoutError, SupervisorsNotReached, SessionTakenOver):
        async with asyncio.timeout(FAREWELL):
            await claims.require()
            await set_presence("OFFLINE")


@asynccontextmanager
async def beside(fail: Callable[[MayaError], None], *work: Callable[[], Awaitable[None]]) -> AsyncIterator[None]:
    """Run work concurrently with the block; `fail` ends the channel at the first error."""

    async def guarded(one: Callable[[], Awaitable[None]]) -> None:
        try:
            await one()
        except MayaError as error:
            fail(error)

    tasks = [asyncio.create_task(guarded(one)) for one in work]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _parts(path: str) -> tuple[str, ...]:
    return tuple(part for part in path.split("/") if part)


def _children(value: object) -> dict[str, Any]:
    """Return the children of a value by their keys."""
    return {key: child for key, child in _entries(value).items() if child is not None}


def _entries(value: object) -> dict[str, Any]:
    """Return the entries of an object, also those with null; the database sends keys 0, 1, … as an array."""
    if isinstance(value, list):
        return {str(index): child for index, child in enumerate(value)}
    return value if isinstance(value, dict) else {}


def _order(key: str) -> tuple[bool, int, str]:
    """Return a sort key for the order of the database: whole numbers of 32 bits first, then the others as text."""
    digits = key.removeprefix("-")
    if digits.isascii() and digits.isdigit() and str(int(key[:12])) == key and -_LIMIT <= int(key) < _LIMIT:
        return (False, int(key), "")
    return (True, 0, key)


def _text(value: object) -> bytes:
    """Return a command as JSON text, identical after each connect; a string is JSON text already."""
    return (value if isinstance(value, str) else json.dumps(value, sort_keys=True)).encode(errors="replace")


def _read(key: str, text: bytes) -> _WaitingCommand:
    """Return the command in a JSON text; for null, one without id and text."""
    try:
        value = data_of(text)
    except ValueError:
        return _WaitingCommand(as_id(key), text)
    return _WaitingCommand() if value is None else _WaitingCommand(_id(key, value), _text(value))


def _id(key: str, value: object) -> str | None:
    """Return the id of a command."""
    with suppress(InvalidRequest, ValueError):
        data = data_of(value.encode()) if isinstance(value, str) else value
        return (id_of(data) if isinstance(data, dict) else None) or as_id(key)
    return None
