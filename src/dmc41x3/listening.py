"""Accept connections without using up the descriptors of the process.

asyncio's own servers accept every waiting connection. Without a descriptor left, they write a traceback and accept
nothing for a second. Here connections are accepted one at a time. The number of a new descriptor shows how many are
left, because it is always the lowest free one (POSIX, accept). A listener closes connections beyond its share. See
decision 29.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import resource
import socket
import ssl
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

from dmc41x3.errors import TooFewDescriptors

WANTED = 1024
"""The soft limit on descriptors is raised to this if the hard limit allows; select() supports no more."""

LEAST = 12
"""Least number of descriptors of a listening program, besides those that it opens itself."""

KEPT = 16
"""Greatest number of descriptors reserved for the robot: link, journal, recordings, configuration."""

STOPS = 32
"""Greatest number of connections of each listener reserved for stops."""

OWN = 32
"""Greatest number of descriptors reserved for clients on this machine."""

HANDSHAKE = 5.0
"""Longest TLS handshake [s]."""

QUIET = 60.0
"""Least time between two log lines about refused connections [s, loop time]."""

BACKLOG = 128
"""Greatest number of connections that wait to be accepted."""

_SLACK = 2
_AGAIN = 0.1
_TURN = 0.001
_USED_UP = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})

_log = logging.getLogger("maya.connections")


class DescriptorShare(NamedTuple):
    """The share of a listener: descriptors numbered below `full` for any request, below `most` for a stop."""

    full: int
    most: int

    @property
    def stops(self) -> int:
        """Number of connections reserved for stops."""
        return min(STOPS, max(1, self.most - self.full - _SLACK))


ALL = DescriptorShare(sys.maxsize, sys.maxsize)
"""The share of a listener without a limit on its descriptors."""


class DescriptorShares(NamedTuple):
    """The share of local clients, and that of remote clients."""

    near: DescriptorShare
    far: DescriptorShare

    @classmethod
    def of(cls, limit: int, used: int) -> DescriptorShares:
        """Divide the descriptors below `limit`, of which `used` are in use."""
        free = max(0, limit - used)
        stops = min(STOPS, max(2, free // 5)) + _SLACK
        most = limit - min(KEPT, free // 4)
        near = DescriptorShare(max(used, most - stops), most)
        below = near.full - min(OWN, (near.full - used) // 3)
        return cls(near, DescriptorShare(max(used, below - stops), below))

    @classmethod
    def now(cls) -> DescriptorShares:
        """Divide the descriptors that this process may open."""
        limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        return cls.of(WANTED if limit == resource.RLIM_INFINITY else limit, _used())


def reserve_descriptors(own: int = 0) -> None:
    """Raise the soft limit on descriptors for a program that opens `own` besides connections.

    Raises `TooFewDescriptors` if the hard limit leaves too few.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = WANTED if hard == resource.RLIM_INFINITY else min(WANTED, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
    used = _used()
    if soft != resource.RLIM_INFINITY and soft - used < LEAST + own:
        raise TooFewDescriptors(limit=soft, used=used, least=LEAST + own)


def _used() -> int:
    """Return the lowest free descriptor, about the number in use; raises `TooFewDescriptors` if none is left."""
    try:
        lowest = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        raise TooFewDescriptors(limit=soft, used=soft, least=LEAST) from error
    os.close(lowest)
    return lowest


class Refusals:
    """Counts refused connections and logs them, at most once in `QUIET`."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._count = 0
        self._next = self._loop.time()

    def add(self) -> None:
        """Count a refused connection."""
        self._count += 1
        now = self._loop.time()
        if now >= self._next:
            _log.warning("connections refused, too many at once: %d", self._count)
            self._count, self._next = 0, now + QUIET


class Listener(asyncio.AbstractServer):
    """Accepts connections at bound `sockets`, each with a protocol of `factory`; `share` limits the file descriptors.

    It listens in the running loop from its creation. Raises `OSError` if an address is in use.
    """

    def __init__(
        self,
        sockets: Sequence[socket.socket],
        factory: Callable[[], asyncio.BaseProtocol],
        share: DescriptorShare,
        *,
        tls: ssl.SSLContext | None = None,
        refusals: Refusals | None = None,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._factory = factory
        self._share = share
        self._tls = tls
        self._refusals = refusals or Refusals()
        self._greeting: dict[asyncio.Task[None], None] = {}
        self._untouched: set[socket.socket] = set()
        self._open = True
        self.sockets = tuple(sockets)
        for listener in self.sockets:
            listener.setblocking(False)
            listener.listen(BACKLOG)
        for listener in self.sockets:
            self._loop.add_reader(listener.fileno(), self._accept, listener)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the first socket."""
        name = self.sockets[0].getsockname()
        return name[0], name[1]

    def close(self) -> None:
        """Accept no more connections; existing connections stay."""
        if not self._open:
            return
        self._open = False
        for listener in self.sockets:
            self._loop.remove_reader(listener.fileno())
            listener.close()
        for task in tuple(self._greeting):
            task.cancel()

    async def wait_closed(self) -> None:
        """Wait until no handshake is under way."""
        if self._greeting:
            await asyncio.wait(self._greeting)

    def is_serving(self) -> bool:
        """Return whether connections are accepted."""
        return self._open

    def _accept(self, listener: socket.socket) -> None:
        """Accept one connection; if few descriptors are left, accept the next only when it is served or closed."""
        try:
            connection, _ = listener.accept()
        except OSError as error:
            if error.errno in _USED_UP:
                self._refusals.add()
                self._pause(listener)
                self._loop.call_later(_AGAIN, self._go_on, listener)
            return  # or the client ended the connection before it was accepted
        number = connection.fileno()
        if number >= self._share.most:
            self._refusals.add()
            if not self._end_oldest_handshake():
                connection.close()
                return
        connection.setblocking(False)
        paused = listener if number >= self._share.full else None
        if paused is not None:
            self._pause(paused)
        task = self._loop.create_task(self._greet(connection, paused), name="connection")
        self._greeting[task] = None
        self._untouched.add(connection)
        task.add_done_callback(lambda _: self._greeted(task, connection))

    async def _greet(self, connection: socket.socket, paused: socket.socket | None) -> None:
        """Connect the factory's protocol to a connection, and resume listening if it is `paused`."""
        self._untouched.discard(connection)
        patience = None
        if self._tls is not None:
            patience = HANDSHAKE
            if paused is not None:  # a handshake takes long; meanwhile others are accepted
                self._loop.call_later(_TURN, self._go_on, paused)
                paused = None
        try:
            await self._loop.connect_accepted_socket(
                self._factory, connection, ssl=self._tls, ssl_handshake_timeout=patience
            )
        except OSError:
            pass  # the client disconnected, or its handshake failed; asyncio has closed the connection
        finally:
            if paused is not None:
                self._loop.call_soon(self._go_on, paused)

    def _greeted(self, task: asyncio.Task[None], connection: socket.socket) -> None:
        self._greeting.pop(task, None)
        if connection in self._untouched:  # cancelled before its first turn
            self._untouched.discard(connection)
            connection.close()

    def _end_oldest_handshake(self) -> bool:
        """End the longest handshake; return whether there was one."""
        if self._tls is None or not self._greeting:
            return False
        oldest = next(iter(self._greeting))
        del self._greeting[oldest]
        oldest.cancel()
        return True

    def _pause(self, listener: socket.socket) -> None:
        self._loop.remove_reader(listener.fileno())

    def _go_on(self, listener: socket.socket) -> None:
        if self._open:
            self._loop.add_reader(listener.fileno(), self._accept, listener)


async def listen(host: str, port: int, factory: Callable[[], asyncio.BaseProtocol]) -> Listener:
    """Listen at `host`, port 0 for any free one, with the share of local clients; raises `OSError`."""
    loop = asyncio.get_running_loop()
    bound = await loop.create_server(asyncio.Protocol, host, port, start_serving=False)
    try:
        sockets = [listener.dup() for listener in bound.sockets]
    finally:
        bound.close()
    try:
        return Listener(sockets, factory, DescriptorShares.now().near)
    except OSError:
        for listener in sockets:
            listener.close()
        raise
