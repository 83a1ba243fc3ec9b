"""Clients of rosbridge in tests: sessions on a bus without any socket, and websockets to an endpoint."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.rosbridge.client import MessageScheduler, RosbridgeClient, Sender
from maya_ros.rosbridge.outgoing import MessageEncoder
from maya_ros.rosbridge.rosapi import Rosapi
from maya_ros.rosbridge.session import RosbridgeSession
from tests.virtual_time import turn

Said = dict[str, Any]
"""A message as the other side reads it."""

DATE = 1_700_000_000.0
"""The date of every message [s since the epoch]."""


class ClientOutput:
    """Takes what goes out to a client; `full` is for tests to set."""

    def __init__(self) -> None:
        self.full = False
        self.on_room: Callable[[], None] | None = None
        self.frames: list[tuple[int, bytes]] = []
        self.said: list[Said] = []
        self.ended: list[tuple[int, str]] = []

    def write(self, frames: bytes) -> None:
        """Take whole frames; read texts at once."""
        for kind, content in unframed(frames):
            self.frames.append((kind, content))
            if kind == 1 and content[:1] == b"{":
                self.said.append(json.loads(content))

    def end(self, code: int, reason: str) -> None:
        """Take the end."""
        self.ended.append((code, reason))

    def take_more(self) -> None:
        """Take more again."""
        self.full = False
        assert self.on_room is not None
        self.on_room()

    def taken(self) -> list[Said]:
        """Return the texts so far, and forget them."""
        said, self.said = self.said, []
        self.frames.clear()
        return said


def unframed(data: bytes) -> list[tuple[int, bytes]]:
    """Return opcode and content of the frames of a server (RFC 6455, 5.2)."""
    found: list[tuple[int, bytes]] = []
    while data:
        assert data[0] & 0x80, "every frame is the last of its message"
        short = data[1]
        begin = {126: 4, 127: 10}.get(short, 2)
        length = int.from_bytes(data[2:begin], "big") if begin > 2 else short
        found.append((data[0] & 0x0F, data[begin : begin + length]))
        data = data[begin + length :]
    return found


class BusClient:
    """A client in the loop of its bus: its operations run at once, as far as nothing has to be awaited."""

    def __init__(self, bus: Bus, press: MessageEncoder, node: BusNode, turns: MessageScheduler | None = None) -> None:
        self.mouth = ClientOutput()
        self.node = node
        self.client = RosbridgeClient(node, Sender(self.mouth), press)
        self.session = RosbridgeSession(self.client, Rosapi(node, press.now), turns or MessageScheduler())
        self.bus = bus

    def say(self, op: str, **message: Any) -> None:
        """Say something."""
        self.session.take(json.dumps({"op": op, **message}))

    async def told(self) -> list[Said]:
        """Return the client's messages, once nothing is left to do now."""
        await settled()
        return self.mouth.taken()

    async def ask(self, op: str, **message: Any) -> list[Said]:
        """Send an operation, and return the messages to the client."""
        self.say(op, **message)
        return await self.told()


async def settled() -> None:
    """Let the loop do what is ready, and what that makes ready."""
    for _ in range(20):
        await turn()


class ClientBus:
    """A bus, and as many clients as a test wants."""

    def __init__(self) -> None:
        self.bus = Bus()
        self.robot = self.bus.node("robot")
        self.press = MessageEncoder(lambda: DATE)
        self.turns = MessageScheduler()
        self._talkers: list[BusClient] = []

    def talker(self) -> BusClient:
        """Return one more client."""
        self._talkers.append(BusClient(self.bus, self.press, self.bus.node("rosbridge"), self.turns))
        return self._talkers[-1]

    async def leave(self, talker: BusClient) -> None:
        """Have a client go, as the endpoint does."""
        self._talkers.remove(talker)
        await talker.session.close()
        talker.node.close()

    async def close(self) -> None:
        """Have everybody go."""
        for talker in tuple(self._talkers):
            await self.leave(talker)
        self.robot.close()
        await settled()


@asynccontextmanager
async def client_bus() -> AsyncIterator[ClientBus]:
    """Yield a bus with clients; the remaining clients leave at its end."""
    one = ClientBus()
    try:
        yield one
    finally:
        await one.close()


class Web:
    """A client by a websocket."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    async def say(self, op: str, **message: Any) -> None:
        """Say something."""
        await self.connection.send(json.dumps({"op": op, **message}))

    async def hear(self) -> Said:
        """Return the next message."""
        return json.loads(await self.connection.recv())

    async def until(self, fact: Callable[[Said], bool]) -> Said:
        """Return the first message that is so; the others are gone."""
        while not fact(found := await self.hear()):
            pass
        return found

    async def answer(self, service: str, /, **args: Any) -> Any:
        """Call a service and return its values; fails where it fails."""
        name = f"call:{service}"
        await self.say("call_service", id=name, service=service, args=args)
        found = await self.until(lambda one: one["op"] == "service_response" and one["id"] == name)
        assert found["result"] is True, found
        return found["values"]


@asynccontextmanager
async def web(url: str, **options: Any) -> AsyncIterator[Web]:
    """Yield a client that is connected by a websocket while the block runs."""
    async with connect(url, compression=None, **options) as connection:
        yield Web(connection)


HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
"""Messages of a client without a library."""


class FloodingClients:
    """Clients that ask without end, by bare sockets: asking and reading costs them less than answering."""

    def __init__(self) -> None:
        self.answered = 0

    async def ask(self, port: int, question: bytes) -> None:
        """Run one client, until cancelled."""
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        try:
            writer.write(HANDSHAKE)
            await reader.readuntil(b"\r\n\r\n")
            async with asyncio.TaskGroup() as group:
                group.create_task(self._count(reader))
                while True:
                    writer.write(framed(question) * 100)
                    await writer.drain()
        finally:
            writer.transport.abort()

    async def until(self, count: int) -> None:
        """Return when so many more have been answered."""
        end = self.answered + count
        while self.answered < end:
            await turn()

    async def _count(self, reader: asyncio.StreamReader) -> None:
        while answers := await reader.read(65_536):
            self.answered += answers.count(b"service_response")


def framed(text: bytes) -> bytes:
    """Return the frame of a client's short text (RFC 6455, 5.2), its mask zero."""
    assert len(text) < 126
    return bytes((0x81, 0x80 | len(text))) + bytes(4) + text


@asynccontextmanager
async def flooded(port: int, clients: int, question: Said) -> AsyncIterator[FloodingClients]:
    """Have so many clients ask a question without end while the block runs."""
    flood, text = FloodingClients(), json.dumps(question, separators=(",", ":")).encode()
    tasks = [asyncio.ensure_future(flood.ask(port, text)) for _ in range(clients)]
    try:
        yield flood
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
