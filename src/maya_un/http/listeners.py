"""The listening sockets: loopback always, another address on request, with or without TLS."""

from __future__ import annotations

import errno
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

from maya_un.errors import AddressInUse, FileUnreadable, InvalidValue

LOOPBACK = "127.0.0.1"

PORT = 4133
"""The usual port of the HTTP listener on loopback."""

LOCAL_CONNECTIONS = 512
"""Connections of this machine's own clients at a time."""

REMOTE_CONNECTIONS = 256
"""Connections of other machines at a time: whatever they do, some are left for whoever says stop here."""

REMOTE_CONNECTIONS_EACH = 32
"""Connections of one other machine at a time."""


@dataclass(frozen=True, slots=True)
class ListeningSocket:
    """A socket that listens, how many connections it takes, in all and of each address, and its TLS, None without."""

    socket: socket.socket
    most: int = LOCAL_CONNECTIONS
    most_each: int = LOCAL_CONNECTIONS
    tls: ssl.SSLContext | None = None

    @property
    def url(self) -> str:
        """Its address."""
        host, port = self.socket.getsockname()[:2]
        name = f"[{host}]" if ":" in host else host
        return f"{'http' if self.tls is None else 'https'}://{name}:{port}"


def bound_socket(port: int, host: str = LOOPBACK) -> socket.socket:
    """Return a listening place (`port` 0: any free one); raises `AddressInUse`, `InvalidValue` for no such `host`."""
    address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError) as error:
        raise InvalidValue(key="--listen", value=address, reason="there is no such address") from error
    family, kind, protocol, _, place = found[0]
    door = socket.socket(family, kind, protocol)  # TCP by name: else asyncio leaves Nagle's wait of 40 ms on
    try:
        door.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        door.bind(place)
        # Several processes may bind the port; the last of them to listen fails.
        door.listen()
    except OSError as error:
        door.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise InvalidValue(key="--listen", value=address, reason="this machine has no such address") from error
        if error.errno == errno.EACCES:
            raise InvalidValue(key="port", value=port, reason="ports below 1024 are for root") from error
        raise AddressInUse(address=address) from error
    return door


def far_socket(host: str, port: int, tls: ssl.SSLContext | None) -> ListeningSocket:
    """Return a listener for other machines; raises as `bound_socket` does."""
    return ListeningSocket(bound_socket(port, host), REMOTE_CONNECTIONS, REMOTE_CONNECTIONS_EACH, tls)


def tls_of(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return what TLS needs (1.2 and newer); raises `FileUnreadable` for files that are none or do not fit."""
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
    """Give no password: nobody is asked for one when a service starts."""
    raise ValueError("the key needs a password; keep one without, readable for this user only")
