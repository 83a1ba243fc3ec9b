"""The thread of the HTTP server, and the sockets that it listens on.

The server listens on loopback, and on request on another address, with or without TLS. Its thread has an ordinary event
loop, so its timeouts are real seconds.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import ssl
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from dmc41x3.i18n import phrase
from dmc41x3.listening import DescriptorShare, DescriptorShares, Listener, Refusals
from maya_un.errors import AddressInUse, FileUnreadable, InvalidValue
from maya_un.http.log import hand_over
from maya_un.http.protocol import BoundedProtocol, ConnectionSlots
from maya_un.http.stream.messages import StreamWire

LOOPBACK = "127.0.0.1"

PORT = 4133
"""The default port of the HTTP listener on loopback."""

LOCAL_CONNECTIONS = 512
"""Maximum number of simultaneous connections from this computer."""

REMOTE_CONNECTIONS = 256
"""Maximum number of simultaneous connections from other computers; it leaves descriptors free for a local stop."""

REMOTE_CONNECTIONS_EACH = 32
"""Maximum number of simultaneous connections from one other address."""

BROWSER_CONNECTIONS = 6
"""Number of simultaneous connections by which a browser loads a page."""


@dataclass(frozen=True, slots=True)
class ListeningSocket:
    """A listening socket, the maximum number of its connections, in all and per address, and its TLS context."""

    socket: socket.socket
    most: int = LOCAL_CONNECTIONS
    most_each: int = LOCAL_CONNECTIONS
    tls: ssl.SSLContext | None = None

    @property
    def url(self) -> str:
        """The URL of the socket."""
        host, port = self.socket.getsockname()[:2]
        name = f"[{host}]" if ":" in host else host
        return f"{'http' if self.tls is None else 'https'}://{name}:{port}"


def bound_socket(port: int, host: str = LOOPBACK) -> socket.socket:
    """Return a listening socket (`port` 0: any free one); raises `AddressInUse`, `InvalidValue` for a bad `host`."""
    address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as error:
        raise InvalidValue(key="--listen", value=address, reason="there is no such address") from error
    family, kind, protocol, _, place = found[0]
    listener = socket.socket(family, kind, protocol)  # TCP is explicit, else asyncio leaves Nagle's delay of 40 ms on
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(place)
        # Several processes may bind the port; the last of them to listen fails.
        listener.listen()
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise InvalidValue(key="--listen", value=address, reason="this machine has no such address") from error
        if error.errno == errno.EACCES:
            raise InvalidValue(key="port", value=port, reason="ports below 1024 are for root") from error
        raise AddressInUse(address=address) from error
    return listener


def far_socket(
    host: str, port: int, tls: ssl.SSLContext | None, connections: int = REMOTE_CONNECTIONS_EACH
) -> ListeningSocket:
    """Return a listener for other computers, with this number of `connections` per address.

    Raises as `bound_socket` does.
    """
    most = REMOTE_CONNECTIONS - REMOTE_CONNECTIONS_EACH + connections  # the others keep their places
    return ListeningSocket(bound_socket(port, host), most, connections, tls)


def tls_of(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return the TLS context (1.2 and newer); raises `FileUnreadable` for files that are invalid or do not match."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    for path in (certificate, key):
        if not path.is_file():
            raise FileUnreadable(path=path, reason="there is no such file")
    try:
        context.load_cert_chain(certificate, key, password=_refused)
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", None) or getattr(error, "strerror", None) or str(error)
        raise FileUnreadable(path=f"{certificate} with {key}", reason=str(reason)) from error
    return context


def _refused() -> str:
    """Refuse an encrypted key: no one can enter a password when a service starts."""
    raise ValueError(phrase("the key needs a password; keep one without, readable for this user only"))


__all__ = ["LOOPBACK", "bound_socket", "served"]

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
