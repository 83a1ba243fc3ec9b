"""Documents of Firestore over REST: read one, list the keys of a collection, write several at once.

Firestore's own library would bring gRPC. REST reports no changes, so a caller asks again until a document
exists. FIRESTORE_EMULATOR_HOST changes the address, as in Google's own libraries.
"""

from __future__ import annotations

import json
import os
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any
from urllib.parse import quote

import httpx

from maya_un.coms.database import data_of
from maya_un.coms.firebase_auth import NoToken, TokenSource, message_of
from maya_un.errors import SupervisorsNotReached

LONGEST = 1 << 20
"""Bytes of an answer that are read; Firestore itself keeps no longer document."""

_LONGEST_ENTRY = 10_000
"""Bytes of an answer that a document needs in a list of keys, at most: a key has up to 1500 bytes, some as \\uXXXX."""

_PATIENCE = 10.0
"""For the answer to a request [s]."""

_NOT_FOUND = 404
_INVALID = 400
_FORBIDDEN = 403
_PERHAPS_CHANGED = (_INVALID, 409)
_REFUSED = (401, _FORBIDDEN)

Path = tuple[str, ...]


class Documents:
    """The documents of a project; `where` is its address as people may read it."""

    def __init__(self, project: str, where: str, tokens: TokenSource) -> None:
        emulator = os.environ.get("FIRESTORE_EMULATOR_HOST")
        host = f"http://{emulator}" if emulator else "https://firestore.googleapis.com"
        self._root = f"projects/{project}/databases/(default)/documents"
        self._base = f"{host}/v1/{quote(self._root)}"
        self.where = where
        self._tokens = tokens
        self._http = httpx.AsyncClient(timeout=_PATIENCE)

    async def close(self) -> None:
        """Close every connection."""
        await self._http.aclose()

    async def read(self, path: Path) -> dict[str, Any] | None:
        """Return a document as data, None if there is none; raises `ValueError` for one that is too long."""
        return (await self.read_dated(path))[0]

    async def read_dated(self, path: Path) -> tuple[dict[str, Any] | None, str]:
        """Return a document as `read` does, and the date of its last change, "" if there is none."""
        async with self._answer("GET", "/" + "/".join(quote(part, safe="") for part in path)) as answer:
            if answer.status_code == _NOT_FOUND:
                await _beginning(answer)  # a connection serves the next request after its answer is read to the end
                return None, ""
            document = await self._read(answer)
        fields = {name: _data(value) for name, value in document.get("fields", {}).items()}
        return fields, str(document.get("updateTime", ""))

    async def keys(self, path: Path, most: int) -> list[str]:
        """Return the keys of at most so many documents of a collection, in the order of their creation."""
        query = {"from": [{"collectionId": path[-1]}], "select": {"fields": [{"fieldPath": "__name__"}]}, "limit": most}
        parent = "/".join(quote(part, safe="") for part in path[:-1])
        async with self._answer("POST", f"/{parent}:runQuery", {"structuredQuery": query}) as answer:
            try:
                answers = await self._read(answer, most * _LONGEST_ENTRY)
                found = [one["document"] for one in answers if "document" in one]
                dated = [(_date(one["createTime"]), one["name"].rpartition("/")[2]) for one in found]
            except (KeyError, TypeError, ValueError) as error:
                raise self.error("its answer cannot be read") from error
        return [key for _, key in sorted(dated)]

    async def commit(self, *writes: dict[str, Any], needed: Path | None = None) -> bool:
        """Write all or nothing; return False if a document that must be there is not.

        If security rules allow the commit only while the `needed` document is there, they refuse it before Firestore
        looks for that document.
        """
        accepted = () if needed is None else (_FORBIDDEN,)
        async with self._answer("POST", ":commit", {"writes": writes}, accepted) as answer:
            text = await _beginning(answer)  # a connection serves the next request after its answer is read to the end
        if answer.status_code == _FORBIDDEN and needed is not None and await self._exists(needed):
            raise self.error(f"it answers {answer.status_code}: {message_of(text)}")
        return answer.is_success

    async def _exists(self, path: Path) -> bool:
        async with self._answer("GET", "/" + "/".join(quote(part, safe="") for part in path)) as answer:
            return answer.is_success

    async def swap(self, path: Path, data: Mapping[str, Any], date: str) -> str | None:
        """Write a document if its last change has still this date ("": if there is none).

        Return the new date, None if somebody else changed it.
        """
        before: dict[str, Any] = {"updateTime": date} if date else {"exists": False}
        writes = [self.put(path, data) | {"currentDocument": before}]
        async with self._answer("POST", ":commit", {"writes": writes}, accepted=_PERHAPS_CHANGED) as answer:
            text = await _beginning(answer)
        if answer.is_success:
            try:
                return str(data_of(text)["writeResults"][0]["updateTime"])
            except (KeyError, IndexError, TypeError, ValueError) as error:
                raise self.error("its answer cannot be read") from error
        if answer.status_code == _INVALID and b"FAILED_PRECONDITION" not in text:
            raise self.error(f"it answers {answer.status_code}: {message_of(text)}")
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
        """Return the error for a reason; credentials in the reason are hidden."""
        for secret in self._tokens.secrets:
            reason = reason.replace(secret, "***")
        return SupervisorsNotReached(where=self.where, reason=reason)

    def _name(self, path: Path) -> str:
        return "/".join((self._root, *path))

    @asynccontextmanager
    async def _answer(
        self, method: str, path: str, body: object = None, accepted: tuple[int, ...] = ()
    ) -> AsyncIterator[httpx.Response]:
        """Send a request and yield its answer, also 404 (not found) and those of `accepted`.

        Raises `SupervisorsNotReached` otherwise.
        """
        answer = None
        try:
            answer = await self._sent(method, path, body)
            if answer.status_code in _REFUSED and self._tokens.refused():
                await answer.aclose()
                answer = await self._sent(method, path, body)
            if not answer.is_success and answer.status_code not in (_NOT_FOUND, *accepted):
                raise self.error(f"it answers {answer.status_code}: {message_of(await _beginning(answer))}")
            yield answer
        except (httpx.HTTPError, NoToken) as error:
            reason = "it does not answer in time" if isinstance(error, httpx.TimeoutException) else str(error)
            raise self.error(reason or type(error).__name__) from None
        finally:
            if answer is not None:
                await answer.aclose()

    async def _sent(self, method: str, path: str, body: object) -> httpx.Response:
        token = await self._tokens.token(self._http)
        content = None if body is None else json.dumps(body)
        headers = {"Content-Type": "application/json"} | ({"Authorization": f"Bearer {token}"} if token else {})
        request = self._http.build_request(method, self._base + path, content=content, headers=headers)
        return await self._http.send(request, stream=True)

    async def _read(self, answer: httpx.Response, longest: int = LONGEST) -> Any:
        """Return an answer as data; raises `ValueError` for one that is longer than so many bytes, or not JSON."""
        if answer.status_code == _NOT_FOUND:
            raise self.error(f"it answers {answer.status_code}: {message_of(await _beginning(answer))}")
        text = await _beginning(answer, longest)
        if len(text) > longest:
            raise ValueError("too long")
        return data_of(text)


async def _beginning(answer: httpx.Response, longest: int = LONGEST) -> bytes:
    """Return a body; of a body longer than `longest`, return one byte more than that."""
    found = bytearray()
    async for chunk in answer.aiter_bytes():
        found += chunk[: longest + 1 - len(found)]
        if len(found) > longest:
            break
    return bytes(found)


def _date(text: str) -> tuple[str, str]:
    """Return a date of Firestore as a key for sorting: it has 0 to 9 digits after the seconds."""
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
