"""Documents of Firestore over REST, as much as `maya coms` and Firestore's small library for JavaScript need.

The calls are commit (update, delete, preconditions, the time of the server), batchGet, runQuery over one collection,
and the reading of one document. Security rules are not known here: every caller has full access, with or without a
token.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import count
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from tests.system.rtdb.rest import bearer
from tests.system.rtdb.store import OWNER, BadTokenError, Store

ROOT = "projects/demo/databases/(default)/documents/"

Fields = dict[str, Any]


class RefusedError(Exception):
    """A call that is refused: status of HTTP, status of Google, sentence."""

    def __init__(self, code: int, status: str, message: str) -> None:
        super().__init__(message)
        self.answer = JSONResponse({"error": {"code": code, "message": message, "status": status}}, code)


@dataclass(frozen=True, slots=True)
class Document:
    """A document: its fields in the form of the protocol, and its dates."""

    fields: Fields
    created: str
    updated: str


class Documents:
    """The documents by their path; `written` lists every write: path and data, None for a removal.

    `tokens` are those that were shown and valid.
    """

    def __init__(self, store: Store) -> None:
        self.tokens: set[str] = set()
        self.written: list[tuple[str, Any]] = []
        self._store = store
        self._documents: dict[str, Document] = {}
        self._instants = count()

    def set(self, path: str, data: Fields | None) -> None:
        """Replace a document, given as JSON data, or remove it."""
        name = ROOT + path
        fields = None if data is None else {key: _value(one) for key, one in data.items()}
        self._commit([{"delete": name} if fields is None else {"update": {"name": name, "fields": fields}}])

    def data(self, path: str) -> Any:
        """Return a document as JSON data."""
        found = self._documents.get(path)
        return None if found is None else {name: _data(value) for name, value in found.fields.items()}

    def revoke_all(self) -> None:
        """Make every token that was shown invalid, except that of the owner."""
        self._store.revoked |= self.tokens - {"", OWNER}

    async def call(self, request: Request) -> Response:
        """Answer commit and batchGet."""
        return await self._answered(request, "", request.path_params["call"])

    async def answer(self, request: Request) -> Response:
        """Answer the reading of a document, and runQuery below one."""
        path, _, call = request.path_params["path"].partition(":")
        return await self._answered(request, path, call)

    async def _answered(self, request: Request, path: str, call: str) -> Response:
        body = await request.body()
        try:
            self.tokens.add(self._store.caller(bearer(request.headers.get("authorization", ""))).token)
            return JSONResponse(self._called(path, call, json.loads(body)) if body else self._one(path))
        except BadTokenError as error:
            return RefusedError(401, "UNAUTHENTICATED", str(error)).answer
        except RefusedError as error:
            return error.answer

    def _called(self, path: str, call: str, asked: dict[str, Any]) -> dict[str, Any] | list[dict[str, Any]]:
        if call == "commit":
            return self._commit(asked["writes"])
        if call == "batchGet":
            return [self._found(name) for name in asked["documents"]]
        if call == "runQuery":
            return self._query(path, asked["structuredQuery"])
        raise RefusedError(400, "INVALID_ARGUMENT", f"not known here: {call}")

    def _one(self, path: str) -> dict[str, Any]:
        if path not in self._documents:
            raise RefusedError(404, "NOT_FOUND", "Document not found.")
        return self._shown(path)

    def _shown(self, path: str) -> dict[str, Any]:
        one = self._documents[path]
        return {"name": ROOT + path, "fields": one.fields, "createTime": one.created, "updateTime": one.updated}

    def _found(self, name: str) -> dict[str, Any]:
        path = name.removeprefix(ROOT)
        here = path in self._documents
        return {"readTime": self._now()} | ({"found": self._shown(path)} if here else {"missing": name})

    def _query(self, parent: str, query: Mapping[str, Any]) -> list[dict[str, Any]]:
        if query.keys() - {"from", "select", "limit", "orderBy"} or "where" in query:
            raise RefusedError(400, "INVALID_ARGUMENT", f"not known here: {sorted(query)}")
        (source,) = query["from"]
        before = "/".join(filter(None, (parent, source["collectionId"]))) + "/"
        below = [path for path in sorted(self._documents) if path.startswith(before) and "/" not in path[len(before) :]]
        found = [self._shown(path) for path in below[: query.get("limit")]]
        wanted = {one["fieldPath"] for one in query.get("select", {}).get("fields", [])}
        if wanted:
            found = [
                one | {"fields": {key: one["fields"][key] for key in wanted & one["fields"].keys()}} for one in found
            ]
        return [{"document": one, "readTime": self._now()} for one in found] or [{"readTime": self._now()}]

    def _commit(self, writes: list[dict[str, Any]]) -> dict[str, Any]:
        now, new = self._now(), dict(self._documents)
        for write in writes:
            path = str(write["delete"] if "delete" in write else write["update"]["name"]).removeprefix(ROOT)
            _check(path, new.get(path), write.get("currentDocument", {}))
            if "delete" in write:
                new.pop(path, None)
                continue
            fields = _merged(write, new.get(path))
            for transform in write.get("updateTransforms", []):
                fields[transform["fieldPath"]] = {"timestampValue": now}
            old = new.get(path)
            new[path] = Document(fields, now if old is None else old.created, now)
        self._documents = new
        for write in writes:
            path = str(write["delete"] if "delete" in write else write["update"]["name"]).removeprefix(ROOT)
            self.written.append((path, self.data(path)))
        self._store.written()
        return {"writeResults": [{"updateTime": now} for _ in writes], "commitTime": now}

    def _now(self) -> str:
        """Return the date, each later than the last; without digits that are zero, as Firestore writes it."""
        now = datetime.now(UTC)
        return f"{now:%Y-%m-%dT%H:%M:%S}.{now.microsecond:06}{next(self._instants) % 1000:03}".rstrip("0") + "Z"


def _check(path: str, old: Document | None, wanted: Mapping[str, Any]) -> None:
    """Refuse a write whose precondition does not hold."""
    if wanted.get("exists") is True and old is None:
        raise RefusedError(404, "NOT_FOUND", f"No document to update: {path}")
    if wanted.get("exists") is False and old is not None:
        raise RefusedError(409, "ALREADY_EXISTS", f"Document already exists: {path}")
    if "updateTime" in wanted and (old is None or old.updated != wanted["updateTime"]):
        raise RefusedError(400, "FAILED_PRECONDITION", f"{path} has another update time")


def _merged(write: Mapping[str, Any], old: Document | None) -> Fields:
    """Return the fields after a write: all of them, or those of its mask beside the others."""
    fields = dict(write["update"].get("fields", {}))
    if "updateMask" not in write:
        return fields
    kept = {} if old is None else deepcopy(old.fields)
    for name in write["updateMask"].get("fieldPaths", []):
        kept.pop(name, None)
    return kept | fields


def _value(data: Any) -> dict[str, Any]:
    """Return JSON data as a value of the protocol."""
    if isinstance(data, dict):
        return {"mapValue": {"fields": {name: _value(one) for name, one in data.items()}}}
    if isinstance(data, list):
        return {"arrayValue": {"values": [_value(one) for one in data]}}
    kinds = {
        bool: "booleanValue",
        int: "integerValue",
        float: "doubleValue",
        str: "stringValue",
        type(None): "nullValue",
    }
    return {kinds[type(data)]: str(data) if type(data) is int else data}


def _data(value: Mapping[str, Any]) -> Any:
    """Return a value of the protocol as JSON data."""
    ((kind, found),) = value.items()
    if kind == "mapValue":
        return {name: _data(one) for name, one in found.get("fields", {}).items()}
    if kind == "arrayValue":
        return [_data(one) for one in found.get("values", [])]
    return {"integerValue": int, "doubleValue": float}.get(kind, lambda one: one)(found)
