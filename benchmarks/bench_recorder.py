"""The cost of the flight recorder for the driver, and the time for which saving a full one blocks the loop."""

from __future__ import annotations

import asyncio
import os
import tempfile
import time
from collections.abc import Awaitable, Callable, Coroutine
from pathlib import Path
from statistics import median
from typing import Any

from bench_driver import Answerer, over
from harness import Case, Goal, Sample, measure, report, timed

from dmc41x3.driver import Driver
from dmc41x3.wire.transport import TcpTransport
from maya_un.config import Config, RecorderConfig
from maya_un.events import MotionEnded
from maya_un.interpreter import quiet_collector
from maya_un.recorder.capture import WireDirection
from maya_un.recorder.recorder import Recorder
from maya_un.recorder.recording import RecordingOrigin
from maya_un.recorder.store import RecordingStore
from maya_un.values import Joints, Mode, Point, State

REQUESTS, ROUNDS = 100, 200
"""Short samples, bare and recorded in turn: what else the machine does hits both alike, and the median tells."""

SENT, RECEIVED = WireDirection(1, "client"), WireDirection(1, "controller")
BARE = "driver, a question and a record"
RECORDED = "the same, recorded"
SHORT = "driver, request and reply"
MOST = 1.03
"""The most that recording may make of the driver's time."""

TICK = 0.001
"""How often the loop is asked whether it is held up while a recording is written [s]."""

_NO = (False, False, False)


def state(now: float) -> State:
    """Return a state as the controller layer makes them."""
    here = Joints(now, 1.5, 1.3)
    place = Point(0.1, 0.2, now)
    counts = (int(now), 1_500_000, 1_300_000)
    return State(
        now, Mode.IDLE, True, counts, here, place, (now, 0.0, 0.0), False, _NO, _NO, _NO, (1, 1, 1), False, None, None
    )


async def beat(driver: Driver) -> None:
    """Ask what the controller layer asks all the time: whether the guard watches, and where the axes are."""
    await driver.send("MG_XQ7,mayaout")
    await driver.record()


def in_loop(loop: asyncio.AbstractEventLoop, request: Callable[[], Awaitable[object]]) -> Sample:
    """Return a sample of the processor's time for one request [s]; waiting for a busy machine is nobody's cost."""

    def sample() -> float:
        start = time.process_time()
        loop.run_until_complete(over(REQUESTS, request))
        return (time.process_time() - start) / REQUESTS

    return sample


def filled(loop: asyncio.AbstractEventLoop, folder: Path) -> Recorder:
    """Return a recorder that holds ten minutes of beats, records and states, as `maya up` makes them."""

    async def fill() -> Recorder:
        recorder = Recorder(
            RecorderConfig(), RecordingOrigin.of(Config(), "sim"), RecordingStore(folder, 3, 10**9, time.time_ns)
        )
        ring, record = recorder.ring, bytes(range(190)) + b":"
        while not ring.contents([]).dropped and ring.size < 38 << 20:
            for _ in range(1000):
                ring.piece(SENT, b"mayabeat=TIME;MG_XQ7,mayaout\r")
                ring.piece(RECEIVED, b": 4.0000 0.0000\r\n:")
                ring.piece(SENT, b"QR\r")
                ring.piece(RECEIVED, bytes(bytearray(record)))
                ring.state(state(loop.time()))
        ring.event(MotionEnded(seq=1, time=loop.time()))
        return recorder

    return loop.run_until_complete(fill())


async def longest_hold(work: Coroutine[Any, Any, object]) -> float:
    """Return the longest that a callback of the loop came late while `work` was done [s]."""
    loop, worst = asyncio.get_running_loop(), 0.0
    working = loop.create_task(work)
    while not working.done():
        due = loop.time() + TICK
        await asyncio.sleep(TICK)
        worst = max(worst, loop.time() - due)
    await working
    return worst


def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    quiet_collector()
    loop = asyncio.new_event_loop()
    server = loop.run_until_complete(loop.create_server(Answerer, "127.0.0.1", 0))
    port = server.sockets[0].getsockname()[1]

    async def open_driver(recorder: Recorder | None) -> Driver:
        transport = await TcpTransport.connect("127.0.0.1", port, 5.0)
        return await Driver.open(transport if recorder is None else recorder.recorded(transport), timeout=5.0)

    with tempfile.TemporaryDirectory() as folder:
        recorder = filled(loop, Path(folder))
        bare = loop.run_until_complete(open_driver(None))
        recorded = loop.run_until_complete(open_driver(recorder))
        ring = recorder.ring
        some, event = state(1.0), MotionEnded(seq=1, time=1.0)
        driver = [
            Case(BARE, in_loop(loop, lambda: beat(bare))),
            Case(RECORDED, in_loop(loop, lambda: beat(recorded)), goal=Goal(MOST, to=BARE)),
            Case(SHORT, in_loop(loop, lambda: bare.send("TP"))),
            Case(f"{SHORT}, recorded", in_loop(loop, lambda: recorded.send("TP"))),
        ]
        figures = measure(driver, rounds=ROUNDS, by=median)
        saving = [
            Case("a piece of the wire, ring full", timed(lambda: ring.piece(SENT, b"TP\r"), 2000)),
            Case("a state", timed(lambda: ring.state(some), 2000)),
            Case("an event", timed(lambda: ring.event(event), 2000)),
            Case("loop held, nothing to do", lambda: loop.run_until_complete(longest_hold(asyncio.sleep(1.0))), "ms"),
            Case("loop held, a full ring saved", lambda: loop.run_until_complete(longest_hold(recorder.save())), "ms"),
        ]
        figures += measure(saving, rounds=3)
        loop.run_until_complete(bare.close())
        loop.run_until_complete(recorded.close())
    server.close()
    loop.run_until_complete(server.wait_closed())
    loop.run_until_complete(loop.shutdown_default_executor())
    loop.close()
    report(figures)


if __name__ == "__main__":
    main()
