"""The protocol of a controller, checked on the controller itself and on one on the other side of a graph."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import NamedTuple

import pytest

from maya_ros.graph.bus import Bus
from maya_un.controller.protocol import Controller
from maya_un.errors import (
    AbortInput,
    Busy,
    CannotPause,
    Faulted,
    InvalidValue,
    MayaError,
    NothingToRecover,
    NotHomed,
    NotPaused,
    Stopped,
    TrajectoryRefused,
    UnknownName,
    Unreachable,
)
from maya_un.events import (
    EmergencyStopped,
    Event,
    FaultEntered,
    HomingBegun,
    HomingDone,
    MotionBegun,
    MotionEnded,
    MotionStopped,
    PhaseBegun,
)
from maya_un.motion.path import Path
from maya_un.testing import faults
from maya_un.testing.rig import Rig
from maya_un.values import JogDirection, Joints, Mode, Point
from tests.calm import CALM
from tests.graphs import bench_of, controller_node, seen_from
from tests.unit.controller.bench import FAR, HERE
from tests.virtual_time import elapse

WHERE = ("here", "over a graph")


class Held(NamedTuple):
    """A controller, and the machine behind it."""

    controller: Controller
    rig: Rig

    @property
    def exact(self) -> Joints | None:
        """Positions of the axes by their encoders."""
        return self.rig.controller.state.joints


@asynccontextmanager
async def held(where: str, *, homed: bool = True) -> AsyncIterator[Held]:
    if where == "here":
        async with bench_of(CALM, homed=homed) as bench:
            yield Held(bench.controller, bench)
    else:
        bus = Bus()
        async with controller_node(bus, homed=homed) as low, seen_from(bus, "robot_controller") as (_, controller):
            yield Held(controller, low.rig)


async def ends(command: Awaitable[object]) -> MayaError:
    with pytest.raises(MayaError) as raised:
        await command
    return raised.value


def kinds(held: Held, since: int = 0) -> list[type[Event]]:
    return [type(event) for event in held.controller.events.since(since)]


REFUSALS: dict[str, tuple[Callable[[Controller], Awaitable[object]], type[MayaError]]] = {
    "a line too long": (lambda c: c.move(Joints(0.3, 3.0, 1.3)), Unreachable),
    "no number": (lambda c: c.follow([HERE, Joints(float("nan"), 1.5, 1.3)]), InvalidValue),
    "from elsewhere": (lambda c: c.follow([Joints(0.5, 1.5, 1.3), FAR]), TrajectoryRefused),
    "one point": (lambda c: c.follow([HERE]), TrajectoryRefused),
    "out of reach": (lambda c: c.follow(_line(c, Point(0.3, 1.0, 2.3))), Unreachable),
    "no axis": (lambda c: c.jog("q", 0.1), UnknownName),
    "too far": (lambda c: c.jog("z", 3.0), MayaError),
    "no speed": (lambda c: c.move(FAR, speed=0.0), InvalidValue),
    "too fast": (lambda c: c.override(1.5), InvalidValue),
    "nothing to recover": (lambda c: c.recover(), NothingToRecover),
    "nothing paused": (lambda c: c.resume(), NotPaused),
    "nothing to pause": (lambda c: c.pause(), CannotPause),
}


def _line(controller: Controller, target: Point) -> Path:
    return Path.line(controller.mechanism.fk(HERE), target)


@pytest.mark.parametrize("what", REFUSALS)
async def test_refusal_has_the_same_code_and_words_everywhere(what: str) -> None:
    command, error = REFUSALS[what]
    said: list[tuple[int, str]] = []
    for where in WHERE:
        async with held(where) as robot:
            before = robot.exact
            refused = await ends(command(robot.controller))
            assert isinstance(refused, error)
            assert robot.exact == before
            assert robot.controller.state.mode is Mode.IDLE
            said.append((refused.code, str(refused)))
    assert said[0] == said[1]


@pytest.mark.parametrize("where", WHERE)
async def test_before_homing_motion_is_refused_and_the_gripper_is_not(where: str) -> None:
    async with held(where, homed=False) as robot:
        assert robot.controller.state.mode is Mode.NOT_HOMED
        assert isinstance(await ends(robot.controller.move(FAR)), NotHomed)
        assert isinstance(await ends(robot.controller.jog("a", 0.1)), NotHomed)
        await robot.controller.gripper(open_=True)
        assert not robot.controller.state.gripper_closed
        await robot.controller.gripper(open_=False)
        assert robot.controller.state.gripper_closed


@pytest.mark.parametrize("where", WHERE)
async def test_homing_finds_the_lengths_and_measures_the_strokes(where: str) -> None:
    async with held(where, homed=False) as robot:
        wide = robot.controller.workspace
        await robot.controller.home()
        state, workspace = robot.controller.state, robot.controller.workspace
        assert (state.mode, state.homed, state.joints) == (Mode.IDLE, True, robot.exact)
        assert workspace != wide
        assert workspace == robot.rig.controller.workspace
        told = kinds(robot)
        assert told.index(HomingBegun) < told.index(PhaseBegun) < told.index(HomingDone)


@pytest.mark.parametrize("where", WHERE)
async def test_motion_ends_at_the_previewed_place_in_its_time(where: str) -> None:
    async with held(where) as robot:
        preview = robot.controller.preview([HERE, FAR])
        began = asyncio.get_running_loop().time()
        await robot.controller.move(FAR)
        assert robot.controller.state.joints == robot.exact == preview.end
        assert asyncio.get_running_loop().time() - began == pytest.approx(preview.duration, abs=0.8)
        assert kinds(robot)[-2:] == [MotionBegun, MotionEnded]
        assert robot.controller.progress() is None


@pytest.mark.parametrize("where", WHERE)
async def test_half_the_speed_takes_the_time_of_half_the_speed(where: str) -> None:
    async with held(where) as robot:
        preview = robot.controller.preview([HERE, FAR], speed=0.5)
        began = asyncio.get_running_loop().time()
        await robot.controller.move(FAR, speed=0.5)
        assert asyncio.get_running_loop().time() - began == pytest.approx(preview.duration, rel=0.01, abs=0.8)


@pytest.mark.parametrize("axis", ["z", (0.0, 0.0, 1.0)])
@pytest.mark.parametrize("where", WHERE)
async def test_jog_goes_to_the_edge_of_the_workspace_and_names_the_limit(where: str, axis: JogDirection) -> None:
    async with held(where) as robot:
        gone = await robot.controller.jog(axis, 3.0, clip=True)
        assert gone.limit
        assert 0.0 < gone.distance < 3.0
        point = robot.controller.state.point
        assert point is not None
        assert point.z - robot.controller.mechanism.fk(HERE).z == pytest.approx(gone.distance, abs=1e-4)


@pytest.mark.parametrize("where", WHERE)
async def test_waypoints_are_reported_as_passed_also_when_the_speed_changes(where: str) -> None:
    """Compared with where the robot is at that instant: a graph is late by as long as its feedback is apart."""
    async with held(where) as robot:
        here = robot.controller.mechanism.fk(HERE)
        corners = [here, here._replace(z=here.z + 0.1), here._replace(z=here.z - 0.1), here._replace(z=here.z + 0.2)]
        passed: list[tuple[int, float]] = []

        def on_via(via: int) -> None:
            state = robot.rig.controller.state
            assert state.joints is not None
            passed.append((via, robot.controller.mechanism.fk(state.joints).z - corners[via + 1].z))

        motion = asyncio.ensure_future(robot.controller.follow(Path.line(*corners), on_via=on_via))
        await elapse(1.5)
        await robot.controller.override(0.25)
        await elapse(3.0)
        await robot.controller.pause()
        await elapse(20.0)
        assert len(passed) < 2
        await robot.controller.resume()
        await motion
        assert [via for via, _ in passed] == [0, 1]
        assert all(abs(away) < 0.02 for _, away in passed), passed


@pytest.mark.parametrize("where", WHERE)
async def test_stop_ends_a_motion_on_its_path_with_an_answer(where: str) -> None:
    async with held(where) as robot:
        motion = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(10.0)
        report = await robot.controller.stop()
        assert report.was_moving
        assert 0.0 < report.duration < 2.0
        assert isinstance(await ends(motion), Stopped)
        assert robot.controller.state.joints == robot.exact != HERE
        assert not robot.rig.controller.state.moving
        assert kinds(robot)[-1] is MotionStopped
        assert robot.controller.state.mode is Mode.IDLE
        await robot.controller.move(HERE)
        assert not (await robot.controller.stop()).was_moving


@pytest.mark.parametrize("where", WHERE)
async def test_cancel_returns_with_the_robot_at_rest(where: str) -> None:
    async with held(where) as robot:
        motion = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(10.0)
        motion.cancel()
        await asyncio.wait({motion})
        assert motion.cancelled()
        assert not robot.rig.controller.state.moving
        assert robot.controller.state.mode is Mode.IDLE
        assert robot.controller.state.joints == robot.exact != HERE


@pytest.mark.parametrize("where", WHERE)
async def test_second_command_is_refused_and_the_first_unharmed(where: str) -> None:
    async with held(where) as robot:
        first = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(5.0)
        assert isinstance(await ends(robot.controller.move(HERE)), Busy)
        assert isinstance(await ends(robot.controller.home()), Busy)
        assert isinstance(await ends(robot.controller.gripper(open_=True)), Busy)
        await first
        assert robot.controller.state.joints == robot.exact == robot.controller.preview([HERE, FAR]).end


@pytest.mark.parametrize("where", WHERE)
async def test_pause_holds_the_motion_until_resume(where: str) -> None:
    async with held(where) as robot:
        motion = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(10.0)
        report = await robot.controller.pause()
        assert report.was_moving
        await elapse(5.0)
        stands = robot.exact
        assert robot.controller.state.mode is Mode.PAUSED
        await elapse(60.0)
        assert robot.exact == stands
        await robot.controller.resume()
        assert robot.controller.state.mode is Mode.MOVING
        await motion
        assert robot.exact == robot.controller.preview([HERE, FAR]).end


@pytest.mark.parametrize("where", WHERE)
async def test_pause_in_advance_holds_the_next_motion(where: str) -> None:
    async with held(where) as robot:
        pausing = asyncio.ensure_future(robot.controller.pause(ahead=True))
        await elapse(0.3)
        motion = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(5.0)
        await pausing
        stands = robot.exact
        await elapse(30.0)
        assert robot.exact == stands
        await robot.controller.resume()
        await motion


@pytest.mark.parametrize("where", WHERE)
async def test_a_homing_is_not_paused_but_stopped(where: str) -> None:
    async with held(where, homed=False) as robot:
        homing = asyncio.ensure_future(robot.controller.home())
        await elapse(20.0)
        assert isinstance(await ends(robot.controller.pause(ahead=True)), CannotPause)
        await robot.controller.stop()
        assert isinstance(await ends(homing), Stopped)
        assert robot.controller.state.mode is Mode.NOT_HOMED
        assert not robot.rig.controller.state.moving


@pytest.mark.parametrize("where", WHERE)
async def test_a_fault_is_raised_kept_and_recovered_from(where: str) -> None:
    async with held(where) as robot:
        motion = asyncio.ensure_future(robot.controller.move(FAR))
        await elapse(10.0)
        with faults.abort_input(robot.rig.virtual):
            raised = await ends(motion)
            assert isinstance(raised, AbortInput)
            state = robot.controller.state
            assert state.mode is Mode.FAULT
            assert state.fault is not None
            assert (state.fault.code, state.fault.message) == (raised.code, str(raised))
            assert isinstance(await ends(robot.controller.move(FAR)), Faulted)
            assert isinstance(await ends(robot.controller.recover()), AbortInput)
        await robot.controller.recover()
        assert robot.controller.state.mode in {Mode.IDLE, Mode.NOT_HOMED}
        assert robot.controller.state.fault is None
        assert EmergencyStopped in kinds(robot) or FaultEntered in kinds(robot)


@pytest.mark.parametrize("where", WHERE)
async def test_watcher_sees_the_motion(where: str) -> None:
    async with held(where) as robot:
        seen: list[Mode] = []

        async def watch() -> None:
            async for state in robot.controller.watch():
                if not seen or seen[-1] is not state.mode:
                    seen.append(state.mode)

        watching = asyncio.ensure_future(watch())
        await robot.controller.move(Joints(0.4, 1.5, 1.3))
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
        assert seen[0] is Mode.IDLE
        assert Mode.MOVING in seen
