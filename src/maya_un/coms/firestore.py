"""Supervisors by Firestore over REST: firestore://PROJECT.

Firestore's own library requires gRPC. FIRESTORE_EMULATOR_HOST changes the address, as in Google's own libraries.

    /robots/ROBOT                  {"database_url"?, "default_command"?}; read once at each connect
    /robots/ROBOT/commands/KEY     {"command", "args", "id"?, "robot"?, "deadline"?}; a supervisor adds it
    /robots/ROBOT/progress/KEY     {"id", "state", "date"}: the step is accepted or begins; removed with its command
    /robots/ROBOT/results/KEY      the result; written and the command removed in one commit
    /robots/ROBOT/state/presence   {"state": "ONLINE" or "OFFLINE", "at": the server's time}, every 10 s
    /robots/ROBOT/state/session    which robot of this name is served, and which commands were taken: see session.py

If the robot's document names a Realtime Database, that database carries the steps, and Firestore is used for nothing
else. A command without an id has its KEY as id. REST does not report changes, so this module queries commands every
`INTERVAL`. A result is written only if its command still exists: Firestore checks that in the same commit.
"""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any
from urllib.parse import quote, urlsplit

import httpx

from dmc41x3.i18n import phrase
from maya_un.coms.agent import LONGEST
from maya_un.coms.database import NoToken, TokenSource, data_of, masked, message_of, tls_context
from maya_un.coms.rtdb import HEARTBEAT, MOST_AT_ONCE, Rtdb, beat_with, beside, leaving, robot_path
from maya_un.coms.session import SessionClaims, SupervisorSession
from maya_un.coms.settings import where_of
from maya_un.coms.transport import Report, ReportKind, SupervisorChannel, SupervisorCommand
from maya_un.errors import InvalidRequest, MayaError, SupervisorsNotReached
from maya_un.steps.text import as_id, id_of

LONGEST_DOCUMENT = 1 << 20
"""Maximum number of bytes read from an answer; Firestore itself stores no longer document."""

_LONGEST_ENTRY = 10_000
"""Maximum size of a document in a list of keys [bytes]: a key has up to 1500 bytes, some of them as \\uXXXX."""

_PATIENCE = 10.0
"""Timeout of the answer to a request [s]."""

_NOT_FOUND = 404
_INVALID = 400
_FORBIDDEN = 403
_PERHAPS_CHANGED = (_INVALID, 409)
_REFUSED = (401, _FORBIDDEN)

Path = tuple[str, ...]


class Documents:
    """The documents of a project; `where` is its address without credentials."""

    def __init__(self, project: str, where: str, tokens: TokenSource) -> None:
        emulator = os.environ.get("FIRESTORE_EMULATOR_HOST")
        host = f"http://{emulator}" if emulator else "https://firestore.googleapis.com"
        self._root = f"projects/{project}/databases/(default)/documents"
        self._base = f"{host}/v1/{quote(self._root)}"
        self.where = where
        self._tokens = tokens
        self._http = httpx.AsyncClient(timeout=_PATIENCE, verify=tls_context())

    async def close(self) -> None:
        """Close every connection."""
        await self._http.aclose()

    async def read(self, path: Path) -> dict[str, Any] | None:
        """Return a document as data, None if it does not exist; raises `ValueError` if it is too long."""
        return (await self.read_dated(path))[0]

    async def read_dated(self, path: Path) -> tuple[dict[str, Any] | None, str]:
        """Return a document as `read` does, and the date of its last change, "" if it does not exist."""
        async with self._answer("GET", "/" + "/".join(quote(part, safe="") for part in path)) as answer:
            if answer.status_code == _NOT_FOUND:
                await _beginning(answer)  # a connection serves the next request after its answer is read to the end
                return None, ""
            document = await self._read(answer)
        fields = {name: _data(value) for name, value in document.get("fields", {}).items()}
        return fields, str(document.get("updateTime", ""))

    async def keys(self, path: Path, most: int) -> list[str]:
        """Return the keys of at most `most` documents of a collection, in the order of their creation."""
        query = {"from": [{"collectionId": path[-1]}], "select": {"fields": [{"fieldPath": "__name__"}]}, "limit": most}
        parent = "/".join(quote(part, safe="") for part in path[:-1])
        async with self._answer("POST", f"/{parent}:runQuery", {"structuredQuery": query}) as answer:
            try:
                answers = await self._read(answer, most * _LONGEST_ENTRY)
                found = [one["document"] for one in answers if "document" in one]
                dated = [(_date(one["createTime"]), one["name"].rpartition("/")[2]) for one in found]
            except (KeyError, TypeError, ValueError) as error:
                raise self.error(phrase("its answer cannot be read")) from error
        return [key for _, key in sorted(dated)]

    async def commit(self, *writes: dict[str, Any], needed: Path | None = None) -> bool:
        """Write all or nothing; return False if a precondition failed, as for a document that must exist and does not.

        Security rules may allow the commit only while the `needed` document exists. Then they refuse it (403) before
        Firestore checks the precondition; this also returns False.
        """
        accepted = () if needed is None else (_FORBIDDEN,)
        async with self._answer("POST", ":commit", {"writes": writes}, accepted) as answer:
            text = await _beginning(answer)  # a connection serves the next request after its answer is read to the end
        if answer.status_code == _FORBIDDEN and needed is not None and await self._exists(needed):
            raise self.error(
                phrase("it answers {status}: {message}", status=answer.status_code, message=message_of(text))
            )
        return answer.is_success

    async def _exists(self, path: Path) -> bool:
        async with self._answer("GET", "/" + "/".join(quote(part, safe="") for part in path)) as answer:
            return answer.is_success

    async def swap(self, path: Path, data: Mapping[str, Any], date: str) -> str | None:
        """Write a document if the date of its last change is still `date` ("": if it does not exist).

        Return the new date, None if another program changed the document.
        """
        before: dict[str, Any] = {"updateTime": date} if date else {"exists": False}
        writes = [self.put(path, data) | {"currentDocument": before}]
        async with self._answer("POST", ":commit", {"writes": writes}, accepted=_PERHAPS_CHANGED) as answer:
            text = await _beginning(answer)
        if answer.is_success:
            try:
                return str(data_of(text)["writeResults"][0]["updateTime"])
            except (KeyError, IndexError, TypeError, ValueError) as error:
                raise self.error(phrase("its answer cannot be read")) from error
        if answer.status_code == _INVALID and b"FAILED_PRECONDITION" not in text:
            raise self.error(
                phrase("it answers {status}: {message}", status=answer.status_code, message=message_of(text))
            )
        return None

    def put(self, path: Path, data: Mapping[str, Any], time: str | None = None) -> dict[str, Any]:
        """Return the write of a document; the field `time` gets the time of the server."""
        document = {"name": self._name(path), "fields": {name: _value(value) for name, value in data.items()}}
        if time is None:
            return {"update": document}
        return {"update": document, "updateTransforms": [{"fieldPath": time, "setToServerValue": "REQUEST_TIME"}]}

    def remove(self, path: Path, *, there: bool = False) -> dict[str, Any]:
        """Return the removal of a document; with `there`, the commit fails if the document does not exist."""
        return {"delete": self._name(path)} | ({"currentDocument": {"exists": True}} if there else {})

    def error(self, reason: str) -> SupervisorsNotReached:
        """Return the error for a reason; credentials in the reason are masked."""
        return SupervisorsNotReached(where=self.where, reason=masked(reason, self._tokens.secrets))

    def _name(self, path: Path) -> str:
        return "/".join((self._root, *path))

    @asynccontextmanager
    async def _answer(
        self, method: str, path: str, body: object = None, accepted: tuple[int, ...] = ()
    ) -> AsyncIterator[httpx.Response]:
        """Send a request and yield its answer, including 404 (not found) and the status codes in `accepted`.

        Raises `SupervisorsNotReached` for any other unsuccessful answer.
        """
        answer = None
        try:
            answer = await self._sent(method, path, body)
            if answer.status_code in _REFUSED and self._tokens.refused():
                await answer.aclose()
                answer = await self._sent(method, path, body)
            if not answer.is_success and answer.status_code not in (_NOT_FOUND, *accepted):
                raise self.error(
                    phrase(
                        "it answers {status}: {message}",
                        status=answer.status_code,
                        message=message_of(await _beginning(answer)),
                    )
                )
            yield answer
        except (httpx.HTTPError, NoToken) as error:
            reason = "it does not answer in time" if isinstance(error, httpx.TimeoutException) else str(error)
            raise self.error(reason or type(error).__name__) from None
        finally:
            if answer is not None:
                await answer.aclose()

    async def _sent(self, method: str, path: str, body: object) -> httpx.Response:
        content = None if body is None else json.dumps(body)
        try:
            token = await self._tokens.token(self._http)
            headers = {"Content-Type": "application/json"} | ({"Authorization": f"Bearer {token}"} if token else {})
            request = self._http.build_request(method, self._base + path, content=content, headers=headers)
            return await self._http.send(request, stream=True)
        except (httpx.InvalidURL, UnicodeError) as error:
            raise self.error(str(error)) from None

    async def _read(self, answer: httpx.Response, longest: int = LONGEST_DOCUMENT) -> Any:
        """Return an answer as data; raises `ValueError` if it is longer than `longest` bytes or not JSON."""
        if answer.status_code == _NOT_FOUND:
            raise self.error(
                phrase(
                    "it answers {status}: {message}",
                    status=answer.status_code,
                    message=message_of(await _beginning(answer)),
                )
            )
        text = await _beginning(answer, longest)
        if len(text) > longest:
            raise ValueError("too long")
        return data_of(text)


async def _beginning(answer: httpx.Response, longest: int = LONGEST_DOCUMENT) -> bytes:
    """Return a body; of a body longer than `longest` bytes, return the first `longest` + 1 bytes."""
    found = bytearray()
    async for chunk in answer.aiter_bytes():
        found += chunk[: longest + 1 - len(found)]
        if len(found) > longest:
            break
    return bytes(found)


def _date(text: str) -> tuple[str, str]:
    """Return a date of Firestore, which has 0 to 9 digits after the seconds, as a key for sorting."""
    seconds, _, rest = text.removesuffix("Z").partition(".")
    return seconds, rest.ljust(9, "0")


def _data(value: Mapping[str, Any]) -> Any:
    """Return a value of Firestore as JSON data; dates, bytes and references are texts."""
    match next(iter(value.items()), ("nullValue", None)):
        case "nullValue", _:
            return None
        case "integerValue", number:
            return int(number)
        case "doubleValue", number:
            return float(number)
        case "arrayValue", array:
            return [_data(one) for one in array.get("values", [])]
        case "mapValue", below:
            return {name: _data(one) for name, one in below.get("fields", {}).items()}
        case _, plain:
            return plain


_KINDS = {bool: "booleanValue", float: "doubleValue", str: "stringValue", type(None): "nullValue"}


def _value(data: Any) -> dict[str, Any]:
    """Return JSON data as a value of Firestore."""
    if isinstance(data, dict):
        return {"mapValue": {"fields": {name: _value(one) for name, one in data.items()}}}
    if isinstance(data, list):
        return {"arrayValue": {"values": [_value(one) for one in data]}}
    if isinstance(data, int) and not isinstance(data, bool):
        return {"integerValue": str(data)}
    return {_KINDS[type(data)]: data}


INTERVAL = 0.5
"""Pause between two queries while no command is open [s]; each query costs one read, 172 800 reads a day.

It is shorter than `maya_un.steps.text.QUIET`: the robot refuses a command from before a stop only if the command
arrives within that time after the stop.
"""


class Firestore:
    """The Firestore of a project at firestore://PROJECT.

    `default_command`, the command of a step that names none, is known after the first connect.
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
        """The address without credentials."""
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
                raise documents.error(
                    phrase("the database_url of robots/{robot} is not like https://NAME.firebaseio.com", robot=robot)
                )
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
        """Return the entry, and store the date of its last change."""
        try:
            found, self._date = await self._documents.read_dated(self._path)
        except (AttributeError, RecursionError, TypeError, ValueError) as error:
            raise self._documents.error(
                phrase("the document {path} cannot be read", path="/".join(self._path))
            ) from error
        return found

    async def swap(self, data: Mapping[str, Any]) -> bool:
        """Write the entry if the date of its last change is still the stored one; return whether that succeeded."""
        if self._date is None:
            return False
        self._date = await self._documents.swap(self._path, data, self._date)
        return self._date is not None


class _FirestoreChannel:
    """A connection to Firestore: it delivers the open commands and writes their reports."""

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
        if len(keys) < MOST_AT_ONCE:  # else there may be more commands
            for key in before - set(keys):
                self._close(key)  # another program removed the command
            self._claims.keep_only(keys)
        self._waiting = [key for key in keys if key not in self._ids]

    async def _delivered(self, key: str) -> SupervisorCommand | None:
        """Return a command and record its delivery; None if it no longer exists."""
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
    """Return the document of a robot; raises `SupervisorsNotReached` if it does not exist or cannot be read."""
    try:
        found = await documents.read(path)
    except (AttributeError, RecursionError, TypeError, ValueError) as error:
        raise documents.error(phrase("the document {path} cannot be read", path="/".join(path))) from error
    if found is None:
        raise documents.error(phrase("there is no document {path}: write it, it may be empty", path="/".join(path)))
    return found


async def _set_presence(documents: Documents, path: tuple[str, ...], state: str) -> None:
    await documents.commit(documents.put((*path, "state", "presence"), {"state": state}, time="at"))
