"""The flight recorder on the whole: every fault leaves one recording, and no end of a process half of one."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest

from dmc41x3.loops import run_virtual
from dmc41x3.twin.wire.faults import Value
from maya_un.errors import MayaError
from maya_un.events import Trouble
from maya_un.recorder import mcap_file
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.recorded import recorded, recording_store
from tests.system.processes import CALM, done, running
from tests.system.recording_worker import large
from tests.virtual_time import elapse

FAR = Joints(0.6, 1.3, 1.5)
BEFORE = 10.0
"""Time before a fault that must be in its recording [s]."""


class Case(NamedTuple):
    """A fault that surely befalls a robot in motion, for how long, and the codes that it may have."""

    fault: str
    values: dict[str, Value]
    seconds: float | None
    codes: frozenset[int]


CASES = [
    Case("cut", {}, None, frozenset({1001})),
    Case("half_open", {}, 4.0, frozenset({1003})),
    Case("latency", {"seconds": 3.0}, 4.0, frozenset({1003})),
    Case("drop", {"probability": 1.0}, 4.0, frozenset({1003})),
    Case("garbage", {"probability": 1.0}, 4.0, frozenset({1001, 1003, 1004, 1006, 2309})),
    Case("reset", {}, None, frozenset({1001, 1003, 2307})),
    Case("power_cycle", {"outage": 3.0}, None, frozenset({1001, 1003, 2307})),
    Case("abort_input", {}, 4.0, frozenset({2303})),
    Case("amplifier_fault", {}, 4.0, frozenset({2304})),
    Case("stuck_limit", {"axis": "B", "side": "reverse"}, 4.0, frozenset({2301})),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.fault)
def test_fault_leaves_one_recording_with_the_time_before_it(case: Case, campaign: Campaign, tmp_path: Path) -> None:
    for number in range(campaign.size(ci=1, long=10)):
        folder = tmp_path / str(number)
        run_virtual(_trial(case, campaign.rng(number), folder))
        _judge(case, folder)


async def _trial(case: Case, rng: Random, folder: Path) -> None:
    async with recorded(folder) as robot:
        await elapse(BEFORE + rng.uniform(0.0, 10.0))
        moving = asyncio.get_running_loop().create_task(robot.controller.move(FAR))
        await elapse(rng.uniform(0.5, 2.5))
        robot.virtual.faults.inject(case.fault, case.values, seconds=case.seconds)
        with suppress(MayaError):
            await moving
        await elapse(60.0)


def _judge(case: Case, folder: Path) -> None:
    (kept,) = recording_store(folder).list()
    taken = mcap_file.read(folder / kept.name)
    told = [event for event in taken.events if isinstance(event, Trouble) and event.code]
    assert told, f"{case.fault}: the fault is not in its recording"
    assert {event.code for event in told} <= case.codes
    first = told[0]
    assert (taken.header.cause.seq, taken.header.reason) == (first.seq, first.kind)
    assert taken.span[0] <= first.time - BEFORE
    assert taken.header.saved >= first.time + 4.9
    around = [state for state in taken.states if first.time - BEFORE <= state.time <= first.time]
    assert len(around) > BEFORE * 15, "states are missing before the fault"
    assert any(state.moving for state in around)


def test_a_process_that_is_killed_leaves_whole_recordings_only(campaign: Campaign, tmp_path: Path) -> None:
    worker = Path(__file__).with_name("recording_worker.py")
    root = Path(__file__).parents[2]
    for number in range(campaign.size(ci=5, long=100)):
        folder = tmp_path / str(number)
        line = [
            sys.executable,
            "-c",
            f"import runpy; runpy.run_path({str(worker)!r}, run_name='__main__')",
            str(folder),
        ]
        with subprocess.Popen(line, stdout=subprocess.PIPE, text=True, cwd=root) as process:
            assert process.stdout is not None
            process.stdout.readline()
            told = [process.stdout.readline().strip() for _ in range(number % 3)]
            with suppress(subprocess.TimeoutExpired):
                process.wait(campaign.rng(number).uniform(0.0, 0.6))
            process.kill()
            told += [name for name in process.stdout.read().split("\n") if name.endswith(".mcap")]
        kept = recording_store(folder)
        names = {one.name for one in kept.list()}
        assert set(told[-5:]) <= names, "what was told to be kept is gone"
        assert all(mcap_file.read(folder / name) == large() for name in names)
        kept.clean()
        left = {path.name for path in folder.iterdir()} if folder.exists() else set[str]()
        assert left == names


@pytest.mark.system
def test_a_running_robot_is_recorded_and_its_recording_replayed() -> None:
    with running(f"up --port 0 --speed 20 {CALM}") as up:
        up.until("Service:")
        assert done("gripper close")[0] == 0
        assert done("gripper open")[0] == 0
        code, said = done("record save --json", within=60.0)
        assert code == 0
        name = json.loads(said)["name"]
    code, said = done("record list")
    assert name in said
    code, said = done(f"record show {name}")
    assert "gripper_closed 1" in said
    code, said = done(f"replay {name}", within=60.0)
    assert (code, said.splitlines()[-1].endswith("0 differences.")) == (0, True), said
