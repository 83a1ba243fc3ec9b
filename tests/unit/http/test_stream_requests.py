"""Requests on the stream: answered by the application of HTTP, in order, and bounded."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from dmc41x3.loops import run
from maya_un.errors import NotConnected, RequestLate
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.stream.requests import MOST_AT_ONCE, MOST_DELAY
from maya_un.http.thread import served
from maya_un.schema.robot import HeldJog
from maya_un.service.service import Gate
from maya_un.values import StopReport
from tests.streaming import Client, Watched, connected

STOPPED = {"was_moving": False, "duration": 0.0, "distance": [0.0, 0.0, 0.0], "job": None}


class Robot(Watched):
    """Records what it is asked; `inspect` waits until its caller leaves."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[object] = []
        self.left = asyncio.Event()

    async def stop(self) -> StopReport:
        self.asked.append("stop")
        return StopReport(was_moving=False, duration=0.0, distance=(0.0, 0.0, 0.0))

    async def jog_hold(self, axis: str, direction: int, *, speed: float, press: str | None) -> HeldJog:
        self.asked.append(speed)
        return HeldJog(axis, direction, moving=True)

    async def jog_release(self, press: str | None) -> None:
        self.asked.append("released")

    async def submit(self, *_: object, key: str, **__: object) -> None:
        self.asked.append(("submit", key))
        raise NotConnected

    async def again(self, number: int, *, from_step: int, by: object, key: str) -> None:
        self.asked.append(((number, from_step), key))
        raise NotConnected

    @property
    def previews(self) -> Robot:
        return self

    @property
    def recorder(self) -> Robot:
        return self

    def path(self, name: str) -> Path:
        return Path(__file__).with_name(name)

    async def inspect(self, *_: object, **__: object) -> None:
        self.asked.append("inspect")
        try:
            await asyncio.Future()
        finally:
            self.left.set()


Story = Callable[[Robot, Client, httpx.AsyncClient], Awaitable[None]]


@asynccontextmanager
async def up(robot: Robot) -> AsyncIterator[str]:
    gate = Gate(robot.service, robot.access.lease)
    bridge = Bridge(asyncio.get_running_loop(), robot.service, gate=gate, callers=robot.access.callers)
    with bound_socket(0) as listener:
        async with served(create_app(bridge), listener) as url:
            yield url


def run_story(story: Story) -> None:
    async def main() -> None:
        robot = Robot()
        async with (
            up(robot) as url,
            connected(f"{url.replace('http', 'ws', 1)}/v1/stream") as client,
            httpx.AsyncClient(base_url=url, trust_env=False) as http,
        ):
            await story(robot, client, http)

    run(main())


def without_request(body: Any) -> Any:
    """Return an answer without the id that the service gives each request."""
    return {key: value for key, value in body.items() if key != "request"} if isinstance(body, dict) else body


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("POST", "/v1/stop", None),
        ("GET", "/v1/health", None),
        ("POST", "/v1/jog", {"axis": "x", "direction": 1, "hold": True}),
        ("POST", "/v1/jog", {"axis": "x", "direction": 2, "hold": True}),
        ("POST", "/v1/jog", {"axis": "x", "direction": 1, "hold": True, "more": 1}),
        ("GET", "/v1/nothing%20here", None),
        ("GET", "/v1/stop", None),
        ("GET", "/v1/health?what=1", None),
        ("POST", "/v1/speed", {"ratio": "\u00e9\u20ac"}),
        ("GET", "/v1/stream", None),
    ],
)
def test_answer_is_that_of_http(method: str, path: str, body: object) -> None:
    async def story(_: Robot, client: Client, http: httpx.AsyncClient) -> None:
        got = await client.ask("request", method=method, path=path, body=body)
        content = b"" if body is None else json.dumps(body).encode()
        same = await http.request(method, path, content=content)
        assert (got["type"], got["status"]) == ("response", same.status_code)
        assert without_request(got["body"]) == without_request(same.json())

    run_story(story)


def test_answer_has_the_language_of_its_request_or_else_of_the_connection() -> None:
    async def story(_: Robot, client: Client, http: httpx.AsyncClient) -> None:
        sentences = []
        for language, other in (("es", "en"), ("en", "es")):
            same = (await http.get("/v1/nothing", headers={"Accept-Language": language})).json()["detail"]
            await client.ask("hello", language=other)
            got = await client.ask("request", method="GET", path="/v1/nothing", language=language)
            assert got["body"]["detail"] == same
            await client.ask("hello", language=language)
            got = await client.ask("request", method="GET", path="/v1/nothing")
            assert got["body"]["detail"] == same
            sentences.append(same)
        got = await client.ask("request", method="GET", path="/v1/nothing", language="日本語")
        assert got["body"]["detail"] == sentences[1]
        assert sentences[0] != sentences[1]

    run_story(story)


def test_post_is_the_method_of_a_request_without_one() -> None:
    async def story(_: Robot, client: Client, __: httpx.AsyncClient) -> None:
        await client.say("request", path="/v1/stop")
        assert await client.hear() == {"type": "response", "status": 200, "body": STOPPED}

    run_story(story)


@pytest.mark.parametrize(
    ("message", "key"),
    [
        ({}, "path"),
        ({"path": 7}, "path"),
        ({"path": "/v2/stop"}, "path"),
        ({"path": "/v1/stöp"}, "path"),
        ({"path": "/v1/stop\r\nHost: x"}, "path"),
        ({"path": "/v1/stop", "method": "TRACE"}, "method"),
        ({"path": "/v1/stop", "method": ["GET"]}, "method"),
        ({"path": "/v1/stop", "lease": 3}, "lease"),
        ({"path": "/v1/stop", "language": 3}, "language"),
        ({"path": "/v1/stop", "headers": {}}, "headers"),
        ({"path": "/v1/health", "sent": "now"}, "sent"),
        ({"path": "/v1/health", "sent": True}, "sent"),
        ({"path": "/v1/health", "sent": 10**400}, "sent"),
        ({"path": "/v1/stop", "key": 3}, "key"),
        ({"path": "/v1/stop", "key": "clé"}, "key"),
        ({"path": "/v1/stop", "key": "k\r\nHost: x"}, "key"),
    ],
)
def test_invalid_request_is_refused_and_the_client_stays(message: dict[str, object], key: str) -> None:
    async def story(robot: Robot, client: Client, _: httpx.AsyncClient) -> None:
        refused = await client.ask("request", **message)
        assert (refused["type"], refused["code"], refused["details"]["key"]) == ("error", 4005, key)
        assert (await client.ask("ping"))["type"] == "pong"
        assert robot.asked == []

    run_story(story)


@pytest.mark.parametrize(
    ("path", "body", "asked"),
    [("/v1/jobs", {"steps": ["home"]}, "submit"), ("/v1/jobs/3/again", {"from_step": 2}, (3, 2))],
)
def test_key_of_a_request_is_its_idempotency_key(path: str, body: object, asked: object) -> None:
    async def story(robot: Robot, client: Client, http: httpx.AsyncClient) -> None:
        await client.ask("request", path=path, body=body, key="k 1")
        await client.ask("request", path=path, body=body)
        await http.post(path, json=body, headers={"Idempotency-Key": "k 2"})
        assert robot.asked == [(asked, "k 1"), (asked, ""), (asked, "k 2")]

    run_story(story)


def test_request_that_the_connection_held_back_is_refused_and_a_stop_never() -> None:
    async def story(robot: Robot, client: Client, _: httpx.AsyncClient) -> None:
        clock = (await client.ask("ping"))["clock"]
        for sent in (clock - MOST_DELAY - 1.0, -1e12):
            refused = await client.ask("request", path="/v1/speed", body={"ratio": 0.5}, sent=sent)
            assert (refused["type"], refused["code"]) == ("error", RequestLate.code)
        assert robot.asked == []
        assert (await client.ask("request", path="/v1/stop", sent=clock - 60.0))["body"] == STOPPED
        in_time = await client.ask("request", method="GET", path="/v1/health", sent=clock)
        assert (in_time["type"], in_time["status"]) == ("response", 200)

    run_story(story)


def test_requests_begin_in_the_order_of_their_messages() -> None:
    speeds = [round(0.01 * number, 2) for number in range(1, 13)]

    async def story(robot: Robot, client: Client, _: httpx.AsyncClient) -> None:
        for speed in speeds:
            body = {"axis": "x", "direction": 1, "hold": True, "speed": speed}
            await client.say("request", path="/v1/jog", body=body)
        await client.ask("request", path="/v1/jog", body={"hold": False})
        assert robot.asked == [*speeds, "released"]

    run_story(story)


def test_too_many_waiting_requests_are_refused_but_a_stop_is_not() -> None:
    async def story(robot: Robot, client: Client, __: httpx.AsyncClient) -> None:
        for _ in range(MOST_AT_ONCE):
            await client.say("request", path="/v1/inspect", body={"steps": ["home"]})
        refused = await client.ask("request", path="/v1/inspect", body={"steps": ["home"]})
        assert refused["code"] == 4106
        assert (await client.ask("request", path="/v1/stop"))["body"] == STOPPED
        assert robot.asked.count("stop") == 1

    run_story(story)


def test_answer_that_is_a_file_is_refused() -> None:
    async def story(robot: Robot, client: Client, _: httpx.AsyncClient) -> None:
        refused = await client.ask("request", method="GET", path="/v1/recordings/test_stream_requests.py")
        assert (refused["code"], refused["details"]["key"]) == (4005, "path")

    run_story(story)


def test_request_that_serves_nobody_else_ends_with_its_client() -> None:
    async def main() -> None:
        robot = Robot()
        async with up(robot) as url:
            async with connected(f"{url.replace('http', 'ws', 1)}/v1/stream") as client:
                await client.say("request", path="/v1/inspect", body={"steps": ["home"]})
                await client.ask("ping")
            await robot.left.wait()

    run(main())
