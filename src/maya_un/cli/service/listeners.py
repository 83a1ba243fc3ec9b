"""Addresses, certificates and ports on which `maya up` serves other computers, including rosbridge."""

from __future__ import annotations

import socket
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, NamedTuple

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidCommandLine, InvalidValue
from maya_un.http.origins import CLIENTS_EACH, FAR, OriginPolicy, host_of, origin_of
from maya_un.http.sockets import (
    BROWSER_CONNECTIONS,
    REMOTE_CONNECTIONS_EACH,
    ListeningSocket,
    bound_socket,
    far_socket,
    tls_of,
)

if TYPE_CHECKING:
    from maya_un.edges import EndpointOptions, Ros2Options

PORT = 4134
"""The default port for other computers; loopback uses another one."""

_COMMAND = "maya up"
_ANYWHERE = {"0.0.0.0", "::"}


class RemoteAccess(NamedTuple):
    """The options for other computers; `listen` is None if they have no access.

    `clients` is the number of clients behind one address that its limits allow for.
    """

    listen: str | None = None
    certificate: str | None = None
    key: str | None = None
    plain: bool = False
    origins: Sequence[str] = ()
    clients: int = CLIENTS_EACH

    def check(self) -> None:
        """Raise `InvalidCommandLine` if the options contradict each other."""
        if (self.certificate is None) != (self.key is None):
            raise InvalidCommandLine(reason="--tls-cert and --tls-key belong together", command=_COMMAND)
        if self.plain and self.certificate is not None:
            raise InvalidCommandLine(reason="--plain cannot be combined with --tls-cert", command=_COMMAND)
        if self.listen is None and (self.plain or self.certificate is not None):
            reason = phrase("--tls-cert, --tls-key and --plain are for --listen; loopback needs no TLS")
            raise InvalidCommandLine(reason=reason, command=_COMMAND)
        if self.listen is not None and not self.plain and self.certificate is None:
            reason = phrase("--listen needs --tls-cert and --tls-key; use --plain only on a trusted network")
            raise InvalidCommandLine(reason=reason, command=_COMMAND)

    def listener(self) -> ListeningSocket | None:
        """Return the listener, None without one; raises `InvalidValue`, `AddressInUse`, `FileUnreadable`."""
        if self.listen is None:
            return None
        host, port = host_and_port(self.listen)
        tls = None
        if self.certificate is not None and self.key is not None:
            tls = tls_of(Path(self.certificate), Path(self.key))
        return far_socket(host, port, tls, self._connections())

    def addresses(self, listener: ListeningSocket | None) -> tuple[str, ...]:
        """Return the URLs at which other computers reach `listener`, the best one first; none without a listener.

        A certificate usually holds the name of this computer; without one, an IP address works on more networks.
        """
        if self.listen is None or listener is None:
            return ()
        host, _ = host_and_port(self.listen)
        scheme, _, rest = listener.url.partition("://")
        port = rest.rpartition(":")[2]
        name = socket.gethostname().lower()
        numbers = _own_address()
        hosts = [host] if host not in _ANYWHERE else [*numbers, name] if listener.tls is None else [name, *numbers]
        return tuple(f"{scheme}://{f'[{one}]' if ':' in one else one}:{port}" for one in hosts)

    def edge(self) -> OriginPolicy:
        """Return the origin policy of the listeners; raises `InvalidValue`."""
        origins = frozenset(map(origin_of, self.origins))
        hosts = {host_of(origin) for origin in origins}
        if self.listen is not None:
            host, _ = host_and_port(self.listen)
            name = socket.gethostname().lower()
            hosts |= {name, f"{name}.local"} | ({host.lower()} - _ANYWHERE)
        rate = FAR.times(self.clients / CLIENTS_EACH)
        return OriginPolicy(self.listen is not None, frozenset(hosts), origins, far=rate, readers=self.clients)

    def _connections(self) -> int:
        """Return the most connections from one address: all clients behind it may load their pages at the same time."""
        return REMOTE_CONNECTIONS_EACH if self.clients == CLIENTS_EACH else BROWSER_CONNECTIONS * self.clients


_DOCUMENTATION = ("192.0.2.1", 9)
"""An address that no computer has (RFC 5737). Nothing is sent to it."""


def _own_address() -> tuple[str, ...]:
    """Return the IP address of the interface that leads to other networks, none without such an interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_DOCUMENTATION)  # selects an interface, and sends no packet
        except OSError:
            return ()
        return (str(probe.getsockname()[0]),)


def require_users(*, kept: bool, listen: str | None) -> None:
    """Raise `InvalidCommandLine` if other computers are to have access while no users exist."""
    if listen is not None and not kept:
        reason = phrase(
            "--listen needs at least one user: start `maya up` without --listen, run `maya user add NAME --role "
            "admin`, and start `maya up` again"
        )
        raise InvalidCommandLine(reason=reason, command=_COMMAND)


def host_and_port(text: str) -> tuple[str, int]:
    """Return host and port of HOST, HOST:PORT, [IPV6] or [IPV6]:PORT; raises `InvalidValue`."""
    if text.startswith("["):
        host, bracket, rest = text[1:].partition("]")
        port = rest.removeprefix(":")
        good = bool(bracket) and (rest == "" or rest.startswith(":"))
    else:
        host, colon, port = text.partition(":")
        good = not colon or bool(port)
    if not good or not host or (port and not (port.isdecimal() and int(port) < 65536)):
        raise InvalidValue(key="--listen", value=text, reason="it must be HOST, HOST:PORT or [IPV6]:PORT")
    return host, int(port) if port else PORT


STEPS = "steps.db"
"""The file of steps from remote processes, beside the file of the queue."""


@contextmanager
def graph_at(
    port: int | None, ros2: Ros2Options | None, journal: Path | None, remote: RemoteAccess
) -> Iterator[EndpointOptions | None]:
    """Yield where the graph of ROS is served: rosbridge at `port`, on loopback only, and ROS 2; None without both.

    Without a `journal`, its file of steps is deleted at the end of the block. Raises `AddressInUse` and `InvalidValue`.
    """
    if port is None and ros2 is None:
        yield None
        return
    from maya_un.edges import EndpointOptions

    with ExitStack() as held:
        listener = None if port is None else held.enter_context(bound_socket(port))
        folder = held.enter_context(_folder_of_steps(journal))
        yield EndpointOptions(listener, replace(remote.edge(), remote=False), Path(folder, STEPS), ros2)


def _folder_of_steps(journal: Path | None) -> AbstractContextManager[str | Path]:
    return TemporaryDirectory(prefix="maya-steps-") if journal is None else nullcontext(journal.parent)


def url_of(listener: socket.socket) -> str:
    """Return the URL of rosbridge at a listener."""
    host, port = listener.getsockname()[:2]
    return f"ws://{host}:{port}"
