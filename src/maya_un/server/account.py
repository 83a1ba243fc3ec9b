"""Records of requests: each is counted, and logged if it changed something or failed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from starlette.routing import BaseRoute, Route
from starlette.types import Message, Scope, Send

from maya_un.server.log import note
from maya_un.server.metrics import Metrics

NOWHERE = "-"
"""The path, as it is counted, of requests that no route takes."""

_LOOKING = frozenset({"GET", "HEAD", "OPTIONS"})
_UNSAID = frozenset({HTTPStatus.TOO_MANY_REQUESTS})
_METHODS = frozenset({"GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"})
_LONGEST = 200


class AccessLogEntry:
    """Follows one request from its beginning."""

    def __init__(self, scope: Scope, metrics: Metrics) -> None:
        self._scope = scope
        self._metrics = metrics
        self._method: str = scope["method"]
        self._path: str = scope["path"]
        self._began = asyncio.get_running_loop().time()
        self._status = HTTPStatus.INTERNAL_SERVER_ERROR.value

    def watching(self, send: Send) -> Send:
        """Return a `send` that takes notice of the answer."""

        async def sent(message: Message) -> None:
            await send(message)
            if message["type"] == "http.response.start":
                self._status = message["status"]
            elif message["type"] == "http.response.body" and not message.get("more_body"):
                self._close()

        return sent

    def _close(self) -> None:
        seconds = asyncio.get_running_loop().time() - self._began
        method = self._method if self._method in _METHODS else NOWHERE
        self._metrics.answered(method, _declared(self._scope.get("route")), self._status, seconds)
        failed = self._status >= HTTPStatus.INTERNAL_SERVER_ERROR
        refused = self._status >= HTTPStatus.BAD_REQUEST and self._status not in _UNSAID
        if refused or self._method not in _LOOKING:
            self._write(logging.WARNING if failed else logging.INFO, seconds)

    def _write(self, level: int, seconds: float) -> None:
        state: Mapping[str, Any] = self._scope["state"]
        path = self._path[:_LONGEST]
        note(
            "http",
            level,
            f"{self._method[:16]} {path} {self._status}",
            request=state["request"],
            method=self._method,
            path=path,
            status=self._status,
            code=state.get("code", 0),
            who=state.get("who", ""),
            source=(self._scope.get("client") or ("",))[0],
            seconds=round(seconds, 6),
        )


def _declared(route: BaseRoute | None) -> str:
    return route.path_format if isinstance(route, Route) else NOWHERE
