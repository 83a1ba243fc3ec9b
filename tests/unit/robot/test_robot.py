from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import product, starmap
from math import hypot
from typing import cast

import pytest

from maya_un.errors import (
    Busy,
    Faulted,
    FollowingError,
    GripperEmpty,
    GripperNotEmpty,
    MayaError,
    NotConnected,
    NotHomed,
    PathRefused,
    Stopped,
    Unreachable,
)
from maya_un.events import PhaseBegun
from maya_un.kinematics import Box
from maya_un.kinematics.workspace import Workspace
from maya_un.motion import Path, Space, between
from maya_un.robot.plan_builder import Pose
from maya_un.robot.primitives import Approach, CanTeleop, Gripper, Home, MoveJoints, Pick, Place, Primitive
from maya_un.robot.primitives.line import Line
from maya_un.robot.robot import MayaRobot, Plans
from maya_un.values import FARTHEST, GripperState, Joints, Mode, Point
from maya_un.workers import Workers, WorkResult
from tests.campaign import Campaign
from tests.fakes import HOMING_TIME, FakeController, state_of
from tests.virtual_time import elapse

HERE = Point(0.50, 1.10, 0.40)
THERE = Point(1.10, 0.50, 0.40)
COUNT = 5e-5
"""One count of the boom at its end [m] or in itself [rad]."""

START = Joints(0.5, 1.5, 1.5)
NOWHERE = Point(3.0, 3.0, 0.40)


def made(*, homed: bool = True, closed: bool = False) -> tuple[FakeController, MayaRobot]:
    controller = FakeController(homed=homed, closed=closed)
    return controller, MayaRobot(controller, controller.config)


EXTREMES = (FARTHEST, -FARTHEST, 1e-320, 0.0, 1.0)
"""Coordinates, the greatest and the least that are read."""


@pytest.mark.parametrize("skill", [Pick, Place, Approach, Line, lambda target: MoveJoints(Joints(*target))])
async def test_every_command_is_planned_or_refused_in_a_short_sentence(
    skill: Callable[[Point], Primitive],
) -> None:
    _, robot = made()
    for target in starmap(Point, product(EXTREMES, repeat=3)):
        try:
            robot.preview(skill(target), Pose(START, GripperState.OPEN))
        except MayaError as refused:
            assert len(str(refused)) < 300, target


async def test_pick_approaches_from_above_goes_down_closes_and_lifts() -> None:
    controller, robot = made()
    phases: list[str] = []
    await robot.run(Pick(HERE), phases.append)
    assert phases == ["approach", "down", "close", "up"]
    assert controller.names() == ["follow", "gripper", "follow"]
    assert controller.state.point == pytest.approx(HERE._replace(z=0.50), abs=COUNT)
    assert controller.state.gripper_closed


async def test_a_pick_opens_a_gripper_that_is_not_open_before_it_sets_out() -> None:
    controller, robot = made(closed=True)
    await robot.run(Home())
    controller.calls.clear()
    phases: list[str] = []
    await robot.run(Pick(HERE), phases.append)
    assert phases == ["open", "approach", "down", "close", "up"]
    assert controller.names() == ["gripper", "follow", "gripper", "follow"]


async def test_place_approaches_from_above_goes_down_opens_and_lifts() -> None:
    controller, robot = made(closed=True)
    phases: list[str] = []
    await robot.run(Place(THERE), phases.append)
    assert phases == ["approach", "down", "open", "up"]
    assert not controller.state.gripper_closed
    assert controller.state.point == pytest.approx(THERE._replace(z=0.50), abs=COUNT)


async def test_approach_waits_the_clearance_above() -> None:
    controller, robot = made()
    await robot.run(Approach(HERE))
    assert controller.state.point == pytest.approx(HERE._replace(z=0.50), abs=COUNT)


async def test_every_phase_is_an_event() -> None:
    controller, robot = made()
    await robot.run(Pick(HERE))
    phases = [event.detail["name"] for event in controller.events.since(0) if isinstance(event, PhaseBegun)]
    assert phases == ["approach", "down", "close", "up"]


async def test_move_to_the_current_position_is_omitted() -> None:
    _, robot = made()
    await robot.run(Approach(HERE))
    phases: list[str] = []
    await robot.run(Pick(HERE), phases.append)
    assert phases == ["down", "close", "up"]


async def test_a_stop_on_the_way_down_is_left_straight_up() -> None:
    controller, robot = made()
    low = controller.workspace.require(HERE._replace(z=0.43))
    controller.state = state_of(low)
    await robot.run(Approach(THERE))
    _, path = controller.calls[0]
    assert isinstance(path, Path)
    x, y, z = controller.mechanism.fk(path.vias(controller.mechanism)[1])
    assert (x, y) == pytest.approx(HERE[:2], abs=1e-5)
    assert z >= 0.50 - 1e-5


@pytest.mark.parametrize(
    "primitive", [Home(), Approach(HERE), Pick(HERE), Gripper(False), MoveJoints(Joints(0.4, 1.6, 1.3))]
)
async def test_preview_equals_the_run(primitive: Primitive) -> None:
    _, robot = made()
    loop = asyncio.get_running_loop()
    preview = robot.preview(primitive, robot.pose)
    phases: list[str] = []
    began = loop.time()
    await robot.run(primitive, phases.append)
    took = loop.time() - began
    assert phases == [phase.name for phase in preview.phases]
    assert took == pytest.approx(HOMING_TIME if preview.duration is None else preview.duration)
    assert robot.pose.gripper == preview.end.gripper
    assert robot.pose.joints == pytest.approx(preview.end.joints, abs=COUNT)


async def test_a_preview_sends_nothing() -> None:
    controller, robot = made(homed=False)
    robot.preview(Pick(HERE), Pose(controller.workspace.require(THERE), GripperState.OPEN))
    assert controller.calls == []


async def test_a_plan_is_worked_out_once() -> None:
    controller, robot = made()
    robot.preview(Pick(HERE), robot.pose)
    count = controller.previews
    robot.preview(Pick(HERE), robot.pose)
    assert controller.previews == count


async def test_in_another_workspace_every_path_of_a_plan_is_checked_once_more() -> None:
    controller, robot = made()
    robot.preview(Pick(HERE), robot.pose)
    count = controller.previews
    controller.workspace = Workspace.of(controller.config)
    robot.preview(Pick(HERE), robot.pose)
    robot.preview(Pick(HERE), robot.pose)
    assert controller.previews == count + 2  # down to the part, and up again


async def test_a_plan_is_checked_again_in_another_workspace() -> None:
    controller, robot = made()
    robot.preview(Pick(HERE), robot.pose)
    longest = controller.workspace.require(HERE).b
    strokes = ((0.0, 2.0), (0.575, longest - 0.001), (0.565, 2.3))
    controller.workspace = Workspace.of(controller.config, strokes)
    with pytest.raises(Unreachable):
        robot.preview(Pick(HERE), robot.pose)


async def test_a_plan_that_a_new_zone_slows_down_is_timed_again() -> None:
    controller, robot = made()
    start, end = Joints(0.3, 1.5, 1.3), Joints(1.2, 1.0, 1.8)
    pose = Pose(start, GripperState.OPEN)
    before = robot.preview(MoveJoints(end), pose)
    x, y, z = controller.mechanism.fk(between(start, end, 0.13))
    low, high = Point(x - 0.1, y - 0.1, z - 0.3), Point(x + 0.1, y + 0.1, z - 0.0106)
    controller.set_zones([Box("beneath", low, high, margin=0.0)])
    after = robot.preview(MoveJoints(end), pose)
    assert after.duration is not None and before.duration is not None
    assert after.duration > 1.1 * before.duration
    assert after == MayaRobot(controller, controller.config).preview(MoveJoints(end), pose)


@pytest.mark.parametrize(
    ("primitive", "closed", "error"),
    [
        (Pick(HERE), True, GripperNotEmpty),
        (Place(HERE), False, GripperEmpty),
        (Pick(NOWHERE), False, Unreachable),
        (Approach(Point(0.5, 1.1, 2.1)), False, Unreachable),
        (Place(Point(0.5, 1.1, -0.3)), True, Unreachable),
        (MoveJoints(Joints(0.0, 0.6, 0.6)), False, Unreachable),
    ],
)
async def test_refused_command_moves_nothing(primitive: Primitive, closed: bool, error: type[MayaError]) -> None:
    controller, robot = made(closed=closed)
    with pytest.raises(error):
        await robot.run(primitive)
    assert controller.calls == []


@pytest.mark.parametrize("kind", [Approach, Pick, Place])
@pytest.mark.parametrize("homed", [True, False])
async def test_refusal_names_the_target_and_a_nearest_accepted_one(
    kind: type[Approach | Pick | Place], homed: bool, campaign: Campaign
) -> None:
    rng, refused = campaign.rng(), 0
    controller, robot = made(closed=kind is Place)
    start = robot.pose if homed else robot.pose._replace(joints=None)
    for _ in range(campaign.size(ci=40, long=1000)):
        target = Point(rng.uniform(-1.0, 2.6), rng.uniform(-1.0, 2.6), rng.uniform(-0.6, 2.4))
        try:
            robot.preview(kind(target), start)
        except Unreachable as refusal:
            refused += 1
            assert str(refusal).startswith(f"({target.x:.4f}, {target.y:.4f}, {target.z:.4f}) m cannot")
            nearest = Point(*map(float, re.findall(r"-?\d+\.\d+", str(refusal.details["nearest"]))))
            if homed:
                robot.preview(kind(nearest), start)
            else:
                with pytest.raises(NotHomed):
                    robot.preview(kind(nearest), start)
        except (NotHomed, PathRefused):
            pass
    assert refused > 20
    assert controller.calls == []


async def test_nearest_place_is_one_that_can_be_left_straight_up() -> None:
    _, robot = made()
    with pytest.raises(Unreachable) as caught:
        robot.preview(Pick(Point(2.5842, 2.4083, 0.6208)), robot.pose)
    nearest = caught.value.details["nearest_point"]
    assert isinstance(nearest, tuple)
    assert hypot(nearest[0], nearest[1]) == pytest.approx(2.3, abs=0.001)
    robot.preview(Pick(Point(*nearest)), robot.pose)


@pytest.mark.parametrize("target", [Point(1.125172, -0.278619, 2.316558), Point(1.094522, -0.569402, 2.236347)])
async def test_place_just_below_the_anchors_is_refused_like_any_other(target: Point) -> None:
    _, robot = made(closed=True)
    with pytest.raises(Unreachable, match="cannot be reached"):
        robot.preview(Place(target), robot.pose)


async def test_refusal_names_the_unreachable_place() -> None:
    _, robot = made()
    with pytest.raises(Unreachable, match=r"its approach point is 100 mm higher, and there ") as caught:
        robot.preview(Pick(HERE._replace(z=2.00)), robot.pose)
    assert caught.value.details["nearest_point"] == pytest.approx(HERE._replace(z=1.95), abs=0.01)
    with pytest.raises(Unreachable, match=r"reached: it lies 300 mm below the table top"):
        robot.preview(Pick(HERE._replace(z=-0.30)), robot.pose)


async def test_a_way_that_is_refused_is_named_by_its_target(monkeypatch: pytest.MonkeyPatch) -> None:
    _, robot = made()

    def refused(*_: object) -> None:
        raise PathRefused(target="elsewhere", reason="there is a wall")

    monkeypatch.setattr("maya_un.robot.plan_builder.TransferPlanner.plan", refused)
    with pytest.raises(PathRefused, match=r"^The path to \(0\.5000, 1\.1000, 0\.4000\) m .*a wall"):
        robot.preview(Pick(HERE), robot.pose)


@pytest.mark.parametrize(
    ("mode", "error"),
    [(Mode.NOT_HOMED, NotHomed), (Mode.DISCONNECTED, NotConnected), (Mode.FAULT, Faulted), (Mode.MOVING, Busy)],
)
async def test_preconditions_are_checked_first(mode: Mode, error: type[MayaError]) -> None:
    controller, robot = made()
    controller.state = state_of(None, mode=mode)
    for primitive in (Pick(HERE), CanTeleop()):
        with pytest.raises(error):
            await robot.run(primitive)
    assert controller.calls == []


async def test_the_gripper_needs_no_homing() -> None:
    controller, robot = made(homed=False)
    await robot.run(Gripper(open=False))
    assert controller.state.gripper_closed


async def test_second_command_is_refused() -> None:
    _, robot = made()
    first = asyncio.create_task(robot.run(Pick(HERE)))
    await elapse(1.0)
    assert not robot.can_teleop
    with pytest.raises(Busy, match="pick"):
        await robot.run(Home())
    await first
    assert robot.can_teleop
    await robot.run(CanTeleop())


@pytest.mark.parametrize("instant", [0.0, 1.0, 15.0, 20.0, 21.7, 25.0])
async def test_cancelling_stops_on_the_path_and_leaves_the_gripper_as_it_is(instant: float) -> None:
    controller, robot = made()
    task = asyncio.create_task(robot.run(Pick(HERE)))
    await elapse(instant)
    closed = controller.state.gripper_closed
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert controller.state.gripper_closed == closed
    assert controller.names()[-1] == "at rest"
    assert robot.running is None


async def test_a_stop_ends_the_primitive() -> None:
    controller, robot = made()
    task = asyncio.create_task(robot.run(Pick(HERE)))
    await elapse(3.0)
    await controller.stop()
    with pytest.raises(Stopped):
        await task
    assert controller.names() == ["follow", "stop"]


async def test_holding_follows_the_picks_and_places() -> None:
    controller, robot = made()
    assert robot.holding is False
    await robot.run(Pick(HERE))
    assert robot.holding is True
    await controller.gripper(open_=True)
    assert robot.holding is False
    await controller.gripper(open_=False)
    assert robot.holding is None


async def test_a_gripper_found_closed_after_power_up_is_opened_by_a_pick() -> None:
    _, robot = made(homed=False, closed=True)
    await robot.run(Home())
    assert robot.pose.gripper is GripperState.FOUND
    assert robot.holding is None
    await robot.run(Pick(HERE))
    assert robot.holding is True


async def test_a_gripper_closed_by_command_may_hold_something() -> None:
    _, robot = made(homed=False)
    await robot.run(Home())
    await robot.run(Gripper(open=False))
    assert robot.pose.gripper is GripperState.CLOSED
    with pytest.raises(GripperNotEmpty):
        await robot.run(Pick(HERE))


async def test_gripper_interrupted_while_closing_may_hold_something() -> None:
    controller, robot = made(homed=False)
    await robot.run(Home())
    controller.fail_at[len(controller.calls) + 2] = Stopped()
    with pytest.raises(Stopped):
        await robot.run(Pick(HERE))
    assert controller.names()[-1] == "gripper"
    controller.state = replace(controller.state, gripper_closed=True)
    assert robot.pose.gripper is GripperState.CLOSED
    assert robot.holding is None
    with pytest.raises(GripperNotEmpty):
        await robot.run(Pick(THERE))


async def test_a_gripper_found_closed_under_a_homing_taken_over_may_hold_something() -> None:
    _, robot = made(closed=True)
    assert robot.pose.gripper is GripperState.CLOSED


async def test_inspected_closed_gripper_is_trusted_until_it_moves() -> None:
    controller, robot = made(closed=True)
    assert robot.holding is None
    robot.seen(holding=True)
    assert (robot.holding, robot.pose.gripper) == (True, GripperState.CLOSED)
    robot.seen(holding=False)
    assert (robot.holding, robot.pose.gripper) == (False, GripperState.FOUND)
    await controller.gripper(True)
    assert robot.pose.gripper is GripperState.OPEN
    await controller.gripper(False)
    assert (robot.holding, robot.pose.gripper) == (None, GripperState.CLOSED)


async def test_a_pick_that_failed_before_it_closed_holds_nothing() -> None:
    controller, robot = made()
    controller.fail_at = {1: FollowingError(axis="b")}
    with pytest.raises(FollowingError):
        await robot.run(Pick(HERE))
    assert robot.holding is False


async def test_a_line_goes_straight() -> None:
    controller, robot = made()
    await robot.run(Line(Point(0.4, 0.9, 0.8)))
    _, path = controller.calls[0]
    assert isinstance(path, Path)
    assert path.space is Space.CARTESIAN
    assert len(path.waypoints) == 2
    assert controller.state.point == pytest.approx((0.4, 0.9, 0.8), abs=COUNT)


async def test_line_through_unreachable_points_is_refused() -> None:
    _, robot = made()
    behind = Pose(robot.pose.joints, GripperState.OPEN)
    with pytest.raises(Unreachable, match="anchors"):
        robot.preview(Line(Point(0.4, 0.9, 2.3)), behind)


class _Meanwhile:
    """Workers that compute at once; the position of the robot changes by `drifts` of line b [m] meanwhile."""

    def __init__(self, controller: FakeController, drifts: list[float]) -> None:
        self.plans = 0
        self._controller = controller
        self._drifts = iter(drifts)
        self._builder = Plans(controller)

    async def run(
        self, _work: object, _workspace: object, primitive: Primitive, start: Pose, speed: float, whose: str = ""
    ) -> object:
        self.plans += 1
        plan = self._builder.plan(primitive, start, speed)
        here = self._controller.state.joints
        assert here is not None
        self._controller.state = replace(self._controller.state, joints=here._replace(b=here.b + next(self._drifts)))
        return WorkResult([], plan)


@pytest.mark.parametrize(("drifts", "plans"), [([0.0], 1), ([9e-5], 1), ([1e-3, -9e-5], 2)])
async def test_encoders_that_are_never_still_delay_no_motion(drifts: list[float], plans: int) -> None:
    controller = FakeController()
    workers = _Meanwhile(controller, drifts)
    await MayaRobot(controller, controller.config, cast("Workers", workers)).run(MoveJoints(START))
    assert (workers.plans, controller.names()) == (plans, ["follow"])
