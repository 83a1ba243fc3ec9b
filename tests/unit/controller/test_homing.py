from __future__ import annotations

import asyncio
from dataclasses import replace
from math import sqrt

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller import homing
from maya_un.controller.homing import homed_pose
from maya_un.errors import (
    HomingStalled,
    MachineError,
    MayaError,
    Stopped,
    StrokeDiffers,
    SwitchNotFound,
    WiringContradictsCn,
)
from maya_un.events import FaultEntered, HomingBegun, HomingDone, MotionStopped, PhaseBegun
from maya_un.kinematics.workspace import Workspace
from maya_un.machine.truth import StartPose, TrueConstants
from maya_un.testing import Rig, rig
from maya_un.values import Mode, Progress
from tests.unit.controller.bench import commands_in, foreign, kinds, rewired
from tests.virtual_time import elapse

PHASES = ["raise", "datum_a", "datum_c", "datum_b", "stroke_c", "stroke_b", "pose"]
WIDTH = 2.0
ENDS = ((0.575, 2.260), (0.565, 2.300))


def tension(b: float, c: float) -> float:
    """Return what the tighter line carries (in loads): both hold the load, and one another sideways."""
    u = (WIDTH**2 + b * b - c * c) / (2.0 * WIDTH)
    h = sqrt(b * b - u * u)
    return max(b * (WIDTH - u), c * u) / (WIDTH * h)


@given(st.floats(*ENDS[0]), st.floats(*ENDS[1]), st.floats(0.0, 2.0), st.floats(1.0, 1.3))
def test_a_step_of_the_raise_keeps_off_straight_lines(b: float, c: float, friction: float, off: float) -> None:
    u = (WIDTH**2 + b * b - c * c) / (2.0 * WIDTH)
    assume(0.0 <= u <= WIDTH and b > u + 1e-9)
    load = tension(b, c)
    reading = load / off + friction
    assume(load <= 5.0 and reading < homing.ENOUGH)
    step = homing._safe_step(reading, WIDTH)
    bound = 2.36 if off == 1.0 else 4.53
    assert tension(b - step, c - step) <= bound


@given(st.floats(0.5001, 2.0), st.floats(0.0, 2.0))
def test_lines_share_a_quarter_of_the_rest_and_friction_reduces_it(load: float, friction: float) -> None:
    half = 2.0 * load
    left = WIDTH * (half / sqrt(half * half - 1.0) - 1.0)
    step = homing._safe_step(load, WIDTH)
    assert 0.0 < 2.0 * step <= left / 4.0 + 1e-12
    assert homing._safe_step(load + friction, WIDTH) <= step


def test_the_homed_pose_is_inside_and_off_every_switch() -> None:
    pose, axes = homed_pose(Config()), Config().axes
    assert Workspace.of(Config()).holds_grain(pose)
    for place, axis in zip(pose, (axes.a, axes.b, axes.c), strict=True):
        assert axis.minimum + 0.02 < place < axis.maximum - 0.02


async def test_homing_reports_its_phases_and_leaves_its_mark_last() -> None:
    async with rig() as bench:
        shown: list[Progress | None] = []
        with bench.controller.events.listening(lambda _: shown.append(bench.controller.progress())):
            await bench.controller.home()
        told = [(one.phase, one.number, one.count) for one in shown if one is not None]
        assert told == [(phase, number, 7) for number, phase in enumerate(PHASES, 1)]
        events = bench.controller.events.since(0)
        assert [event.detail["name"] for event in events if isinstance(event, PhaseBegun)] == PHASES
        assert kinds(bench)[2] is HomingBegun
        assert kinds(bench)[-1] is HomingDone
        sent = commands_in(bytes(bench.sent))
        first, last = sent.index("BGS"), len(sent) - sent[::-1].index("BGS")
        assert {"mayahome=0", "ZAA=0"} < set(sent[:first])
        marks = [command.split("=")[0] for command in sent[last:] if "=" in command and not command.startswith("TL")]
        assert marks == ["ZAA", "mayaendb", "mayaendc", "mayagiv", "mayahome"]
        assert {command for command in sent if command[:2] == "BG"} == {"BGS"}


async def test_measured_strokes_bound_the_workspace() -> None:
    nominal = TrueConstants()
    short = replace(nominal, switches=(nominal.switches[0], (0.575, 2.21), (0.565, 2.35)))
    async with rig(truth=short) as bench:
        await bench.controller.home()
        assert bench.controller.workspace.line_b[1] == pytest.approx(2.21 - 0.001, abs=1e-3)
        assert bench.controller.workspace.line_c[1] == pytest.approx(2.300, abs=1e-3)


@pytest.mark.parametrize("start", [StartPose(1.0, 1.7, 0.536), StartPose(1.0, 0.546, 1.7)], ids=["c", "b"])
async def test_a_line_that_was_left_at_its_hard_stop_is_homed_from_there(start: StartPose) -> None:
    async with rig(truth=replace(TrueConstants(), gaps=(0.05, 0.03, 0.03)), start=start) as bench:
        await bench.controller.home()
        assert bench.mechanics.record.stall_time == 0.0


async def interrupted(bench: Rig, phase: str) -> asyncio.Task[None]:
    """Begin to home, let it come a second into a phase, and stop it."""
    home = asyncio.create_task(bench.controller.home())
    progress = bench.controller.progress()
    while progress is None or progress.phase != phase:
        await elapse(0.5)
        progress = bench.controller.progress()
    await elapse(1.0)
    assert bench.controller.state.mode is Mode.HOMING
    await bench.controller.stop()
    assert bench.controller.state.mode is Mode.STOPPING
    await asyncio.wait({home})
    return home


@pytest.mark.parametrize("phase", PHASES)
async def test_a_stop_in_any_phase_leaves_the_robot_at_rest_and_not_homed(phase: str) -> None:
    async with rig(start=StartPose(0.4, 1.6, 1.7)) as bench:
        home = await interrupted(bench, phase)
        assert isinstance(home.exception(), Stopped)
        state = bench.controller.state
        assert (state.mode, state.homed, state.moving, state.fault) == (Mode.NOT_HOMED, False, False, None)
        assert bench.controller.progress() is None
        assert kinds(bench)[-1] is MotionStopped
        assert await foreign(bench, "MG mayahome", "MG _ZAA") == ["0.0000", "0.0000"]
        rest = bench.mechanics.true_joints()
        await elapse(60.0)
        assert bench.mechanics.true_joints() == rest


@pytest.mark.parametrize(
    ("truth", "error", "details"),
    [
        (replace(TrueConstants(), gaps=(-0.2, 0.02, 0.02)), HomingStalled, {"axis": "a"}),
        (replace(TrueConstants(), gaps=(0.05, 0.02, -0.3)), HomingStalled, {"axis": "c"}),
        (
            replace(TrueConstants(), switches=(TrueConstants().switches[0], (0.575, 2.260), (0.565, 2.120))),
            StrokeDiffers,
            {"axis": "c", "measured": "2120.0 mm", "wanted": "2300.0 mm"},
        ),
        (
            replace(TrueConstants(), switches=((-2.0, 2.0), (0.575, 2.260), (0.565, 2.300)), gaps=(1.0, 0.02, 0.02)),
            SwitchNotFound,
            {"axis": "a", "side": "reverse"},
        ),
    ],
    ids=["boom blocked", "line blocked", "stroke differs", "no switch"],
)
async def test_untrusted_homing_is_named_and_waits_for_a_person(
    truth: TrueConstants, error: type[MayaError], details: dict[str, str]
) -> None:
    async with rig(truth=truth) as bench:
        with pytest.raises(error) as failure:
            await bench.controller.home()
        assert isinstance(failure.value, MachineError)
        found = {key: failure.value.details[key] for key in details}
        if "measured" in found:
            assert float(str(found.pop("measured")).split()[0]) == pytest.approx(2120.0, abs=1.0)
            details = {key: value for key, value in details.items() if key != "measured"}
        assert found == details
        assert bench.controller.state.mode is Mode.FAULT
        assert not bench.controller.state.moving
        assert kinds(bench)[-1] is FaultEntered
        assert await foreign(bench, "MG _ZAA") == ["0.0000"]


@pytest.mark.parametrize(
    ("lying", "start", "named"),
    [
        ("b", StartPose(1.0, 1.7, 0.563), {"b"}),
        ("c", StartPose(1.0, 0.573, 1.7), {"c"}),
        ("bc", StartPose(1.0, 1.5, 1.5), {"b", "c"}),
    ],
)
async def test_of_two_lines_that_read_short_the_one_that_lies_is_named(
    lying: str, start: StartPose, named: set[str]
) -> None:
    truth = TrueConstants()
    for line in lying:
        truth = truth.with_wiring(True, axis="abc".index(line), switch="reverse")
    async with rig(truth=truth, start=start) as bench:
        with pytest.raises(WiringContradictsCn) as refusal:
            await bench.controller.home()
        assert refusal.value.details["axis"] in named
        assert refusal.value.details["side"] == "reverse"
        moved = [abs(there - here) for here, there in zip(start, bench.mechanics.true_joints(), strict=True)]
        assert max(moved) <= 0.046
        assert bench.mechanics.record.stall_time == 0.0


async def test_machine_wired_to_other_letters_homes_and_moves() -> None:
    config = parse({"axes": {"a": {"letter": "B"}, "b": {"letter": "C"}, "c": {"letter": "A"}}})
    async with rewired(config, (2, 0, 1)) as bench:
        await bench.controller.home()
        record = bench.mechanics.record
        assert (record.stall_time, record.peak_tension <= 6.0, record.peak_slack <= 0.25) == (0.0, True, True)
        target = bench.controller.mechanism.ik(bench.controller.mechanism.fk(homed_pose(config)))
        target = target._replace(a=0.5, b=1.4)
        await bench.controller.move(target)
        assert bench.mechanics.true_joints() == pytest.approx(target, abs=2e-4)
        assert bench.controller.state.joints == pytest.approx(target, abs=2e-4)
        commands = commands_in(bytes(bench.sent))
        last = [command for command in commands if command.startswith(("LM ", "LI "))]
        begun = max(place for place, command in enumerate(last) if command.startswith("LM "))
        ways = [[int(way) for way in command[3:].split("<")[0].split(",")] for command in last[begun + 1 :]]
        c, a, b = (sum(column) for column in zip(*ways, strict=True))
        assert (c, a > 0, b < 0) == (0, True, True)
