"""The endpoint: it admits clients, holds one session for each, and ends all sessions."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, asynccontextmanager
from dataclasses import replace
from functools import partial

from starlette.datastructures import Headers

from dmc41x3.i18n import phrase
from dmc41x3.listening import DescriptorShares, Listener
from maya_ros.graph.access import Guest, RestrictedGraph, TokenChecker
from maya_ros.graph.protocol import Graph, Publisher
from maya_ros.rosbridge.client import MessageScheduler, RosbridgeClient, Sender
from maya_ros.rosbridge.limits import CLIENTS
from maya_ros.rosbridge.outgoing import MessageEncoder
from maya_ros.rosbridge.rosapi import Rosapi
from maya_ros.rosbridge.session import RosbridgeSession
from maya_ros.rosbridge.wire import GOING, RosbridgeWire
from maya_un.errors import InvalidRequest, MayaError, NotSignedIn
from maya_un.http.connections import LEASE, Rights
from maya_un.http.errors import language_of
from maya_un.http.origins import OriginPolicy
from maya_un.service.access import callers
from maya_un.service.access.operations import ROS, Caller

PORT = 9090
"""The usual port of rosbridge."""

NODE = "rosbridge"
"""The node name of clients in the graph."""

CLIENT_COUNT = "/client_count"
"""The topic with the number of clients."""

GuestMaker = Callable[..., Guest]
"""Makes the guest of a client, from the arguments of `Guest`."""

Seat = Callable[[Guest], AbstractContextManager[Graph]]
"""Gives a client its place in a graph, while a block runs."""


class Everybody:
    """Admits every client as the principal `ROS`, for a graph without users."""

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return `alone`."""
        del authorization, source, loopback, stopping
        return replace(alone, lease=lease)

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return the callers unchanged."""
        return list(asked)

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Ignore the listener: rights never change."""
        del listener
        return lambda: None


class Endpoint:
    """Serves clients; `seat` gives each client its place in a graph.

    `now` returns the date [s since the epoch], `edge` is the origin policy, `most` is the largest number of clients.
    `admission` authenticates clients, `guest` makes their guests. A client that loses rights is disconnected at once.
    """

    def __init__(
        self,
        seat: Seat,
        now: Callable[[], float],
        edge: OriginPolicy | None = None,
        most: int = CLIENTS,
        admission: TokenChecker | None = None,
        guest: GuestMaker = Guest,
    ) -> None:
        self._seat = seat
        self._admission = admission or Everybody()
        self._rights = Rights(self._admission)
        self._guest = guest
        self._edge = edge or OriginPolicy()
        self._most = most
        self._press = MessageEncoder(now)
        self._turns = MessageScheduler()
        self._sessions: dict[RosbridgeWire, tuple[RosbridgeSession, Guest, ExitStack]] = {}
        self._ending: set[asyncio.Task[None]] = set()
        self._count: Publisher | None = None

    @property
    def clients(self) -> int:
        """Number of clients."""
        return len(self._sessions)

    @asynccontextmanager
    async def serving(self, listener: socket.socket) -> AsyncIterator[None]:
        """Serve at `listener` while the block runs; at its end, close all connections with the reason."""
        with self._seat(Guest()) as graph:
            self._count = graph.advertise(CLIENT_COUNT, "std_msgs/Int32", latch=True)
            self._tell_count()
            server = Listener([listener], lambda: RosbridgeWire(self), DescriptorShares.now().far)
            try:
                yield
            finally:
                server.close()
                for wire in tuple(self._sessions):
                    wire.end(GOING, "the service ends")
                    self.leave(wire)
                await asyncio.gather(*self._ending)
                self._count.close()

    def refusal(self, headers: Headers) -> MayaError | None:
        """Return why a client is refused, None if it is admitted."""
        refusal = self._edge.refusal(headers)
        if refusal is None and len(self._sessions) >= self._most:
            return InvalidRequest(
                key="connection", reason=phrase("at most {most} clients are served at once", most=self._most)
            )
        return refusal

    def enter(self, wire: RosbridgeWire, headers: Headers, source: str, *, local: bool) -> RosbridgeSession:
        """Start the session of a client with these headers."""
        guest = self._guest(source, local=local, lease=headers.get(LEASE, ""))
        with ExitStack() as stack:
            graph = RestrictedGraph(stack.enter_context(self._seat(guest)), guest)
            client = RosbridgeClient(graph, Sender(wire), self._press, language_of(headers))
            stack.enter_context(self._rights.watched(lambda: guest.known, partial(self._look, wire, guest)))
            entry = partial(guest.introduce, self._admission)
            session = RosbridgeSession(client, Rosapi(graph, self._press.now), self._turns, entry)
            self._sessions[wire] = (session, guest, stack.pop_all())
        session.begin(callers.of_header(headers.get("authorization")))
        self._tell_count()
        return session

    def leave(self, wire: RosbridgeWire) -> None:
        """End a session, and everything that it has started."""
        found = self._sessions.pop(wire, None)
        if found is not None:
            self._tell_count()
            task = asyncio.get_running_loop().create_task(_ended(*found), name="end of a rosbridge session")
            self._ending.add(task)
            task.add_done_callback(self._ending.discard)

    def _look(self, wire: RosbridgeWire, guest: Guest, now: Caller | MayaError) -> None:
        """Apply changed rights of a client; disconnect it if it has lost some.

        Its session ends at once: a client that does not respond to the close keeps the connection for a moment.
        """
        if not guest.outlasts(now):
            wire.end(NotSignedIn.code, "your rights have changed; connect again")
            self.leave(wire)

    def _tell_count(self) -> None:
        if self._count is not None:
            self._count.publish({"data": len(self._sessions)})


async def _ended(session: RosbridgeSession, guest: Guest, stack: ExitStack) -> None:
    with stack:
        guest.left = True  # so that its goals are cancelled, also if its rights have ended
        await session.close()
