"""Sockets on which a service listens: on loopback, and on request on another address, with or without TLS."""

from __future__ import annotations

import errno
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

from dmc41x3.i18n import phrase
from maya_un.errors import AddressInUse, FileUnreadable, InvalidValue

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
