"""HTTP server specified by the manual: POST /connect, POST /disconnect, GET /status, on loopback."""

from __future__ import annotations

import asyncio
import signal
import socket
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.base import BaseHTTPMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from maya_un.coms.agent import Agent
from maya_un.errors import InternalError, InvalidRequest, MayaError
from maya_un.http.origins import OriginPolicy

_EDGE = OriginPolicy()


class AgentSwitch:
    """Connects and disconnects an agent; idle at first. `made` returns the agent of the robot `name`.

    `password_in_clear` is True if the agent sends its password unencrypted.
    """

    def __init__(self, made: Callable[[], Agent], name: str, *, password_in_clear: bool = False) -> None:
        self._made = made
        self._name = name
        self._password_in_clear = password_in_clear
        self._agent: Agent | None = None
        self._running: asyncio.Task[None] | None = None
        self._failure: MayaError | None = None

    def connect(self) -> None:
        """Connect, unless an agent is running. Raises the `MayaError` that prevented the making of the agent."""
        if self._running is None or self._running.done():
            self._agent, self._failure = self._made(), None
            self._running = asyncio.get_running_loop().create_task(self._agent.run(), name="agent")
            self._running.add_done_callback(self._note_end)

    def _note_end(self, running: asyncio.Task[None]) -> None:
        """Record and log the error that ended the agent; only a defect of this program ends it."""
        error = None if running.cancelled() else running.exception()
        if error is not None:
            if running is self._running:  # otherwise another agent has been connected since
                self._failure = InternalError(reason=_kind(error))  # its text could contain a credential
            running.get_loop().call_exception_handler({"message": "the agent ended", "exception": error})

    async def disconnect(self) -> None:
        """Disconnect; the current step continues, and its result is sent after the next connect."""
        running, self._running, self._agent = self._running, None, None
        if running is not None:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)

    def status(self) -> dict[str, Any]:
        """Return the state, as JSON data."""
        if self._agent is None or self._running is None:
            return {"state": "idle", "name": self._name}
        status: dict[str, Any] = {**self._agent.status(), "password_in_clear": self._password_in_clear}
        if self._failure is not None:
            return {"state": "failed", **_failed(status, self._failure)}
        both = status["robot"]["connected"] and status["supervisors"]["connected"]
        return {"state": "connected" if both else "connecting", **status}


class _AgentServer(uvicorn.Server):
    """Server that ends at Ctrl-C and SIGTERM; uvicorn would raise the signal again before connections are closed."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """End the server at SIGINT or SIGTERM."""
        loop = asyncio.get_running_loop()
        for kind in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(kind, self._end)
        yield

    def _end(self) -> None:
        self.should_exit = True


def application(switch: AgentSwitch) -> Starlette:
    """Return the Starlette application."""

    async def connect(_: Request) -> Response:
        try:
            switch.connect()
        except MayaError as error:
            return _problem(error)
        return JSONResponse(switch.status())

    async def disconnect(_: Request) -> Response:
        await switch.disconnect()
        return JSONResponse(switch.status())

    async def status(_: Request) -> Response:
        return JSONResponse(switch.status())

    routes = [
        Route("/connect", connect, methods=["POST"]),
        Route("/disconnect", disconnect, methods=["POST"]),
        Route("/status", status, methods=["GET"]),
    ]
    return Starlette(routes=routes, middleware=[Middleware(BaseHTTPMiddleware, dispatch=_from_here)])


async def serve(switch: AgentSwitch, listener: socket.socket) -> None:
    """Serve at a socket until Ctrl-C or SIGTERM, then disconnect."""
    config = uvicorn.Config(application(switch), log_config=None, access_log=False, lifespan="off", server_header=False)
    server = _AgentServer(config)
    try:
        await server.serve([listener])
    finally:
        await switch.disconnect()


async def _from_here(request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
    """Refuse requests of web pages of other origins, which a browser on this computer could show."""
    refusal = _EDGE.refusal(request.headers)
    return await answer(request) if refusal is None else _problem(refusal)


def _failed(status: dict[str, Any], failure: MayaError) -> dict[str, Any]:
    """Return the state of an agent that has ended: it has no connection, and waits for nothing."""
    ended = {"connected": False, "waits_for": None, "code": None}
    why = ended | {"waits_for": str(failure), "code": failure.code}
    return status | {"robot": status["robot"] | ended, "supervisors": status["supervisors"] | why}


def _kind(error: BaseException) -> str:
    """Return the kind of an error; of a group, that of its first error."""
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return type(error).__name__


def _problem(error: MayaError) -> Response:
    status = 403 if isinstance(error, InvalidRequest) and error.details.get("key") in {"Host", "Origin"} else 409
    return JSONResponse({"code": error.code, "error": str(error)}, status)
