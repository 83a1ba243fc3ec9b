"""Forty readers want all of the past in a loop: a stop is obeyed as if they were not there."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from math import inf
from pathlib import Path

import pytest

from dmc41x3.loops import run
from maya_un.assembly.stack import Stack, stack
from maya_un.config import Config
from maya_un.events import KEPT, PhaseBegun
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.service.access.operations import LOCAL, Operation
from tests.campaign import Campaign

pytestmark = [pytest.mark.system, pytest.mark.timeout(240)]

ROOT = Path(__file__).resolve().parents[2]
READERS = 40


@contextmanager
def stream_load(port: int) -> Iterator[None]:
    """Let them ask, for the length of the block."""
    command = [sys.executable, "-m", "tests.stream_readers", str(port), str(READERS)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, cwd=ROOT) as crowd:
        try:
            assert crowd.stdout is not None
            assert crowd.stdout.readline() == b"here\n"
            yield
        finally:
            crowd.kill()


def tapped(robot: Stack) -> list[float]:
    """Return the instants of every ST that comes to the twin, as they come [s, monotonic]."""
    assert robot.twin is not None
    stops: list[float] = []

    def tap(_letter: str, way: str, data: bytes) -> None:
        if way == "rx" and b"ST" in data:
            stops.append(time.monotonic())

    robot.twin.controller.tap = tap
    return stops


def stopped(port: int, count: int, done: Callable[[], int]) -> list[float]:
    """Say stop so often, each on a connection of its own; return when, after the answer to each."""
    asked: list[float] = []
    for _ in range(count):
        connection = HTTPConnection("127.0.0.1", port, timeout=30.0)
        asked.append(time.monotonic())
        connection.request("POST", "/v1/stop")
        assert connection.getresponse().status == 200
        connection.close()
        assert done() >= len(asked)
    return asked


def late(asked: list[float], stops: list[float]) -> tuple[float, float]:
    """Return the median and the worst time from a stop request to its ST [s]."""
    times = sorted(min((at for at in stops if at >= since), default=inf) - since for since in asked)
    return times[len(times) // 2], times[-1]


def test_a_stop_is_obeyed_however_many_want_all_of_the_past(campaign: Campaign) -> None:
    """The bounds allow for the other tests on this machine; `scripts/bench hostile` measures a quiet one."""
    count = campaign.size(ci=8, long=200)

    async def main() -> tuple[list[float], list[float], list[float]]:
        async with stack(Config()) as robot:
            for number in range(KEPT):
                robot.controller.events.emit(PhaseBegun(f"{number:60}"))
            stops, loop = tapped(robot), asyncio.get_running_loop()
            bridge = Bridge(loop, robot.service, gate=robot.gate, callers=robot.access.callers)
            with bound_socket(0) as listener:
                port = listener.getsockname()[1]
                async with served(create_app(bridge), listener):
                    crowd = stream_load(port)
                    await loop.run_in_executor(None, crowd.__enter__)
                    try:
                        asked = await loop.run_in_executor(None, stopped, port, count, lambda: len(stops))
                        direct: list[float] = []
                        for _ in range(count):
                            direct.append(time.monotonic())
                            await robot.gate.call(LOCAL, Operation.STOP, lambda service: service.stop())
                    finally:
                        crowd.__exit__(None, None, None)
        return asked, direct, stops

    asked, direct, stops = run(main())
    usual, worst = late(asked, stops)
    assert usual <= 0.2 and worst <= 1.0, f"over HTTP: median {usual:.3f} s, worst {worst:.3f} s"
    usual, worst = late(direct, stops)
    assert usual <= 0.05 and worst <= 0.5, f"at the gate: median {usual:.3f} s, worst {worst:.3f} s"
