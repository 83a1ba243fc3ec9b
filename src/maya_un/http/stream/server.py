"""The websocket /v1/stream: states at a chosen rate, events without a gap, topics, and requests."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import NamedTuple

from fastapi import FastAPI
from starlette.websockets import WebSocket

from dmc41x3.i18n import phrase
from maya_un.errors import MayaError, TooManyRequests
from maya_un.http.bridge import Bridge
from maya_un.http.connections import Rights, is_local, source_of
from maya_un.http.log import written_down
from maya_un.http.origins import CLIENTS_EACH
from maya_un.http.protocol import ConnectionSlots
from maya_un.http.stream.hub import MOST_EVENTS, Batch, EventRing, StreamHub, StreamSource
from maya_un.http.stream.messages import WIRE, StreamWire
from maya_un.http.stream.session import StreamHandshake, StreamSession, refuse
from maya_un.service.service import Service

NEAR_CLIENTS = 256
"""Maximum number of stream readers on this computer."""

FAR_CLIENTS = 128
"""Maximum number of stream readers at other addresses in all, signed in or not; one address has `CLIENTS_EACH` of them.
"""


def add_stream(app: FastAPI, bridge: Bridge, most_behind: int = MOST_EVENTS, *, readers: int = CLIENTS_EACH) -> None:
    """Add /v1/stream, for a server whose websockets are a `StreamWire`.

    Readers may lag by `most_behind` events; one other address may have this number of `readers`.
    """
    stream = StreamServer(bridge, most_behind, readers)
    app.add_api_websocket_route("/v1/stream", stream.serve)


class StreamServer:
    """All clients of the stream; their shared parts exist while there is a client."""

    def __init__(self, bridge: Bridge, most_behind: int, readers: int) -> None:
        self._bridge = bridge
        self._most_behind = most_behind
        self._opening = asyncio.Lock()
        self._hub: StreamHub | None = None
        self._tapping: asyncio.Task[None] | None = None
        self._clients = 0
        self._wires: set[StreamWire] = set()
        self._rights = Rights(bridge)
        self._near = ConnectionSlots(NEAR_CLIENTS, NEAR_CLIENTS)
        self._far = ConnectionSlots(FAR_CLIENTS - CLIENTS_EACH + readers, readers)  # the others keep their places

    async def serve(self, socket: WebSocket) -> None:
        """Serve one client from its handshake to its end."""
        wire = socket.scope["extensions"][WIRE]
        assert isinstance(wire, StreamWire)
        handshake = StreamHandshake(socket, self._bridge)
        await socket.accept()
        try:
            await self._serve(socket, wire, handshake)
        except MayaError as refusal:
            refuse(wire, refusal, handshake.language)
        except Exception as defect:  # noqa: BLE001 - the last handler: a client gets a sentence, the log the traceback
            refuse(wire, written_down(defect), handshake.language)

    async def _serve(self, socket: WebSocket, wire: StreamWire, handshake: StreamHandshake) -> None:
        places, address = self._near if is_local(socket) else self._far, source_of(socket)
        if not places.take(address):
            raise TooManyRequests(limit=phrase("no more streams"), seconds=1, wait=1)
        self._wires.add(wire)
        try:
            caller = await handshake.introduced()
            if caller is not None:
                async with self._entered() as hub:
                    session = StreamSession(socket, wire, self._bridge, hub, handshake, caller)
                    with self._rights.watched(lambda: session.caller, session.take_rights):
                        await session.converse()
        finally:
            self._wires.discard(wire)
            places.give_back(address)

    @asynccontextmanager
    async def _entered(self) -> AsyncIterator[StreamHub]:
        self._clients += 1
        try:
            async with self._opening:
                if self._hub is None:
                    self._hub = await self._open()
            yield self._hub
        finally:
            self._clients -= 1
            if self._clients == 0:
                self._close()

    async def _open(self) -> StreamHub:
        """Start to receive data from the service."""
        service, run, last, about = await self._bridge.asked(_facts)
        hub = StreamHub(run, EventRing(last, self._most_behind), about._asdict())
        loop = asyncio.get_running_loop()

        def hand_over(batch: Batch) -> None:
            loop.call_soon_threadsafe(self._take, hub, batch)

        tap = StreamSource(service, hand_over, about.speed)
        hub.open(tap)
        self._tapping = loop.create_task(self._bridge.within(lambda: tap.run(last)), name="stream")
        self._tapping.add_done_callback(self._tapped)
        return hub

    def _take(self, hub: StreamHub, batch: Batch) -> None:
        try:
            hub.take(batch)
        except Exception as defect:  # noqa: BLE001 - nothing else reports it
            self._fail(defect)

    def _tapped(self, done: asyncio.Task[None]) -> None:
        if not done.cancelled() and (defect := done.exception()) is not None:
            self._fail(defect)

    def _fail(self, defect: BaseException) -> None:
        """Write a defect to the log and end all connections: they would wait forever, or miss data."""
        crash = written_down(defect)
        for wire in tuple(self._wires):
            refuse(wire, crash, "en")

    def _close(self) -> None:
        if self._tapping is not None:
            self._tapping.cancel()
            self._tapping = None
        if self._hub is not None:
            self._hub.close()
            self._hub = None


class StreamedRobot(NamedTuple):
    """The name of the robot, the address of its controller, and the speed of its clock relative to real time.

    `fleet` is whether its service watches the robots of a broker.
    """

    robot: str
    address: str
    speed: float
    fleet: bool


async def _facts(service: Service) -> tuple[Service, int, int, StreamedRobot]:
    """Return the service, its run, the number of its last event, and its robot."""
    status = await service.status()
    robot = StreamedRobot(service.name, status.address, status.speed, service.fleet.watched)
    return service, status.run, status.last_event, robot
