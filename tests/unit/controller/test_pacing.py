"""Speed override, pause and resume: motion of the twin, reports, and ends of a pause."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from random import Random

import pytest

from maya_un.config.files import parse
from maya_un.controller.seek import SETTLE
from maya_un.errors import (
    AbortInput,
    CannotPause,
    Faulted,
    GuardNotRunning,
    InvalidValue,
    LinkLost,
    MayaError,
    NotPaused,
    Stopped,
    Unreachable,
)
from maya_un.events import (
    GripperOpened,
    HomingDone,
    MotionBegun,
    MotionEnded,
    MotionPaused,
    MotionResumed,
    OutputSet,
    SpeedChanged,
)
from maya_un.machine.truth import StartPose
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode
from tests.campaign import Campaign
from tests.unit.controller.bench import (
    FAR,
    HERE,
    commands_in,
    foreign,
    homed,
    kinds,
    now,
    references,
    still_moving,
    when_sent,
)
from tests.virtual_time import elapse

COUNT = (1e-4, 2e-6, 2e-6)
"""A little more than a count of every axis."""


def places(bench: Rig) -> tuple[float, float, float]:
    """Return where the twin's references are now (rad, m, m); its timelines count from where it powered up."""
    a, b, c = (start + way for start, way in zip(HERE, references(bench), strict=True))
    return a, b, c


async def heeded() -> None:
    """Let the twin take over a speed ratio, which it does from its next sample on."""
    await elapse(0.002)


def duration_of(bench: Rig, target: Joints = FAR) -> float:
    """Return how long the move from `HERE` takes [s]."""
    return bench.controller.preview([HERE, target]).duration - SETTLE


@asynccontextmanager
async def paused(bench: Rig, after: float) -> AsyncIterator[asyncio.Task[None]]:
    """Let a move to `FAR` run and pause it; it stands when the block begins, and is over when it ends."""
    move = asyncio.create_task(bench.controller.move(FAR))
    await elapse(after)
    report = await bench.controller.pause()
    await elapse(report.duration + 0.01)
    yield move
    if not move.done():
        await bench.controller.stop()
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)


@pytest.mark.parametrize("after", [0.001, 0.4, 1.0, 8.0, 12.5, 16.0, 22.0])
async def test_pause_and_resume_agree_with_their_predictions(after: float) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(after)
        before = places(bench)
        report = await bench.controller.pause()
        assert bench.controller.state.mode is Mode.PAUSED
        await elapse(report.duration + 0.002)
        stands = places(bench)
        await elapse(100.0)
        assert places(bench) == stands
        for said, start, end, tolerance in zip(report.distance, before, stands, COUNT, strict=True):
            assert said == pytest.approx(end - start, abs=tolerance)
        await bench.controller.resume()
        assert bench.controller.state.mode is Mode.MOVING
        await heeded()
        left = still_moving(bench)
        progress = bench.controller.progress()
        assert progress is not None
        assert progress.duration - progress.elapsed == pytest.approx(left, abs=1e-3)
        begun = now()
        await move
        assert now() - begun == pytest.approx(left + SETTLE, abs=0.02)
        assert places(bench) == pytest.approx(FAR, abs=5e-5)
        assert kinds(bench)[-5:] == [HomingDone, MotionBegun, MotionPaused, MotionResumed, MotionEnded]


async def test_a_pause_leaves_the_straight_line_by_no_count() -> None:
    async with homed() as bench, paused(bench, 9.0):
        a, b, c = places(bench)
        share = (b - HERE.b) / (FAR.b - HERE.b)
        assert 0.05 < share < 0.95
        assert (a, c) == pytest.approx((HERE.a + share * (FAR.a - HERE.a), HERE.c + share * (FAR.c - HERE.c)), abs=1e-4)


@pytest.mark.parametrize("ratio", [0.5, 0.3, 0.07])
async def test_override_in_motion_moves_the_end_as_predicted(ratio: float) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(6.0)
        await bench.controller.override(ratio)
        assert bench.controller.state.override == ratio
        await heeded()
        left = still_moving(bench)
        assert left > 1.5 * (duration_of(bench) - 6.0)
        progress = bench.controller.progress()
        assert progress is not None
        assert progress.duration - progress.elapsed == pytest.approx(left, abs=5e-3)
        begun = now()
        await move
        assert now() - begun == pytest.approx(left + SETTLE, abs=0.02)
        assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5)


async def test_an_override_holds_for_later_motions_until_it_is_changed() -> None:
    async with homed() as bench:
        plain = duration_of(bench)
        await bench.controller.override(0.5)
        assert kinds(bench)[-1] is SpeedChanged
        times: list[float] = []
        for target in (FAR, HERE):
            begun = now()
            await bench.controller.move(target)
            times.append(now() - begun)
            await bench.controller.override(1.0)
        assert times[0] > 1.5 * plain
        assert times[1] == pytest.approx(plain, rel=0.05)
        assert [command for command in commands_in(bytes(bench.sent)) if command[:2] == "VR"] == ["VR 0.5", "VR 1"]


async def test_an_override_while_paused_is_that_of_resume() -> None:
    async with homed() as bench, paused(bench, 8.0) as move:
        del bench.sent[:]
        await bench.controller.override(0.25)
        assert commands_in(bytes(bench.sent))[0] == "VR 0"
        await heeded()
        assert still_moving(bench) == float("inf")
        progress = bench.controller.progress()
        await bench.controller.resume()
        await heeded()
        assert progress is not None
        assert progress.duration - progress.elapsed == pytest.approx(still_moving(bench), abs=5e-3)
        await move
        assert bench.controller.state.override == 0.25


async def changed(bench: Rig, rng: Random) -> None:
    """Resume what is paused; pause the rest, or give it another speed."""
    if bench.controller.state.mode is Mode.PAUSED:
        await bench.controller.resume()
    elif rng.random() < 0.5:
        await bench.controller.pause()
    else:
        await bench.controller.override(rng.uniform(0.1, 1.0))


async def test_random_changes_at_random_instants_are_predicted(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=25, long=500)):
        rng = campaign.rng(case)
        async with homed() as bench:
            move = asyncio.create_task(bench.controller.move(FAR))
            for _ in range(rng.randint(1, 6)):
                await elapse(rng.uniform(0.0, 8.0))
                if move.done():
                    break
                await changed(bench, rng)
            if not move.done() and bench.controller.state.mode is Mode.PAUSED:
                await bench.controller.resume()
            await heeded()
            left, begun = still_moving(bench), now()
            await move
            assert now() - begun <= left + SETTLE + 0.05, f"case {case}"
            assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5), f"case {case}"


@pytest.mark.parametrize("before_end", [1.0, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-6, 0.0, -0.02])
@pytest.mark.parametrize("then", ["pause", "override"])
async def test_a_change_in_the_last_instants_is_harmless(before_end: float, then: str) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(duration_of(bench) - before_end)
        await (bench.controller.pause() if then == "pause" else bench.controller.override(0.01))
        await elapse(1.0)
        if bench.controller.state.mode is Mode.PAUSED:
            await bench.controller.resume()
        await move
        assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5)
        assert bench.controller.state.mode is Mode.IDLE


async def test_motion_paused_at_its_end_ends_while_later_motion_is_held() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(duration_of(bench) + SETTLE / 2)
        await bench.controller.pause()
        await move
        assert bench.controller.state.mode is Mode.PAUSED
        back = asyncio.create_task(bench.controller.move(HERE))
        await elapse(60.0)
        assert places(bench) == pytest.approx(FAR, abs=5e-5)
        await bench.controller.resume()
        await back
        assert bench.controller.state.joints == pytest.approx(HERE, abs=5e-5)


@pytest.mark.parametrize("after", [0.3, 8.0])
async def test_a_stop_in_a_pause_ends_the_motion_and_nothing_resumes(after: float) -> None:
    async with homed() as bench, paused(bench, after) as move:
        stands = places(bench)
        report = await bench.controller.stop()
        assert (report.duration, report.distance) == (0.0, (0.0, 0.0, 0.0))
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)
        assert bench.controller.state.mode is Mode.IDLE
        with pytest.raises(NotPaused):
            await bench.controller.resume()
        await elapse(10.0)
        assert places(bench) == pytest.approx(stands, abs=1e-4)
        await bench.controller.move(HERE)


@pytest.mark.parametrize("into", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("change", ["pause", "resume", "slow", "fast"])
async def test_stop_during_a_speed_change_predicts_the_braking(change: str, into: float) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        if change == "fast":
            await bench.controller.override(0.2)
        await elapse(9.0)
        if change in ("pause", "resume"):
            await bench.controller.pause()
        else:
            await bench.controller.override(0.3 if change == "slow" else 1.0)
        if change == "resume":
            await elapse(2.0)
            await bench.controller.resume()
        await elapse(into)
        before = places(bench)
        report = await bench.controller.stop()
        assert report.duration == pytest.approx(still_moving(bench), abs=5e-3)
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)
        for said, start, end, tolerance in zip(report.distance, before, places(bench), COUNT, strict=True):
            assert said == pytest.approx(end - start, abs=tolerance)


async def test_pausing_twice_is_pausing_once() -> None:
    async with homed() as bench, paused(bench, 8.0):
        seen, sent = len(bench.controller.events), len(bench.sent)
        assert not (await bench.controller.pause()).was_moving
        assert (kinds(bench, seen), len(bench.sent)) == ([], sent)


async def test_nothing_under_way_is_not_paused_unless_something_is_ahead() -> None:
    async with homed() as bench:
        with pytest.raises(CannotPause):
            await bench.controller.pause()
        with pytest.raises(NotPaused):
            await bench.controller.resume()
        assert bench.controller.state.mode is Mode.IDLE
        await bench.controller.pause(ahead=True)
        assert bench.controller.state.mode is Mode.PAUSED
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(20.0)
        assert (still_moving(bench), move.done()) == (0.0, False)
        await bench.controller.resume()
        await move


async def test_a_refusal_does_not_wait_for_resume() -> None:
    async with homed() as bench:
        await bench.controller.pause(ahead=True)
        with pytest.raises(Unreachable):
            await bench.controller.move(Joints(0.3, 1.0, 0.2))
        assert bench.controller.state.mode is Mode.PAUSED


async def test_gripper_moves_on_and_later_motion_is_held() -> None:
    async with homed() as bench:
        grip = asyncio.create_task(bench.controller.gripper(False))
        await elapse(0.1)
        await bench.controller.pause()
        await grip
        assert bench.controller.state.gripper_closed
        assert bench.controller.state.mode is Mode.PAUSED


@pytest.mark.parametrize("at", ["CS S", "LE"])
@pytest.mark.parametrize("change", ["pause", "override"])
async def test_a_change_while_a_move_is_sent_is_heeded(at: str, change: str) -> None:
    async with homed() as bench:
        tasks: list[asyncio.Task[object]] = []

        async def do() -> None:
            await (bench.controller.pause() if change == "pause" else bench.controller.override(0.5))

        when_sent(bench, at, lambda: tasks.append(asyncio.create_task(do())))
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        if change == "pause":
            assert still_moving(bench) == 0.0
            assert places(bench) == pytest.approx(HERE, abs=1e-4)
            await bench.controller.resume()
        begun, left = now(), still_moving(bench)
        await move
        assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5)
        if change == "override":
            assert now() - begun == pytest.approx(left + SETTLE, abs=0.02)
            assert "VR 0.5" in commands_in(bytes(bench.sent))


@pytest.mark.parametrize("ratio", [0.0, -1.0, 0.009, 1.0001, float("nan"), float("inf")])
async def test_ratios_out_of_range_are_refused(ratio: float) -> None:
    async with homed() as bench:
        with pytest.raises(InvalidValue):
            await bench.controller.override(ratio)
        assert bench.controller.state.override == 1.0


async def test_a_homing_is_not_paused_and_keeps_its_speeds() -> None:
    async with rig(start=StartPose(0.4, 1.6, 1.7)) as bench:
        home = asyncio.create_task(bench.controller.home())
        await elapse(3.0)
        with pytest.raises(CannotPause):
            await bench.controller.pause()
        await bench.controller.override(0.5)
        await home
        assert "VR 0.5" not in commands_in(bytes(bench.sent))
        assert bench.controller.state.mode is Mode.IDLE


async def test_homing_requested_in_a_pause_is_held() -> None:
    async with homed() as bench:
        await bench.controller.pause(ahead=True)
        home = asyncio.create_task(bench.controller.home())
        await elapse(30.0)
        assert still_moving(bench) == 0.0
        assert bench.controller.state.homed
        await bench.controller.stop()
        await asyncio.wait({home})
        assert isinstance(home.exception(), Stopped)


async def test_a_cancel_in_a_pause_ends_the_motion_and_holds_the_next() -> None:
    async with homed() as bench, paused(bench, 8.0) as move:
        move.cancel()
        await asyncio.wait({move})
        assert move.cancelled()
        assert bench.controller.state.mode is Mode.PAUSED
        stands = places(bench)
        back = asyncio.create_task(bench.controller.move(HERE))
        await elapse(10.0)
        assert places(bench) == stands
        await bench.controller.resume()
        await back


async def by_abort_input(bench: Rig) -> None:
    bench.virtual.abort_input(True)


async def by_foreign_stop(bench: Rig) -> None:
    await foreign(bench, "ST S")


@pytest.mark.parametrize(("cause", "error"), [(by_abort_input, AbortInput), (by_foreign_stop, Stopped)])
async def test_fault_of_a_paused_motion_ends_it_and_the_pause(
    cause: Callable[[Rig], Awaitable[None]], error: type[MayaError]
) -> None:
    async with homed(live=True) as bench, paused(bench, 8.0) as move:
        await cause(bench)
        await asyncio.wait({move}, timeout=1.0)
        assert isinstance(move.exception(), error)
        assert bench.controller.state.mode is (Mode.FAULT if error is AbortInput else Mode.IDLE)
        with pytest.raises(NotPaused):
            await bench.controller.resume()
        if error is AbortInput:
            with pytest.raises(Faulted):
                await bench.controller.pause(ahead=True)


async def test_a_pause_outlasts_everything_but_no_lost_link() -> None:
    async with homed(parse({"safety": {"guard_time": 0.5}}), live=True) as bench, paused(bench, 8.0) as move:
        stands = places(bench)
        await elapse(30.0)
        assert not move.done()
        assert bench.controller.state.mode is Mode.PAUSED
        bench.virtual.cut()
        await asyncio.wait({move}, timeout=1.0)
        assert isinstance(move.exception(), LinkLost)
        await elapse(5.0)
        assert places(bench) == pytest.approx(stands, abs=1e-4)
        with pytest.raises(NotPaused):
            await bench.controller.resume()
        await bench.controller.recover()
        await elapse(5.0)
        assert places(bench) == pytest.approx(stands, abs=1e-4)
        await bench.controller.move(HERE)


async def test_a_guarded_move_is_not_paused_and_stops_when_asked() -> None:
    async with rig() as bench:
        move = asyncio.create_task(bench.controller.guarded_move("b", 0.05))
        await elapse(3.0)
        for ahead in (False, True):
            with pytest.raises(CannotPause, match="guarded move"):
                await bench.controller.pause(ahead=ahead)
        assert bench.controller.state.mode is not Mode.PAUSED
        stop = asyncio.create_task(bench.controller.stop())
        await elapse(0.01)
        assert bench.controller.state.mode is Mode.STOPPING
        await stop
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)
        assert bench.controller.state.mode is Mode.NOT_HOMED


@pytest.mark.parametrize("move", ["home", "guarded move"])
async def test_no_pause_comes_between_the_beginning_of_a_homing_and_its_first_motion(move: str) -> None:
    async with rig() as bench:
        refused: list[MayaError | None] = []

        async def pause() -> None:
            try:
                await bench.controller.pause()
            except CannotPause as refusal:
                refused.append(refusal)

        when_sent(bench, "SH", lambda: asyncio.create_task(pause()))
        work = bench.controller.home() if move == "home" else bench.controller.guarded_move("b", 0.01)
        task = asyncio.create_task(work)
        await elapse(1.0)
        assert len(refused) == 1
        assert bench.controller.state.mode is not Mode.PAUSED
        await bench.controller.stop()
        with pytest.raises(Stopped):
            await task


async def test_guarded_move_requested_in_a_pause_is_held() -> None:
    async with rig() as bench:
        await bench.controller.pause(ahead=True)
        move = asyncio.create_task(bench.controller.guarded_move("b", 0.01))
        await elapse(10.0)
        assert (still_moving(bench), move.done()) == (0.0, False)
        await bench.controller.resume()
        assert (await move).distance == pytest.approx(0.01, abs=1e-4)


async def test_homing_held_by_a_pause_does_not_begin_when_a_fault_ends_the_pause() -> None:
    async with homed() as bench:
        await bench.controller.pause(ahead=True)
        home = asyncio.create_task(bench.controller.home())
        await elapse(1.0)
        monitor = bench.controller._monitor
        monitor.fail(GuardNotRunning(), monitor.link.driver)  # as a refused torque of rest does: it interrupts nothing
        with pytest.raises(Faulted):
            await home
        assert bench.controller.state.homed
        assert still_moving(bench) == 0.0


@pytest.mark.parametrize("what", ["gripper", "output"])
@pytest.mark.parametrize("end", ["resume", "stop"])
async def test_gripper_and_outputs_wait_for_the_end_of_a_pause(what: str, end: str) -> None:
    async with homed(parse({"controller": {"outputs": [2]}})) as bench:
        await bench.controller.pause(ahead=True)
        seen = len(bench.controller.events)
        del bench.sent[:]
        work = bench.controller.gripper(True) if what == "gripper" else bench.controller.output(2, on=True)
        task = asyncio.create_task(work)
        await elapse(20.0)
        assert (kinds(bench, seen), bytes(bench.sent), task.done()) == ([], b"", False)
        assert bench.controller.state.gripper_closed
        if end == "resume":
            await bench.controller.resume()
            await task
            assert kinds(bench)[-1] is (GripperOpened if what == "gripper" else OutputSet)
        else:
            await bench.controller.stop()
            with pytest.raises(Stopped):
                await task
            assert not {GripperOpened, OutputSet} & set(kinds(bench, seen))
