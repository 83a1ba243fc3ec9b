"""The server's thread: real sockets, so these tests run in real loops."""

from __future__ import annotations

import asyncio
import http.client
from typing import cast

import pytest

from maya_un.api.service import Service
from maya_un.errors import AddressInUse
from maya_un.loops import ScaledLoop, run
from maya_un.server.app import create_app
from maya_un.server.bridge import Bridge
from maya_un.server.thread import bound_socket, served


class Clock:
    """A service whose status is the time of the loop it lives in."""

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
    with bound_socket(0) as door:
        async with served(app, door) as url:
            health = await loop.run_in_executor(None, get, url, "/v1/health")
            return health, await loop.run_in_executor(None, get, url, "/v1/status")


def test_the_server_serves_a_scaled_loop_and_ends_with_the_block() -> None:
    health, status = run(ask_twice(), lambda: ScaledLoop(100.0))
    assert (health[0], status[0]) == (200, 200)
    assert b'"time"' in status[1]


def test_a_taken_port_is_refused() -> None:
    with bound_socket(0) as door:
        door.listen()
        with pytest.raises(AddressInUse):
            bound_socket(door.getsockname()[1])
