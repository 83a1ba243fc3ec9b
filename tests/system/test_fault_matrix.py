"""Every fault on demand in every phase of a job: never silent, never unsafe, nothing moves until a person recovers.

Allowed results of each fault on a job are in `EXPECTED`; the mechanics' own record decides whether it was safe.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from random import Random
from typing import NamedTuple

import pytest

from dmc41x3.loops import run_virtual
from dmc41x3.twin.wire.faults import TABLE, Value
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.errors import MayaError
from maya_un.events import GripperClosed, HomingBegun, HomingDone, PhaseBegun
from maya_un.machine.truth import StartPose
from maya_un.process.process import Process
from maya_un.process.spec.job import Job
from maya_un.robot.robot import MayaRobot
from maya_un.schema.jobs import JobReport, TaskState
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode, Point
from tests.campaign import Campaign
from tests.virtual_time import elapse

HERE = Joints(0.3, 1.5, 1.3)
PART, TRAY = Point(0.45, 1.20, 0.40), Point(1.15, 0.60, 0.40)
LASTS = 4.0
"""Duration of a lasting fault [s], longer than any wait for a reply."""
COUNT = 5e-5

LINK = frozenset({1001, 1003, 1006})
KILLED = frozenset({2309})


class Case(NamedTuple):
    """A fault with its parameters, the codes that it may end a job with, and whether a job may also survive it."""

    fault: str
    values: dict[str, Value]
    codes: frozenset[int]
    survivable: bool = False


EXPECTED = [
    Case("latency", {"seconds": 0.05, "jitter": 0.05}, frozenset(), survivable=True),
    Case("latency", {"seconds": 3.0}, LINK),
    Case("drop", {"probability": 0.5}, LINK, survivable=True),
    Case("duplicate", {"probability": 0.5}, LINK, survivable=True),
    # Among random bytes is a question mark at times, which reads as a refusal.
    Case("garbage", {"probability": 0.5}, LINK | KILLED | {1004}, survivable=True),
    Case("refuse_commands", {"probability": 0.3}, LINK | KILLED | {1004, 1007, 2302, 2308}, survivable=True),
    Case("half_open", {}, LINK),
    Case("cut", {}, LINK),
    Case("refuse_connections", {}, frozenset(), survivable=True),
    Case("reset", {}, LINK | KILLED | {2307}),
    Case("power_cycle", {"outage": 3.0}, LINK | KILLED | {2307}),
    Case("stuck_limit", {"axis": "B", "side": "forward"}, frozenset({2301, 2315, 2401, 2402}), survivable=True),
    Case("stuck_limit", {"axis": "C", "side": "reverse"}, frozenset({2301, 2315, 2401, 2402}), survivable=True),
    Case("stuck_limit", {"axis": "B", "active": False}, frozenset({2401, 2402, 2403}), survivable=True),
    Case("encoder_loss", {"axis": "B"}, frozenset({2302, 2308, 2402, 2404}), survivable=True),
    Case("abort_input", {}, KILLED | {2303}),
    Case("amplifier_fault", {}, frozenset({2304})),
]

PHASES = {
    "homing": (HomingBegun, "", 1),
    "approach": (PhaseBegun, "approach", 1),
    "down to the part": (PhaseBegun, "down", 1),
    "grasp": (GripperClosed, "", 1),
    "up with the part": (PhaseBegun, "up", 1),
    "across": (PhaseBegun, "approach", 2),
    "down to the tray": (PhaseBegun, "down", 2),
    "release": (PhaseBegun, "open", 1),
    "up and away": (PhaseBegun, "up", 2),
    "paused across": (PhaseBegun, "approach", 2),
    "slowed across": (PhaseBegun, "approach", 2),
    "at rest": (HomingDone, "", 1),
}
"""When a phase begins: with the n-th event of a kind, and where it has a name, of that name."""


def test_every_fault_of_the_table_is_tried() -> None:
    assert {case.fault for case in EXPECTED} == {fault.name for fault in TABLE}


@pytest.mark.parametrize("case", EXPECTED, ids=lambda case: " ".join([case.fault, *map(str, case.values.values())]))
def test_every_fault_in_every_phase(case: Case, campaign: Campaign) -> None:
    phases = list(PHASES)
    size = campaign.size(ci=1, long=len(phases))
    first = campaign.rng().randrange(len(phases))
    for number in range(size):
        phase = phases[(first + number * 5) % len(phases)]
        run_virtual(_trial(case, phase, campaign.rng(number)))


@asynccontextmanager
async def _robot(phase: str) -> AsyncIterator[tuple[Rig, Process]]:
    """Give a robot in the state in which the phase's job begins: not homed, or homed at `HERE`.

    The guard waits longer than usual, so that a minute of motion needs fewer beats.
    """
    config = parse({"safety": {"guard_time": 2.0}})
    start = StartPose() if phase == "homing" else StartPose(*HERE)
    async with rig(config, start=start, parts={"cube": PART}, live=True) as bench:
        if phase != "homing":
            handle = bench.virtual.machine.connect()
            assert handle is not None
            a, b, c = bench.controller.units.to_counts(HERE)
            mark = f"DP {a},{b},{c};mayaendb=2260000;mayaendc=2300000;ZAA=7;mayahome=7;SB1\r"
            bench.virtual.machine.receive(handle, mark.encode(), bench.virtual.machine.now)
            bench.virtual.machine.disconnect(handle)
            await bench.controller.skip_home()
        process = Process(MayaRobot(bench.controller, config), bench.controller, config)
        try:
            yield bench, process
        finally:
            await process.close()


def _job(phase: str) -> Job:
    steps: list[object] = [{"pick": "cube"}, {"place": "tray"}]
    parts, places = {"cube": list(PART)}, {"tray": list(TRAY)}
    return Job.parse(
        {"name": "job", "parts": parts, "places": places, "steps": ["home"] if phase == "homing" else steps}
    )


async def _begun(bench: Rig, phase: str, number: int, process: Process) -> None:
    """Wait until a phase has begun; a job of that many steps has every one of them."""
    kind, name, count = PHASES[phase]
    while (
        sum(isinstance(e, kind) and e.detail.get("name", "") == name for e in bench.controller.events.since(0)) < count
    ):
        report = await process.views.report(number)
        assert report.state not in (TaskState.DONE, TaskState.FAILED), f"the job ended before {phase}"
        await elapse(0.1)


async def _trial(case: Case, phase: str, rng: Random) -> None:
    async with _robot(phase) as (bench, process):
        number = None
        if phase != "at rest":
            number = await process.submit(_job(phase))
            await _begun(bench, phase, number, process)
            await _paced(bench, phase, rng)
        await elapse(rng.uniform(0.0, 3.0))
        told = len(bench.controller.events)
        injection = bench.virtual.faults.inject(case.fault, case.values, seconds=LASTS if _lasts(case) else None)
        where = f"{case.fault} {dict(injection.values)} in {phase}"
        if number is None:
            await elapse(30.0)
        else:
            report = await _result(bench, process, number)
            _judge_job(case, report, bench, where)
        await elapse(LASTS)
        _judge_events(case, bench, told, where)
        await _nothing_moves_until_recovery(bench, where)
        _judge_mechanics(bench, case, phase, where)


async def _paced(bench: Rig, phase: str, rng: Random) -> None:
    """Pause or slow the motion down in the given phase."""
    if phase.startswith(("paused", "slowed")):
        await elapse(rng.uniform(0.0, 3.0))
        await (bench.controller.pause() if phase.startswith("paused") else bench.controller.override(0.4))


async def _result(bench: Rig, process: Process, number: int) -> JobReport:
    """Wait for the end of a job; one that a fault left in its pause is resumed once the fault is over."""
    if bench.controller.state.mode is Mode.PAUSED:
        await elapse(2.0 * LASTS)
        if bench.controller.state.mode is Mode.PAUSED:
            await bench.controller.resume()
    return await process.result(number)


def _lasts(case: Case) -> bool:
    fault = next(fault for fault in TABLE if fault.name == case.fault)
    return fault.end is not None and not fault.duration


def _judge_job(case: Case, report: JobReport, bench: Rig, where: str) -> None:
    if report.state is TaskState.DONE:
        assert case.survivable, f"{where}: the job is said to be done"
        if len(report.steps) > 1:
            x, y, z = bench.mechanics.record.parts["cube"]
            assert (x, y, z) == pytest.approx(TRAY, abs=0.005), f"{where}: said to be done"
    else:
        assert report.code in case.codes, f"{where}: {report.code} {report.message}"


def _judge_events(case: Case, bench: Rig, told: int, where: str) -> None:
    """A robot in a fault has reported it, once, with its code."""
    codes = [event.code for event in bench.controller.events.since(told) if event.code]
    assert set(codes) <= case.codes, f"{where}: {codes}"
    state = bench.controller.state
    if state.fault is not None:
        assert state.fault.code in codes, f"{where}: {state.fault} was never told"


async def _nothing_moves_until_recovery(bench: Rig, where: str) -> None:
    rest = bench.mechanics.true_joints()
    await elapse(30.0)
    assert bench.mechanics.true_joints() == pytest.approx(rest, abs=COUNT), f"{where}: moved by itself"
    if bench.controller.state.mode in {Mode.FAULT, Mode.DISCONNECTED}:
        await _recover(bench, where)
    assert bench.controller.state.mode in {Mode.IDLE, Mode.NOT_HOMED}, where
    await elapse(10.0)
    assert bench.mechanics.true_joints() == pytest.approx(rest, abs=COUNT), f"{where}: recovery moved it"


async def _recover(bench: Rig, where: str) -> None:
    reason: MayaError | None = None
    for _ in range(30):
        try:
            return await bench.controller.recover()
        except MayaError as error:
            reason = error
            await elapse(1.0)
    raise AssertionError(f"{where}: recover says {reason}")


def _judge_mechanics(bench: Rig, case: Case, phase: str, where: str) -> None:
    record = bench.mechanics.record
    limit = Config().safety.tension_limit if phase != "homing" else 6.0
    assert record.peak_tension <= limit, f"{where}: {record.peak_tension} loads"
    assert record.peak_slack <= (0.25 if phase == "homing" else 0.0), f"{where}: {record.peak_slack} m slack"
    assert not record.drops, f"{where}: {record.drops}"
    pushes = phase == "homing" and case.fault in {"stuck_limit", "encoder_loss"}
    assert pushes or record.stall_time == 0.0, f"{where}: stalled {record.stall_time} s"
