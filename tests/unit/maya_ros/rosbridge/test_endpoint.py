"""The endpoint as clients meet it, on real sockets: so these tests run in real loops."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Close

from dmc41x3.loops import run
from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Graph
from maya_ros.rosbridge import wire
from maya_ros.rosbridge.endpoint import Endpoint
from maya_ros.rosbridge.limits import LONGEST_MESSAGE, WAITING
from maya_un.http.origins import OriginPolicy
from maya_un.http.sockets import bound_socket
from tests.rosbridge_clients import DATE, HANDSHAKE, Web, framed, web
from tests.virtual_time import turn

STRING = "std_msgs/String"


class Served:
    """An endpoint on a bus of its own."""

    def __init__(self, bus: Bus, endpoint: Endpoint, port: int) -> None:
        self.bus = bus
        self.endpoint = endpoint
        self.port = port
        self.url = f"ws://127.0.0.1:{port}"
        self.robot = bus.node("robot")


@asynccontextmanager
async def served(edge: OriginPolicy | None = None, most: int = 10) -> AsyncIterator[Served]:
    bus = Bus()

    @contextmanager
    def seat(_: Guest) -> Iterator[Graph]:
        node = bus.node("rosbridge")
        yield node
        node.close()

    endpoint = Endpoint(seat, lambda: DATE, edge, most)
    listener = bound_socket(0)
    async with endpoint.serving(listener):
        yield Served(bus, endpoint, listener.getsockname()[1])


Story = Callable[[Served], Awaitable[None]]


def run_story(story: Story, edge: OriginPolicy | None = None, most: int = 10) -> None:
    async def main() -> None:
        async with served(edge, most) as one:
            await story(one)

    run(main())


async def is_well(client: Web) -> bool:
    return "time" in await client.answer("/rosapi/get_time")


def test_clients_talk_to_each_other_by_topics() -> None:
    async def story(one: Served) -> None:
        async with web(one.url) as first, web(one.url) as second:
            await first.say("subscribe", topic="/t", type=STRING)
            assert await is_well(first)
            await second.say("advertise", topic="/t", type=STRING)
            await second.say("publish", topic="/t", msg={"data": "x"})
            assert await first.hear() == {"op": "publish", "topic": "/t", "msg": {"data": "x"}}

    run_story(story)


def test_messages_may_be_binary_or_cut_into_frames_by_the_websocket() -> None:
    async def story(one: Served) -> None:
        text = json.dumps({"op": "call_service", "service": "/rosapi/get_time", "id": "x"})
        async with web(one.url) as client:
            await client.connection.send(text.encode())
            assert (await client.hear())["id"] == "x"
            await client.connection.send([text[:10], text[10:20], text[20:]])
            assert (await client.hear())["id"] == "x"

    run_story(story)


def test_a_message_that_is_too_long_ends_the_connection_and_only_that_one() -> None:
    async def story(one: Served) -> None:
        async with web(one.url) as client, web(one.url) as other:
            with pytest.raises(ConnectionClosed) as ended:
                await client.connection.send("x" * (LONGEST_MESSAGE + 1))
                await client.hear()
            assert ended.value.rcvd is not None
            assert ended.value.rcvd.code == 1009
            assert await is_well(other)

    run_story(story)


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({"Origin": "http://evil.example.org"}, 403),
        ({"Host": "evil.example.org"}, 403),
        ({"Origin": "http://localhost:8000"}, 403),
    ],
)
def test_pages_from_elsewhere_and_other_names_are_not_let_in(headers: dict[str, str], code: int) -> None:
    async def story(one: Served) -> None:
        with pytest.raises(InvalidStatus) as refused:
            await opened(one.port, headers)
        assert refused.value.response.status_code == code

    run_story(story)


@pytest.mark.parametrize("origin", ["http://localhost:8000", "https://panel.example.org"])
def test_pages_that_are_named_may_command(origin: str) -> None:
    async def story(one: Served) -> None:
        await opened(one.port, {"Origin": origin})

    run_story(story, OriginPolicy(origins=frozenset({origin})))


async def opened(port: int, headers: dict[str, str]) -> None:
    """Open a websocket with these headers and close it again."""
    host = headers.get("Host", f"127.0.0.1:{port}")
    others = {name: value for name, value in headers.items() if name != "Host"}
    async with connect(f"ws://{host}", host="127.0.0.1", port=port, additional_headers=others) as connection:
        await Web(connection).answer("/rosapi/get_time")


def test_refusals_are_in_the_language_of_the_client() -> None:
    async def story(one: Served) -> None:
        with pytest.raises(InvalidStatus) as refused:
            await opened(one.port, {"Origin": "http://evil.example.org", "Accept-Language": "es"})
        assert b"4005: La petici" in (refused.value.response.body or b"")

    run_story(story)


def test_more_clients_than_there_are_places_are_not_let_in() -> None:
    async def story(one: Served) -> None:
        async with web(one.url), web(one.url):
            with pytest.raises(InvalidStatus):
                await opened(one.port, {})
        await gone(one)
        await opened(one.port, {})

    run_story(story, most=2)


async def gone(one: Served) -> None:
    """Return when nobody is there any more but the robot and the endpoint itself."""
    while one.endpoint.clients or len(one.bus.nodes) > 2:
        await turn()


def test_client_count_is_the_number_of_clients() -> None:
    async def story(one: Served) -> None:
        counts: list[int] = []
        one.robot.subscribe("/client_count", "std_msgs/Int32", lambda message: counts.append(message["data"]))
        async with web(one.url) as first, web(one.url):
            await first.say("subscribe", topic="/client_count")
            assert (await first.hear())["msg"] == {"data": 2}
        await gone(one)
        while counts[-1] != 0:
            await turn()
        assert counts == [0, 1, 2, 1, 0]

    run_story(story)


def test_invalid_websocket_is_answered_and_harms_nothing() -> None:
    async def story(one: Served) -> None:
        for request in (
            b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"nonsense\r\n\r\n",
            b"\x00" * 5000 + b"\r\n\r\n",
        ):
            reader, writer = await asyncio.open_connection("127.0.0.1", one.port)
            writer.write(request)
            answer = await reader.read()
            assert answer[:12] in (b"HTTP/1.1 426", b"HTTP/1.1 400", b"HTTP/1.1 500", b""), answer
            writer.close()
            await writer.wait_closed()
        async with web(one.url) as client:
            assert await is_well(client)

    run_story(story)


def test_client_that_vanishes_leaves_nothing_behind() -> None:
    async def story(one: Served) -> None:
        async with web(one.url) as client:
            await client.say("advertise_service", service="/mine", type="std_srvs/Trigger")
            await client.say("subscribe", topic="/t", type=STRING)
            assert await is_well(client)
            client.connection.transport.abort()
        await gone(one)
        assert await one.bus.directory.services() == {}

    run_story(story)


def test_clients_are_notified_when_the_service_ends() -> None:
    async def main() -> None:
        async with served() as one:
            client = await connect(one.url)
            assert await is_well(Web(client))
        with pytest.raises(ConnectionClosed):
            await client.recv()
        assert client.close_code == wire.GOING

    run(main())


def test_a_client_that_closes_is_answered() -> None:
    async def story(one: Served) -> None:
        async with web(one.url) as client:
            await client.connection.close(4321, "enough")
            assert client.connection.protocol.close_rcvd == Close(4321, "enough")

    run_story(story)


def test_a_client_that_is_dead_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire, "PING_INTERVAL", 0.01)
    monkeypatch.setattr(wire, "PING_TIMEOUT", 0.05)

    async def story(one: Served) -> None:
        async with web(one.url, ping_interval=None) as client:
            for _ in range(300):
                assert await is_well(client), "who answers pings stays"
        await gone(one)
        reader, writer = await asyncio.open_connection("127.0.0.1", one.port)
        writer.write(HANDSHAKE)
        await reader.readuntil(b"\r\n\r\n")
        with pytest.raises(ConnectionError):
            while await reader.read(100):
                pass
            raise ConnectionResetError
        writer.close()
        await gone(one)

    run_story(story)


def test_silent_client_is_disconnected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire, "HANDSHAKE", 0.01)

    async def story(one: Served) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", one.port)
        with pytest.raises(ConnectionError):
            if not await reader.read():
                raise ConnectionResetError
        writer.close()

    run_story(story)


def test_client_that_does_not_read_slows_no_other_and_finds_the_newest() -> None:
    text = "x" * 20_000

    async def story(one: Served) -> None:
        publisher = one.robot.advertise("/t", STRING)
        async with web(one.url) as well:
            slow = await slow_reader(one.port)
            await well.say("subscribe", topic="/t", type=STRING)
            assert await is_well(well)
            count = 10 * WAITING
            for number in range(count):
                publisher.publish({"data": f"{number} {text}"})
                assert (await well.hear())["msg"]["data"].startswith(f"{number} ")
            numbers = await asyncio.get_running_loop().run_in_executor(None, read_on, slow, count - 1)
            assert numbers == sorted(numbers)
            assert WAITING <= len(numbers) < count
            assert numbers[-1] == count - 1
            slow.close()

    run_story(story)


async def slow_reader(port: int) -> socket.socket:
    """Return a socket that has subscribed to /t and reads nothing yet."""
    loop = asyncio.get_running_loop()
    slow = socket.socket()
    slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    slow.setblocking(False)
    await loop.sock_connect(slow, ("127.0.0.1", port))
    work = json.dumps({"op": "subscribe", "topic": "/t", "type": STRING}).encode()
    await loop.sock_sendall(slow, HANDSHAKE + framed(work))
    found = b""
    while b"\r\n\r\n" not in found:
        found += await loop.sock_recv(slow, 1)
    return slow


def read_on(slow: socket.socket, last: int) -> list[int]:
    """Return the numbers of all messages up to the last one."""
    slow.setblocking(True)
    found: list[int] = []
    with slow.makefile("rb") as stream:
        while last not in found:
            head = stream.read(2)
            length = int.from_bytes(stream.read(2), "big") if head[1] == 126 else head[1]
            content = stream.read(length)
            if head[0] == 0x81:
                found.append(int(json.loads(content)["msg"]["data"].split()[0]))
    return found
