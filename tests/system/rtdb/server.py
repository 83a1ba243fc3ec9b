"""The server in a thread of its own, and the ways in which it fails: a database as the tests use it."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

import uvicorn
from starlette.applications import Starlette
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from tests.ports import free_port
from tests.system.rtdb.documents import Documents
from tests.system.rtdb.rest import Rest
from tests.system.rtdb.rules import Rules
from tests.system.rtdb.store import Caller, Store
from tests.system.rtdb.tree import at, exported, parts
from tests.system.rtdb.wire import Wire
from tests.virtual_time import turn
from tests.waiting import until

T = TypeVar("T")

_METHODS = ["GET", "PUT", "PATCH", "POST", "DELETE"]
_OWNER = Caller(owner=True)


@dataclass(slots=True)
class Fault:
    """Cut the connection of requests: before they are carried out, or before their answer; `times` of them.

    Requests with this method whose path or body holds `text` are meant.
    """

    method: str
    text: str = ""
    answered: bool = False
    times: int = 1


class RealtimeDatabase:
    """A Realtime Database on loopback. Its data outlives `go_away`, its port stays the same."""

    def __init__(self, rules: str | None = None, keep_alive: float = 30.0) -> None:
        self.store = Store(None if rules is None else Rules.read(rules))
        self.rest = Rest(self.store, keep_alive)
        self.documents = Documents(self.store)
        self.faults: list[Fault] = []
        self.before: Callable[[str, bytes], object] = lambda _method, _where: None
        """Is called in the database's thread before a request, with its method and its path and body."""
        self.held = ""
        """The answers to requests with this method wait."""
        self.delay = 0.0
        self.never = asyncio.Event()
        self.redirects_to = ""
        self.longest_message = 0
        self.callers: set[tuple[str, int]] = set()
        """The other end of every connection that brought a request."""
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="database", daemon=True)
        self._thread.start()
        self._server: uvicorn.Server | None = None
        self._serving: asyncio.Task[None] | None = None
        self.port = free_port()
        self.come_back()

    @property
    def url(self) -> str:
        """Its address."""
        return f"http://127.0.0.1:{self.port}"

    def get(self, path: str) -> Any:
        """Return the data at a path."""
        return self._called(lambda: exported(at(self.store.tree, parts(path))))

    def set(self, path: str, value: Any) -> None:
        """Replace the data at a path."""
        self._called(lambda: self.store.write(parts(path), [(parts(path), value)], _OWNER, merge=False))

    def set_document(self, path: str, fields: dict[str, Any] | None) -> None:
        """Replace a document of Firestore, given as JSON data, or remove it."""
        self._called(lambda: self.documents.set(path, fields))

    def document(self, path: str) -> Any:
        """Return a document of Firestore as JSON data, None if there is none."""
        return self._called(lambda: self.documents.data(path))

    def set_if_there(self, path: str, value: Any) -> None:
        """Replace the data at a path, if there is any."""

        def write() -> None:
            if at(self.store.tree, parts(path)) is not None:
                self.store.write(parts(path), [(parts(path), value)], _OWNER, merge=False)

        self._called(write)

    def set_rules(self, text: str | None) -> None:
        """Change the rules."""
        self._called(lambda: self.store.set_rules(None if text is None else Rules.read(text)))

    def revoke_all(self) -> None:
        """End every token that is in use."""

        def revoke() -> None:
            self.store.revoke_all()
            self.documents.revoke_all()

        self._called(revoke)

    def cut(self) -> None:
        """Cut every connection."""
        self._called(self._cut)

    def go_away(self) -> None:
        """Cut every connection and take no other."""
        asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(30.0)

    def come_back(self) -> None:
        """Take connections again."""
        asyncio.run_coroutine_threadsafe(self._start(), self._loop).result(30.0)

    def close(self) -> None:
        """End."""
        self.go_away()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(30.0)
        self._loop.close()

    def _called(self, work: Callable[[], T]) -> T:
        async def main() -> T:
            return work()

        return asyncio.run_coroutine_threadsafe(main(), self._loop).result(30.0)

    async def _start(self) -> None:
        listener = socket.socket(proto=socket.IPPROTO_TCP)  # by name: else asyncio leaves Nagle's wait of 40 ms on
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(("127.0.0.1", self.port))
        listener.listen(128)
        config = uvicorn.Config(_Faulty(_application(self), self), log_config=None, access_log=False, lifespan="off")
        self._server = uvicorn.Server(config)
        self._serving = self._loop.create_task(self._server._serve([listener]))
        while not self._server.started:
            await turn()

    async def _stop(self) -> None:
        if self._server is None or self._serving is None:
            return
        self._server.should_exit = self._server.force_exit = True
        self._cut()
        with suppress(asyncio.CancelledError):
            await self._serving
        self._cut()
        self._server = self._serving = None

    def _cut(self, scope: Scope | None = None) -> None:
        """Cut every connection, or that of a request."""
        for one in tuple(self._server.server_state.connections if self._server else ()):
            mine: Any = one
            if scope is None or getattr(mine, "scope", None) is scope:
                mine.transport.abort()

    async def fails(self, scope: Scope, body: bytes, *, answered: bool) -> bool:
        """Cut the connection of a request if a fault is set for it; return whether it was."""
        where = scope["path"].encode() + body
        for fault in self.faults:
            if fault.method == scope["method"] and fault.answered == answered and fault.text.encode() in where:
                fault.times -= 1
                if not fault.times:
                    self.faults.remove(fault)
                self._cut(scope)
                return True
        return False


class _Faulty:
    """Delays, redirects and cuts requests before and after an application answers them."""

    def __init__(self, application: ASGIApp, database: RealtimeDatabase) -> None:
        self._application = application
        self._database = database

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._application(scope, receive, send)
            return
        database = self._database
        database.callers.add(scope["client"])
        with suppress(TimeoutError):
            await asyncio.wait_for(database.never.wait(), database.delay)
        if database.redirects_to:
            location = f"{database.redirects_to}{scope['path']}".encode()
            await send({"type": "http.response.start", "status": 307, "headers": [(b"location", location)]})
            await send({"type": "http.response.body", "body": b""})
            return
        body = await _body(receive)
        if await database.fails(scope, body, answered=False):
            return
        database.before(scope["method"], scope["path"].encode() + body)
        told = False

        async def again() -> Message:
            nonlocal told
            if told:
                return await receive()
            told = True
            return {"type": "http.request", "body": body, "more_body": False}

        async def faulty(message: Message) -> None:
            if message["type"] == "http.response.start" and await database.fails(scope, body, answered=True):
                raise OSError("cut")
            await until(lambda: database.held != scope["method"])
            await send(message)

        with suppress(OSError):
            await self._application(scope, again, faulty)


async def _body(receive: Receive) -> bytes:
    body = b""
    while True:
        message = await receive()
        body += message.get("body", b"")
        if not message.get("more_body"):
            return body


def _application(database: RealtimeDatabase) -> Starlette:
    async def wire(socket: WebSocket) -> None:
        one = Wire(database.store, socket)
        await one.serve()
        database.longest_message = max(database.longest_message, one.longest_in)

    rest = database.rest
    return Starlette(
        routes=[
            WebSocketRoute("/.ws", wire),
            Route("/identitytoolkit.googleapis.com/v1/accounts:signInWithPassword", rest.sign_in, methods=["POST"]),
            Route("/identitytoolkit.googleapis.com/v1/accounts:lookup", rest.look_up, methods=["POST"]),
            Route("/securetoken.googleapis.com/v1/token", rest.refresh, methods=["POST"]),
            Route("/v1/projects/demo/databases/(default)/documents:{call}", database.documents.call, methods=["POST"]),
            Route(
                "/v1/projects/demo/databases/(default)/documents/{path:path}",
                database.documents.answer,
                methods=_METHODS,
            ),
            Route("/{path:path}.json", rest.answer, methods=_METHODS),
        ]
    )


@contextmanager
def realtime_database(rules: str | None = None, keep_alive: float = 30.0) -> Iterator[RealtimeDatabase]:
    """Run a database while the block runs."""
    one = RealtimeDatabase(rules, keep_alive)
    try:
        yield one
    finally:
        one.close()
