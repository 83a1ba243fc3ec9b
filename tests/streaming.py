"""A service that is looked at through the stream: its states, events and queue are what a test makes them."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any, cast
from urllib.parse import urlsplit

from fastapi import FastAPI
from websockets.asyncio.client import ClientConnection, connect
from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.protocol import State as Phase
from websockets.uri import parse_uri

from maya_un.config import Config
from maya_un.controller.monitor import StateBroadcaster
from maya_un.errors import Busy, MayaError
from maya_un.events import Event, EventLog, PhaseBegun
from maya_un.http.bridge import Bridge
from maya_un.http.origins import CLIENTS_EACH
from maya_un.http.sockets import bound_socket
from maya_un.http.stream.hub import MOST_EVENTS
from maya_un.http.stream.server import add_stream
from maya_un.http.thread import served
from maya_un.schema.robot import EventMessage, LinkView, TableView
from maya_un.service import permissions
from maya_un.service.access.control import AccessControl
from maya_un.service.access.operations import Caller
from maya_un.service.fleet import FleetService
from maya_un.service.people import LeaseService, UserService
from maya_un.service.service import Gate, Service
from maya_un.values import Mode, State

PHASE = PhaseBegun("down")
"""An event that leaves the queue as it is."""

REST = State(
    time=0.0,
    mode=Mode.IDLE,
    homed=False,
    counts=(0, 0, 0),
    joints=None,
    point=None,
    velocity=(0.0, 0.0, 0.0),
    moving=False,
    motors_on=(True, True, True),
    forward_limit=(False, False, False),
    reverse_limit=(False, False, False),
    stop_code=(0, 0, 0),
    gripper_closed=False,
    progress=None,
    fault=None,
)
"""A state; tests count in `counts[0]`."""


@dataclass(frozen=True, slots=True)
class Facts:
    """As much of a status as the stream looks at."""

    run: int
    last_event: int
    speed: float = 1.0
    address: str = "sim"


class Watched:
    """Stands in for a service; everything is changed in the loop that it lives in.

    Past events up to `forgotten` are no longer there.
    """

    def __init__(self, run: int = 1, speed: float = 1.0) -> None:
        self.run = run
        self.speed = speed
        self.log = EventLog(lambda: asyncio.get_running_loop().time())
        self.latest = StateBroadcaster(REST)
        self.shown: dict[str, Any] = {"mode": "running"}
        self.views = self.looks = self.stops = 0
        self.move: object = None
        self.name = "MAYA"
        self.running: int | None = None
        self.forecasts: list[str] = []
        self.fleet = FleetService()
        self.forgotten = 0
        self.access = AccessControl.alone(self.log)
        self.lease = LeaseService(self.access, lambda: None)
        self.users = UserService(self.access, self.lease.rights_ended)

    @property
    def service(self) -> Service:
        """This object, as the service that it stands in for."""
        return cast("Service", self)

    @property
    def state(self) -> State:
        """The present state."""
        return self.latest.state

    def config(self) -> Config:
        """The configuration that applies."""
        return Config()

    def require_free(self) -> None:
        """Raise `Busy` while a job runs."""
        if self.running is not None:
            raise Busy(doing=f"job {self.running}")

    def refusals(self, by: Caller) -> dict[str, MayaError | None]:
        """Return what would be refused."""
        self.forecasts.append(by.name)
        return permissions.refusals(self, self.access.lease, by)

    @property
    def circumstances(self) -> object:
        """The facts on which that depends."""
        return permissions.circumstances(self, self.access.lease)

    def table(self) -> TableView:
        """Return the table: a gripper, and no parts."""
        return TableView("believed", {}, None, holding=self.state.gripper_closed)

    def motion(self) -> None:
        """Return the motion under way: there is none."""
        self.looks += 1

    def next_step(self) -> None:
        """Return the next step: there is none."""

    def signals(self) -> None:
        """Return the signals: there are none."""

    def link(self) -> LinkView:
        """Return the quality of the link."""
        return LinkView(up=True)

    @property
    def queue(self) -> Watched:
        """This object, as the queue."""
        return self

    @property
    def history(self) -> Watched:
        """This object, as the history."""
        return self

    def show(self, **changes: Any) -> None:
        """Publish a state that differs from the last in this, and in its time."""
        self.latest.show(replace(self.latest.state, time=asyncio.get_running_loop().time(), **changes))

    def count(self) -> int:
        """Publish a state that counts one further, and return that number."""
        further = self.latest.state.counts[0] + 1
        self.show(counts=(further, 0, 0))
        return further

    def happen(self, times: int = 1, event: Event = PHASE, **more: object) -> None:
        """Add events with `more` details; without an event such as leave the queue as it is."""
        for _ in range(times):
            self.log.emit(replace(event, more=more))

    async def status(self) -> Facts:
        """Return what the stream begins with."""
        return Facts(self.run, len(self.log), self.speed)

    def watch(self) -> AsyncIterator[State]:
        """Yield the state and every newer one."""
        return self.latest.watch()

    def follow_events(self, seq: int = 0) -> AsyncIterator[Event]:
        """Yield the events above `seq`."""
        return self.log.follow(seq)

    def view(self) -> dict[str, Any]:
        """Return how the queue stands."""
        self.views += 1
        return self.shown

    async def events(self, run: int, above: int = 0, limit: int = 1000) -> list[EventMessage]:
        """Return past events."""
        assert run == self.run
        return [EventMessage.of(event) for event in self.log.since(max(above, self.forgotten))[:limit]]


@asynccontextmanager
async def streamed(
    watched: Watched, *, most_behind: int = MOST_EVENTS, readers: int = CLIENTS_EACH
) -> AsyncIterator[str]:
    """Serve the stream of a service that lives in the running loop; yields its address."""
    gate = Gate(watched.service, watched.access.lease)
    bridge = Bridge(asyncio.get_running_loop(), watched.service, gate=gate, callers=watched.access.callers)
    app = FastAPI()
    add_stream(app, bridge, most_behind, readers=readers)
    with bound_socket(0) as listener:
        async with served(app, listener) as url:
            yield f"{url.replace('http', 'ws', 1)}/v1/stream"


class Client:
    """One that reads the stream as programs do; `numbers` are those of the events that came."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.got: list[dict[str, Any]] = []
        self.numbers: list[int] = []

    async def say(self, kind: str, **message: object) -> None:
        """Send a message."""
        await self.connection.send(json.dumps({"type": kind, **message}))

    async def hear(self) -> dict[str, Any]:
        """Return the next message."""
        message: dict[str, Any] = json.loads(await self.connection.recv())
        self.got.append(message)
        if message["type"] == "event":
            self.numbers.append(message["event"]["seq"])
        return message

    async def until(self, kind: str) -> dict[str, Any]:
        """Return the next message of a kind."""
        while (message := await self.hear())["type"] != kind:
            pass
        return message

    async def ask(self, kind: str, **message: object) -> dict[str, Any]:
        """Send a message and return its answer: the next one with its id."""
        number = len(self.got) + 1
        await self.say(kind, id=number, **message)
        while (answer := await self.hear()).get("id") != number:
            pass
        return answer

    async def events_to(self, last: int) -> list[int]:
        """Read on to the event of this number and return those of all events so far."""
        while self.numbers[-1:] != [last]:
            await self.hear()
        return self.numbers


@asynccontextmanager
async def connected(url: str, **headers: str) -> AsyncIterator[Client]:
    """Yield a client that the service has welcomed, or refused, while the block runs."""
    async with connect(url, compression=None, additional_headers=headers, proxy=None) as connection:
        client = Client(connection)
        await client.hear()
        yield client


class SlowReader:
    """A client that reads only on request, on a socket with a small buffer."""

    def __init__(self, url: str) -> None:
        place = urlsplit(url)
        assert place.hostname is not None
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self._socket.settimeout(20.0)
        self._socket.connect((place.hostname, place.port))
        self._protocol = ClientProtocol(parse_uri(url), max_size=None)
        self._protocol.send_request(self._protocol.connect())
        self._flush()
        while self._protocol.state is Phase.CONNECTING:
            self._protocol.receive_data(self._socket.recv(1))

    def say(self, **message: object) -> None:
        """Send a message."""
        self._protocol.send_text(json.dumps(message).encode())
        self._flush()

    def read(self, most: int = 4096) -> list[dict[str, Any]]:
        """Read at most so many bytes and return the messages that have become whole; raises `EOFError` at the end."""
        try:
            data = self._socket.recv(most)
        except ConnectionError:
            data = b""
        if not data:
            raise EOFError
        self._protocol.receive_data(data)
        frames = [event for event in self._protocol.events_received() if isinstance(event, Frame)]
        return [json.loads(bytes(frame.data)) for frame in frames if frame.opcode is Opcode.TEXT]

    def read_on(self) -> list[dict[str, Any]]:
        """Read to the end of the connection and return all that comes."""
        found: list[dict[str, Any]] = []
        with suppress(EOFError):
            while True:
                found += self.read(65_536)
        return found

    @property
    def close_code(self) -> int | None:
        """The code with which the server closed, None where it did not say so."""
        return None if self._protocol.close_rcvd is None else self._protocol.close_rcvd.code

    def close(self) -> None:
        """Go away."""
        self._socket.close()

    def _flush(self) -> None:
        for data in self._protocol.data_to_send():
            self._socket.sendall(data)
