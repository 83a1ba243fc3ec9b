"""A machine that differs from its configuration: measured with `maya calibrate collect`, calibrated, and met again."""

from __future__ import annotations

import asyncio
import io
import json
import math
import os
import random
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from dmc41x3.loops import ScaledLoop, run
from maya_un import runtime
from maya_un.assembly.stack import Stack, stack
from maya_un.cli.main import main
from maya_un.config import Config, load
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.sockets import bound_socket
from maya_un.http.thread import served
from maya_un.machine.truth import TrueConstants
from maya_un.values import Point

pytestmark = pytest.mark.system

SPEED = 150.0
NOISE = 2e-4
"""Error of a good measurement of a coordinate [m]."""

TRUTH = replace(
    TrueConstants(),
    height=2.361,
    length=2.294,
    delta=0.304,
    counts_per_degree=370.5,
    counts_per_metre=1.002e6,
    switches=((0.010, 2.0 * math.pi / 3.0), (0.579, 2.262), (0.561, 2.298)),
)


class Robot:
    """A running `maya up` whose twin can be looked at."""

    def __init__(self, loop: asyncio.AbstractEventLoop, running: Stack) -> None:
        self._loop = loop
        self._running = running

    def gripper(self) -> Point:
        """Return where the gripper truly is [m]."""
        return self._do(self._look)

    def _look(self) -> Point:
        twin = self._running.twin
        assert twin is not None
        twin.mechanics.advance(self._loop.time())
        return Point(*twin.mechanics.gripper_point())

    def _do(self, work: Callable[[], Point]) -> Point:
        done: Future[Point] = Future()
        self._loop.call_soon_threadsafe(lambda: done.set_result(work()))
        return done.result(20.0)


@contextmanager
def robot(config: Config, truth: TrueConstants) -> Iterator[Robot]:
    """Run a twin of `truth` under `config` and its HTTP interface, in a thread, many times as fast as real time."""
    started: Future[Robot] = Future()
    over = asyncio.Event()

    async def serve() -> None:
        loop = asyncio.get_running_loop()
        with bound_socket(0) as listener, runtime.claimed():
            async with (
                stack(config, seed=5, truth=truth, speed=SPEED) as running,
                served(create_app(Bridge(loop, running.service)), listener) as url,
            ):
                runtime.publish(runtime.Running(url, os.getpid(), None))
                started.set_result(Robot(loop, running))
                await over.wait()

    def in_thread() -> None:
        try:
            run(serve(), lambda: ScaledLoop(SPEED))
        except BaseException as error:
            if not started.done():
                started.set_exception(error)
            raise

    thread = threading.Thread(target=in_thread)
    thread.start()
    found = started.result(20.0)
    try:
        yield found
    finally:
        found._loop.call_soon_threadsafe(over.set)
        thread.join(20.0)


class Person(io.StringIO):
    """Measures where the gripper is whenever it is asked, a little wrong, and misreads a few."""

    def __init__(self, at: Robot, seed: int, wrong: int) -> None:
        super().__init__()
        self._at = at
        self._random = random.Random(seed)
        self._wrong = wrong
        self.asked = 0

    def readline(self, size: int | None = -1, /) -> str:
        self.asked += 1
        place = [value + self._random.gauss(0.0, NOISE) for value in self._at.gripper()]
        if self.asked == self._wrong:
            place[0] += 0.1
        return " ".join(f"{value * 1e3:.3f}mm" for value in place) + "\n"


def output_of(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run a command that must succeed and return its output."""
    code = main(list(arguments))
    out, err = capsys.readouterr()
    assert code == 0, out + err
    return out


@pytest.fixture(autouse=True)
def own_places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.mark.waits("about 8 s of two homings and of motion to 27 places at 150 times real speed, through HTTP")
def test_machine_is_measured_calibrated_and_reaches_its_targets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    points, file = str(tmp_path / "points.csv"), tmp_path / "maya.toml"
    file.write_text("# ours\n[geometry]\nheight = 2.35  # from the drawing\n")
    with robot(load(file), TRUTH) as real:
        output_of(capsys, "home")
        for number in ("9", "24"):
            person = Person(real, seed=int(number), wrong=6)
            monkeypatch.setattr("sys.stdin", person)
            output_of(capsys, "calibrate", "collect", points, "--points", number, "--config", str(file))
        assert person.asked == 15
    found = json.loads(output_of(capsys, "calibrate", points, "--apply", "--config", str(file), "--json"))
    assert (found["measured"], found["used"], len(found["outliers"])) == (24, 22, 2)
    assert found["rms_after"] < 1e-3
    assert found["rms_before"] > 5e-3
    truth = {
        "height": TRUTH.height,
        "length": TRUTH.length,
        "delta": TRUTH.delta,
        "pulses_per_metre": TRUTH.counts_per_metre,
        "pulses_per_degree": TRUTH.counts_per_degree,
    }
    for constant in found["constants"]:
        if constant["name"] in truth:
            assert abs(constant["fitted"] - truth[constant["name"]]) < 5.0 * constant["error"], constant["name"]
    assert "# from the drawing" in file.read_text()
    config = load(file)
    assert config.axes.b.minimum == pytest.approx(0.579, abs=2e-3)
    with robot(config, TRUTH) as real:
        output_of(capsys, "home")
        for target in ((0.5, 1.2, 0.5), (1.4, 0.3, 0.9), (0.4, 0.6, 1.5)):
            output_of(capsys, "approach", *(str(value) for value in target), "--config", str(file))
            wanted = (*target[:2], target[2] + config.cell.clearance)
            assert real.gripper() == pytest.approx(wanted, abs=1e-3)
