"""Stop, at any instant: at once on the wire, on the path, with an answer that is what then happens."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence

import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus
from dmc41x3.wire.transport import Transport, loopback_pair
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.seek import SETTLE
from maya_un.errors import AbortInput, NotHomed, Stopped
from maya_un.events import GripperClosed, MotionStopped
from maya_un.machine.truth import StartPose
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode, StopReport
from tests.unit.controller.bench import (
    FAR,
    HERE,
    box,
    commands_in,
    far_away,
    foreign,
    homed,
    kinds,
    now,
    record_of,
    references,
    still_moving,
    when_sent,
)
from tests.unit.dmc41x3.scripted import Peer
from tests.virtual_time import elapse

NOTHING = StopReport(False, 0.0, (0.0, 0.0, 0.0))
TWO_COUNTS = (1e-4, 2e-6, 2e-6)


async def hold_against_the_twin(
    report: StopReport, bench: Rig, motion: asyncio.Task[None], tolerances: Sequence[float], *, late: float = 5e-3
) -> None:
    """Compare an answer given now with what the twin then does, to counts and samples; see the motion end."""
    told, before = now(), references(bench)
    duration = still_moving(bench)
    assert report.was_moving is (duration > 0.0)
    assert report.duration == pytest.approx(duration, abs=late)
    await asyncio.wait({motion})
    assert isinstance(motion.exception(), Stopped)
    assert now() - told <= report.duration + SETTLE + 0.05
    for said, start, end, tolerance in zip(report.distance, before, references(bench), tolerances, strict=True):
        assert said == pytest.approx(end - start, rel=0.05 if tolerance > 1e-4 else None, abs=tolerance)


async def stopped(bench: Rig, after: float, move: asyncio.Task[None]) -> StopReport:
    """Let a motion run, stop it, and hold the answer against the twin."""
    await elapse(after)
    told = now()
    report = await bench.controller.stop()
    assert now() == told
    await hold_against_the_twin(report, bench, move, TWO_COUNTS)
    return report


@pytest.mark.parametrize("after", [0.001, 0.1, 0.44, 1.0, 3.0, 8.0, 12.5, 16.0])
@pytest.mark.parametrize(
    ("target", "speed"), [(FAR, 1.0), (FAR, 0.2), (Joints(0.3, 1.9, 1.3), 1.0), (Joints(1.5, 1.5, 1.3), 1.0)]
)
async def test_stop_in_motion_predicts_the_braking(after: float, target: Joints, speed: float) -> None:
    async with homed() as bench:
        await stopped(bench, after, asyncio.create_task(bench.controller.move(target, speed=speed)))
        assert bench.controller.state.mode is Mode.IDLE
        assert kinds(bench)[-1] is MotionStopped


@pytest.mark.parametrize("before_end", [2.0, 1.0, 0.5, 0.2, 0.05, 0.01])
async def test_stop_shortly_before_the_end_predicts_the_braking(before_end: float) -> None:
    async with homed() as bench:
        duration = bench.controller.preview([HERE, FAR]).duration - SETTLE
        await stopped(bench, duration - before_end, asyncio.create_task(bench.controller.move(FAR)))


async def test_stop_on_a_path_with_corners_predicts_the_braking() -> None:
    path = [HERE, Joints(0.4, 1.4, 1.4), Joints(0.4, 1.4, 1.6), Joints(0.3, 1.5, 1.5)]
    for after in (2.0, 5.0, 6.0, 8.5):
        async with homed() as bench:
            await stopped(bench, after, asyncio.create_task(bench.controller.follow(path)))


async def test_stop_is_predicted_by_the_configured_deceleration() -> None:
    durations: list[float] = []
    for stop in (51_200, 10_240):
        line = {"stop_deceleration_counts": stop}
        async with homed(parse({"axes": {"b": line, "c": line}})) as bench:
            move = asyncio.create_task(bench.controller.move(Joints(0.3, 1.9, 1.3)))
            durations.append((await stopped(bench, 7.0, move)).duration)
    assert durations[1] == pytest.approx(5.0 * durations[0], rel=0.01)


PHASES = [("raise", 0.3), ("datum_a", 4.0), ("datum_c", 5.0), ("datum_b", 3.0), ("stroke_c", 6.0), ("pose", 5.0)]


@pytest.mark.parametrize(("phase", "after"), PHASES)
async def test_stop_while_homing_predicts_the_braking(phase: str, after: float) -> None:
    async with rig(start=StartPose(0.4, 1.6, 1.7)) as bench:
        home = asyncio.create_task(bench.controller.home())
        while (progress := bench.controller.progress()) is None or progress.phase != phase:
            await elapse(0.05)
        await elapse(after)
        report = await bench.controller.stop()
        await hold_against_the_twin(report, bench, home, (2e-4, 2e-4, 2e-4), late=0.03)


@pytest.mark.parametrize("at", ["CS S", "LM ", "LE"])
async def test_stop_while_a_move_is_sent_prevents_it(at: str) -> None:
    async with homed() as bench:
        stops: list[asyncio.Task[StopReport]] = []
        when_sent(bench, at, lambda: stops.append(asyncio.create_task(bench.controller.stop())))
        with pytest.raises(Stopped):
            await bench.controller.move(FAR)
        assert await stops[0] == NOTHING
        assert "BGS" not in commands_in(bytes(bench.sent))
        assert bench.controller.state.mode is Mode.IDLE
        assert kinds(bench)[-1] is MotionStopped
        await bench.controller.move(FAR)


async def test_stop_at_the_start_holds_the_robot_in_place() -> None:
    async with homed() as bench:
        stops: list[asyncio.Task[StopReport]] = []
        when_sent(bench, "BGS", lambda: stops.append(asyncio.create_task(bench.controller.stop())))
        with pytest.raises(Stopped):
            await bench.controller.move(FAR)
        assert (await stops[0]).duration == 0.0
        await elapse(10.0)
        assert bench.mechanics.true_joints() == pytest.approx(HERE, abs=1e-4)
        assert bench.controller.state.mode is Mode.IDLE


@pytest.mark.parametrize("into", [0.001, SETTLE / 2])
async def test_a_stop_at_the_very_end_finds_the_robot_there(into: float) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(bench.controller.preview([HERE, FAR]).duration - SETTLE + into)
        assert await bench.controller.stop() == NOTHING
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)
        assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5)
        assert bench.controller.state.mode is Mode.IDLE


async def test_stop_while_the_gripper_settles_ends_the_command() -> None:
    async with homed() as bench:
        grip = asyncio.create_task(bench.controller.gripper(True))
        await elapse(0.2)
        assert await bench.controller.stop() == NOTHING
        await asyncio.wait({grip})
        assert isinstance(grip.exception(), Stopped)
        assert bench.controller.state.mode is Mode.IDLE
        await bench.controller.move(FAR)


async def test_a_stop_at_rest_changes_nothing_and_is_reported() -> None:
    async with homed() as bench:
        seen = len(bench.controller.events)
        del bench.sent[:]
        assert await bench.controller.stop() == NOTHING
        assert commands_in(bytes(bench.sent)) == ["ST S", "QR"]
        assert kinds(bench, seen) == [MotionStopped]
        assert bench.controller.state.mode is Mode.IDLE
        await bench.controller.move(FAR)


async def test_stop_before_homing_and_in_a_fault_is_obeyed() -> None:
    async with rig() as bench:
        assert await bench.controller.stop() == NOTHING
        await bench.controller.abort()
        assert await bench.controller.stop() == NOTHING


async def test_two_stops_are_one() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        first, again = await asyncio.gather(bench.controller.stop(), bench.controller.stop())
        assert first == again
        await elapse(0.3)
        assert (await bench.controller.stop()).was_moving
        with pytest.raises(Stopped):
            await move
        assert kinds(bench).count(MotionStopped) == 1


@pytest.mark.parametrize("stop", ["ST S", "ABC"])
async def test_stop_reaches_motion_of_another_host(stop: str) -> None:
    async with homed() as bench:
        begin = ["PRA=-9000", "BGA"] if stop == "ABC" else ["TL ,9,9", "CS S", "LM BC", "LI ,90000,-90000", "LE", "BGS"]
        await foreign(bench, "VS 20000", "VA 20480", "VD 71680", *begin)
        await elapse(3.0)
        report = await bench.controller.stop()
        assert report.was_moving
        assert report.duration == pytest.approx(still_moving(bench), abs=0.03)
        await elapse(report.duration + 0.05)
        assert still_moving(bench) == 0.0
        assert kinds(bench)[-1] is MotionStopped


async def test_a_refused_stop_of_the_sequence_does_not_spare_axes_that_move_alone() -> None:
    still = AxisRecord(velocity_raw=-64)  # readings of a trembling encoder
    alone = record_of(AxisRecord(status=AxisStatus.MOVING, velocity_raw=64 * 1_024), AxisRecord(), still)
    known = box(Config())
    answers = {"QR": alone.encode() + b":", "ST S": b"?", "TC1": b"28 S operand\r\n:"}
    ours, theirs = loopback_pair("box")
    peer = Peer(theirs, lambda command: answers.get(command) or known(command))
    serving = asyncio.create_task(peer.run())

    async def dial() -> Transport:
        return ours

    controller = GalilController(dial, "box", Config(), live=False)
    await controller.open()
    report = await controller.stop()
    await controller.close()
    await serving
    assert "STA" in peer.commands
    assert (report.was_moving, report.duration) == (True, pytest.approx(0.1))
    assert str(report.distance[1:]) == "(0.0, 0.0)"  # and not -0.0


async def test_a_stop_is_the_first_thing_on_the_wire() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.003)  # between two beats
        del bench.sent[:]
        stop = asyncio.create_task(bench.controller.stop())
        await elapse(0.0)
        assert commands_in(bytes(bench.sent))[0] == "ST S"
        await stop
        with pytest.raises(Stopped):
            await move


async def by_stop(bench: Rig) -> None:
    await bench.controller.stop()


async def by_abort_input(bench: Rig) -> None:
    bench.virtual.abort_input(True)


@pytest.mark.parametrize(
    ("first", "second", "error"), [(by_stop, by_abort_input, Stopped), (by_abort_input, by_stop, AbortInput)]
)
async def test_first_interruption_ends_the_command(
    first: Callable[[Rig], Awaitable[None]], second: Callable[[Rig], Awaitable[None]], error: type[Exception]
) -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await first(bench)
        await elapse(0.06)
        await second(bench)
        await asyncio.wait({move})
        assert isinstance(move.exception(), error)
        await elapse(1.0)
        assert bench.controller.state.mode is Mode.FAULT


async def test_any_end_of_a_motion_leaves_no_axis_moving() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        command = bench.controller._monitor.slot.current
        assert command is not None
        command.interrupt(NotHomed(command="maya home"))  # no error of the machine, as a defect of ours would be none
        with pytest.raises(NotHomed):
            await move
        assert still_moving(bench) == 0.0


@pytest.mark.parametrize("before_end", [0.005, 0.015, 0.025])
async def test_a_stop_during_the_last_look_at_a_motion_is_not_lost(before_end: float) -> None:
    async with far_away(latency=0.03, rate=20.0) as bench:
        controller = bench.controller
        there = HERE._replace(b=HERE.b + 0.01)
        begun = now()
        await controller.move(there)
        took = now() - begun
        back = asyncio.create_task(controller.move(HERE))
        await elapse(took - before_end)
        assert controller.progress() is not None
        await controller.stop()
        with pytest.raises(Stopped):
            await back
        assert controller.state.mode is Mode.IDLE


async def test_a_stop_during_the_last_look_at_the_gripper_is_not_lost() -> None:
    async with far_away(latency=0.03, rate=20.0) as bench:
        controller = bench.controller
        begun = now()
        await controller.gripper(True)
        took = now() - begun
        closing = asyncio.create_task(controller.gripper(False))
        await elapse(took - 0.015)
        await controller.stop()
        with pytest.raises(Stopped):
            await closing
        assert kinds(bench)[-1] is GripperClosed  # it has moved, whatever was reported


async def test_after_a_stop_the_state_is_the_rest_position() -> None:
    """The next plan begins there: the encoders follow the reference by a few hundredths of a second."""
    hard = {"stop_deceleration_counts": 80_000_000, "limit_deceleration_counts": 80_000_000}
    async with rig(parse({"axes": {"a": hard, "b": hard, "c": hard}})) as bench:
        await bench.controller.home()
        move = asyncio.create_task(bench.controller.move(Joints(1.0, 1.2, 1.9)))
        await elapse(9.0)
        await bench.controller.stop()
        with pytest.raises(Stopped):
            await move
        here = bench.controller.state.joints
        assert here is not None
        await elapse(1.0)
        await bench.controller.gripper(open_=True)  # it looks
        assert bench.controller.state.joints == here
