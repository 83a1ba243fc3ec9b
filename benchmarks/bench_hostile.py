"""How late the robot's loop is, and how long a stop takes to the wire, while a crowd sends hostile requests.

The whole stack runs with its worker processes, its listener and the twin in real time; the crowd is a process of its
own. The loop's beat is a timer of 5 ms: how late the latest is within a second counts. Goals are about what the
crowd adds to the same without a crowd, so that other work of the machine does not count.
"""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from math import inf
from statistics import median
from typing import TypeVar

from harness import Case, Goal, Sample, measure, report

from maya_un.assembly.stack import Stack, stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.interpreter import prompt_loop
from tests.costly_requests import KINDS, CostlyRequest, prepared, send_request

T = TypeVar("T")

BEAT = 0.005
"""[s]"""

LENGTH = 1.0
"""Time during which one sample measures the beat [s]."""

QUIET = "nobody"


class Running:
    """A stack that serves HTTP at `port`, in a thread with a loop of its own."""

    def __init__(self) -> None:
        self.port = 0
        self._loop = asyncio.new_event_loop()
        self._robot: Future[Stack] = Future()
        self._over = asyncio.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> Running:
        self._thread.start()
        self._robot.result(60.0)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._over.set)
        self._thread.join()

    def do(self, work: Callable[[Stack], Awaitable[T]]) -> T:
        """Return what work does in the loop."""

        async def done() -> T:
            return await work(self._robot.result())

        return asyncio.run_coroutine_threadsafe(done(), self._loop).result(120.0)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        with staffed(Config()) as staff, bound_socket(0) as listener:
            self.port = listener.getsockname()[1]
            async with stack(Config(), staff=staff) as robot:
                bridge = Bridge(self._loop, robot.service, gate=robot.gate, callers=robot.access.callers)
                async with served(create_app(bridge), listener):
                    self._robot.set_result(robot)
                    await self._over.wait()


@contextmanager
def crowd(port: int, kind: str) -> Iterator[None]:
    """Have a crowd send requests of a kind while the block runs."""
    if kind == QUIET:
        yield
        return
    command = [sys.executable, "-m", "tests.costly_requests", str(port), kind]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as sending:
        try:
            assert sending.stdout is not None
            sending.stdout.readline()
            yield
        finally:
            sending.kill()


async def latest_beat(_: Stack) -> float:
    """Return how late the latest of the beats is [s]."""
    loop, latest = asyncio.get_running_loop(), 0.0
    until = loop.time() + LENGTH
    while (now := loop.time()) < until:
        await asyncio.sleep(BEAT)
        latest = max(latest, loop.time() - now - BEAT)
    return latest


def beats(running: Running, kind: str) -> Sample:
    """Return what samples the beat beside a crowd."""

    def sample() -> float:
        with crowd(running.port, kind):
            return running.do(latest_beat)

    return sample


def stops(running: Running, kind: str) -> Sample:
    """Return what samples the time from a stop over HTTP to its ST on the wire, beside a crowd [s]."""

    async def tapped(robot: Stack) -> list[float]:
        assert robot.twin is not None
        heard: list[float] = []

        def tap(_letter: str, way: str, data: bytes) -> None:
            if way == "rx" and b"ST" in data:
                heard.append(time.monotonic())

        robot.twin.controller.tap = tap
        return heard

    def sample() -> float:
        with crowd(running.port, kind):
            heard, asked = running.do(tapped), time.monotonic()
            send_request(running.port, CostlyRequest("POST", "/v1/stop"))
            return min((at for at in heard if at >= asked), default=inf) - asked

    return sample


def main() -> None:
    """Measure and report."""
    prompt_loop()  # as `maya up` does
    with Running() as running:
        for kind in KINDS:
            send_request(running.port, prepared(running.port, kind))
        cases: list[Case] = []
        for kind in (QUIET, *KINDS):
            late = None if kind == QUIET else Goal(10.0, to=f"beat, {QUIET}", kind="over")
            stop = None if kind == QUIET else Goal(50.0, to=f"stop, {QUIET}", kind="over")
            cases += [
                Case(f"beat, {kind}", beats(running, kind), "ms", late),
                Case(f"stop, {kind}", stops(running, kind), "ms", stop),
            ]
        figures = measure(cases, rounds=3, by=median)
    report(figures)


if __name__ == "__main__":
    main()
