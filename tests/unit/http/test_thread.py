"""The server's thread: real sockets, so these tests run in real loops."""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
from typing import cast

import pytest

from dmc41x3.loops import ScaledLoop, run
from maya_un.errors import AddressInUse
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.service.service import Service


class Clock:
    """A service whose status is the time of the loop it lives in."""

    stops = 0

    async def status(self) -> dict[str, float]:
        return {"time": asyncio.get_running_loop().time()}


def get(url: str, path: str) -> tuple[int, bytes]:
    """Return status and body of one GET."""
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=10.0)
    try:
        connection.request("GET", path)
        response = connection.getresponse()
        return response.status, response.read()
    finally:
        connection.close()


async def ask_twice() -> tuple[tuple[int, bytes], tuple[int, bytes]]:
    """Serve from the running loop, ask it from another thread, and end."""
    loop = asyncio.get_running_loop()
    app = create_app(Bridge(loop, cast("Service", Clock())))
    with bound_socket(0) as listener:
        async with served(app, listener) as url:
            health = await loop.run_in_executor(None, get, url, "/v1/health")
            return health, await loop.run_in_executor(None, get, url, "/v1/status")


def test_the_server_serves_a_scaled_loop_and_ends_with_the_block() -> None:
    health, status = run(ask_twice(), lambda: ScaledLoop(100.0))
    assert (health[0], status[0]) == (200, 200)
    assert b'"time"' in status[1]


def answer_to(url: str, request: bytes) -> bytes:
    """Return all that is answered to raw bytes, to the end of the connection."""
    host, port = url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=10.0) as connection:
        connection.sendall(request)
        return b"".join(iter(lambda: connection.recv(65536), b""))


async def say(request: bytes) -> bytes:
    """Serve, send raw bytes, return the answer."""
    loop = asyncio.get_running_loop()
    with bound_socket(0) as listener:
        async with served(create_app(Bridge(loop, cast("Service", Clock()))), listener) as url:
            return await loop.run_in_executor(None, answer_to, url, request)


@pytest.mark.parametrize("request_", [b"\x00\xff garbage\r\n\r\n", b"GET /v1/health HTTP/1.1\r\n\r\n"])
def test_invalid_http_is_answered_with_a_code(request_: bytes) -> None:
    head, _, body = run(say(request_)).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400")
    assert json.loads(body)["code"] == 4005


@pytest.mark.waits("1 s that a server gives a request that is half sent, over a real socket")
def test_an_end_with_requests_half_sent_is_quiet(capfd: pytest.CaptureFixture[str]) -> None:
    async def main() -> None:
        loop = asyncio.get_running_loop()
        with bound_socket(0) as listener:
            async with served(create_app(Bridge(loop, cast("Service", Clock()))), listener) as url:
                port = int(url.rpartition(":")[2])
                _, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n{")
                await loop.run_in_executor(None, get, url, "/v1/health")
        writer.close()

    run(main())
    assert capfd.readouterr() == ("", "")


def test_a_taken_port_is_refused() -> None:
    with bound_socket(0) as listener:
        listener.listen()
        with pytest.raises(AddressInUse):
            bound_socket(listener.getsockname()[1])
