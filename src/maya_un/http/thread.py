"""The thread of the HTTP server. It has an ordinary event loop, so its timeouts are real seconds."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from functools import partial

import uvicorn
from starlette.types import ASGIApp

from dmc41x3.listening import DescriptorShare, DescriptorShares, Listener, Refusals
from maya_un.http.log import hand_over
from maya_un.http.protocol import BoundedProtocol, ConnectionSlots
from maya_un.http.sockets import ListeningSocket
from maya_un.http.stream.messages import StreamWire

_STARTED = 10.0


class _HttpServer(uvicorn.Server):
    """Server that reports when it listens, uses Maya's listener, and leaves signals to the main thread."""

    def __init__(self, app: ASGIApp, listener: ListeningSocket, share: DescriptorShare) -> None:
        self._places = ConnectionSlots(listener.most, listener.most_each, share)
        super().__init__(_configured(app, listener, self._places))
        self.listener = listener
        self.listening = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start to listen; uvicorn's listener would use up the descriptors (decision 29)."""
        await super().startup([])

        def connected() -> BoundedProtocol:
            return BoundedProtocol(self._places, self.config, self.server_state, self.lifespan.state)

        refusals = self._places.refusals = Refusals()
        share = self._places.share
        listener = Listener(sockets or [], connected, share, tls=self.config.ssl, refusals=refusals)
        self.servers.append(listener)  # type: ignore[arg-type]
        self.listening.set()


def _configured(app: ASGIApp, listener: ListeningSocket, places: ConnectionSlots) -> uvicorn.Config:
    tls = listener.tls
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
"""Further contexts in the server's loop, open from before it listens until it has ended."""


class _Thread(threading.Thread):
    """Thread that serves; `failure` is the error that ended it, if any."""

    def __init__(self, servers: list[_HttpServer], beside: Beside) -> None:
        super().__init__(name="maya-http", daemon=True)
        self._servers = servers
        self._beside = beside
        self.failure: BaseException | None = None

    def run(self) -> None:
        """Serve until all servers have ended."""
        try:
            with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
                runner.run(self._serve())
        except BaseException as failure:  # noqa: BLE001 - the code that started the thread raises it
            self.failure = failure
        finally:
            for server in self._servers:
                server.listening.set()

    async def _serve(self) -> None:
        async with self._beside():
            await asyncio.gather(*(server.serve(sockets=[server.listener.socket]) for server in self._servers))


@asynccontextmanager
async def served(
    app: ASGIApp, near: socket.socket | ListeningSocket, *far: ListeningSocket, beside: Beside = nullcontext
) -> AsyncIterator[str]:
    """Serve `app` at `near` (loopback) and at listeners for other computers while the block runs; yields near's URL.

    The calling loop continues while the thread starts and ends. Raises what `beside` raises when it opens.
    """
    hand_over("uvicorn.error")
    first = near if isinstance(near, ListeningSocket) else ListeningSocket(near)
    shares = DescriptorShares.now()
    servers = [_HttpServer(app, first, shares.near), *(_HttpServer(app, listener, shares.far) for listener in far)]
    url = servers[0].listener.url
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
            server.listener.socket.close()
