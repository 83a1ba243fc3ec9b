"""The HTTP server in a thread of its own, with an ordinary event loop: its timeouts are real seconds."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from functools import partial

import uvicorn
from fastapi import FastAPI

from dmc41x3.listening import DescriptorShare, DescriptorShares, Listener, Refusals
from maya_un.http.listeners import LOOPBACK, ListeningSocket, bound_socket
from maya_un.http.log import hand_over
from maya_un.http.protocol import BoundedProtocol, ConnectionSlots
from maya_un.http.stream.wire import StreamWire

__all__ = ["LOOPBACK", "bound_socket", "served"]

_STARTED = 10.0


class _HttpServer(uvicorn.Server):
    """Reports when it listens, accepts with our own listener, and leaves signals to the main thread."""

    def __init__(self, app: FastAPI, door: ListeningSocket, share: DescriptorShare) -> None:
        self._places = ConnectionSlots(door.most, door.most_each, share)
        super().__init__(_configured(app, door, self._places))
        self.door = door
        self.listening = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen; uvicorn's own server would use up the descriptors (decision 29)."""
        await super().startup([])

        def connected() -> BoundedProtocol:
            return BoundedProtocol(self._places, self.config, self.server_state, self.lifespan.state)

        refusals = self._places.refusals = Refusals()
        share = self._places.share
        listener = Listener(sockets or [], connected, share, tls=self.config.ssl, refusals=refusals)
        self.servers.append(listener)  # type: ignore[arg-type]
        self.listening.set()


def _configured(app: FastAPI, door: ListeningSocket, places: ConnectionSlots) -> uvicorn.Config:
    tls = door.tls
    return uvicorn.Config(
        app,
        http=partial(BoundedProtocol, places),  # type: ignore[arg-type]
        ws=StreamWire,
        log_config=None,
        access_log=False,
        lifespan="off",
        timeout_graceful_shutdown=1,
        proxy_headers=False,
        server_header=False,
        ssl_context_factory=None if tls is None else lambda _config, _default: tls,
    )


Beside = Callable[[], AbstractAsyncContextManager[object]]
"""Other contexts of the server's loop, open from before it listens until it has ended."""


class _Thread(threading.Thread):
    """Serves; what went wrong before it listened is in `failure`."""

    def __init__(self, servers: list[_HttpServer], beside: Beside) -> None:
        super().__init__(name="maya-http", daemon=True)
        self._servers = servers
        self._beside = beside
        self.failure: BaseException | None = None

    def run(self) -> None:
        """Serve until all servers should exit."""
        try:
            with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
                runner.run(self._serve())
        except BaseException as failure:  # noqa: BLE001 - whoever started this raises it
            self.failure = failure
        finally:
            for server in self._servers:
                server.listening.set()

    async def _serve(self) -> None:
        async with self._beside():
            await asyncio.gather(*(server.serve(sockets=[server.door.socket]) for server in self._servers))


@asynccontextmanager
async def served(
    app: FastAPI, near: socket.socket | ListeningSocket, *far: ListeningSocket, beside: Beside = nullcontext
) -> AsyncIterator[str]:
    """Serve `app` at `near` (loopback) and at listeners for other machines while the block runs; yields near's URL.

    The calling loop goes on while the thread starts and ends. Raises what `beside` raises when it opens.
    """
    hand_over("uvicorn.error")
    first = near if isinstance(near, ListeningSocket) else ListeningSocket(near)
    shares = DescriptorShares.now()
    servers = [_HttpServer(app, first, shares.near), *(_HttpServer(app, door, shares.far) for door in far)]
    url = servers[0].door.url
    thread = _Thread(servers, beside)
    loop = asyncio.get_running_loop()
    thread.start()
    try:
        for server in servers:
            await loop.run_in_executor(None, server.listening.wait, _STARTED)
        if thread.failure is not None:
            raise thread.failure
        yield url
    finally:
        for server in servers:
            server.should_exit = True
        await loop.run_in_executor(None, thread.join)
        for server in servers:
            server.door.socket.close()
