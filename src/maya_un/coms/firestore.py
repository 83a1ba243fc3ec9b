"""Supervisors whose Firestore tells where a robot's Realtime Database is: firestore://PROJECT.

The document robots/NAME is read once at each connect: `database_url`, and `default_command` if a step without a command
means one. Steps go by the Realtime Database. It is read over Firestore's REST, because its library would bring gRPC.
FIRESTORE_EMULATOR_HOST moves the address, as in Google's own libraries.
"""

from __future__ import annotations

import os
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any
from urllib.parse import quote, urlsplit

import httpx

from maya_un.coms.agent import LONGEST
from maya_un.coms.database import data_of
from maya_un.coms.firebase_auth import NoToken, TokenSource, message_of
from maya_un.coms.rtdb import Rtdb, robot_path
from maya_un.coms.settings import where_of
from maya_un.coms.transport import Channel
from maya_un.errors import SupervisorsNotReached

_PATIENCE = 10.0
"""For the answer to a request [s]."""


class Firestore:
    """The Firestore of a project at firestore://PROJECT; `default_command` is known after the first connect."""

    def __init__(self, url: str, tokens: TokenSource) -> None:
        self.default_command: str | None = None
        self._project = urlsplit(url).hostname or ""
        self._where = where_of(url)
        self._tokens = tokens

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return self._where

    @asynccontextmanager
    async def connected(self, robot: str) -> AsyncIterator[Channel]:
        """Connect to the database that the document of the robot names; raises as `Rtdb.connected` does."""
        robot_path(robot)
        document = await self._document(robot)
        url = document.get("database_url")
        if not isinstance(url, str) or urlsplit(url).scheme not in {"http", "https"}:
            raise self._error(f"the document robots/{robot} has no database_url like https://NAME.firebaseio.com")
        database = Rtdb(url, self._tokens)
        async with database.connected(robot) as channel:
            found = document.get("default_command")
            self.default_command = found if isinstance(found, str) else database.default_command
            yield channel

    async def _document(self, robot: str) -> dict[str, object]:
        """Return the fields of a robot's document."""
        emulator = os.environ.get("FIRESTORE_EMULATOR_HOST")
        base = f"http://{emulator}" if emulator else "https://firestore.googleapis.com"
        path = f"/v1/projects/{quote(self._project)}/databases/(default)/documents/robots/{quote(robot, safe='')}"
        try:
            async with httpx.AsyncClient(timeout=_PATIENCE) as http:
                answer = await self._answer(http, base + path)
                if answer.status_code in {401, 403} and self._tokens.refused():
                    answer = await self._answer(http, base + path)
        except (httpx.HTTPError, NoToken) as error:
            raise self._error(str(error) or type(error).__name__) from None
        if not answer.is_success:
            raise self._error(f"it answers {answer.status_code}: {message_of(answer.content)}")
        try:
            return fields_of(data_of(answer.content[: LONGEST + 1]))
        except (AttributeError, TypeError, ValueError) as error:
            raise self._error(f"the document robots/{robot} cannot be read") from error

    async def _answer(self, http: httpx.AsyncClient, url: str) -> httpx.Response:
        token = await self._tokens.token(http)
        return await http.get(url, headers={"Authorization": f"Bearer {token}"} if token else {})

    def _error(self, reason: str) -> SupervisorsNotReached:
        for secret in self._tokens.secrets:
            reason = reason.replace(secret, "***")
        return SupervisorsNotReached(where=self._where, reason=reason)


def fields_of(document: Mapping[str, Any]) -> dict[str, object]:
    """Return the texts among the fields of a document: {"fields": {NAME: {"stringValue": …}}}."""
    found: Mapping[str, Mapping[str, object]] = document.get("fields", {})
    return {name: value["stringValue"] for name, value in found.items() if "stringValue" in value}
