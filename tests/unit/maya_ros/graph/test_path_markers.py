"""The current path is that of a goal, from its sending until its result."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import pytest

from maya_ros.graph import markers
from maya_ros.graph.bus import Bus
from maya_ros.graph.conversions import path_to_message
from maya_ros.graph.markers import PathMarkers
from maya_ros.graph.protocol import Feedback, GoalRefused, Message
from maya_un.controller.planner import MOST_SEGMENTS
from maya_un.motion import Path
from maya_un.values import Mode, Point
from tests.graphs import controller_node
from tests.strategies import WORKSPACE
from tests.streaming import REST
from tests.virtual_time import elapse

MECHANISM = WORKSPACE.mechanism
START, END = Point(0.5, 1.2, 0.4), Point(1.1, 0.6, 0.9)
HERE, THERE = WORKSPACE.ik(START), WORKSPACE.ik(END)
DONE: Message = {"success": True, "code": "", "message": ""}


class Controller:
    """Serves both actions: takes its time, and refuses what comes in the meantime."""

    def __init__(self, bus: Bus) -> None:
        self.node = bus.node("hw_simulator")
        self._busy = False
        self.node.act("/controller/follow", "maya_controller/Follow", self._act)
        self.node.act("/move", "maya_controller/Move", self._act)

    async def _act(self, _: Message, __: Feedback) -> Message:
        if self._busy:
            raise GoalRefused({**DONE, "success": False, "code": "2104"})
        self._busy = True
        await elapse(10.0)
        self._busy = False
        return DONE


def follow(path: Path) -> Message:
    return {"trajectory": path_to_message(path)}


async def test_path_of_a_goal_is_known_until_its_result() -> None:
    bus = Bus()
    Controller(bus)
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    assert ways.way == ()
    line = Path.line(START, END)
    going = asyncio.ensure_future(bus.node("robot").do("/controller/follow", "maya_controller/Follow", follow(line)))
    await elapse(1.0)
    assert ways.way[0] == pytest.approx(START)
    assert ways.way[-1] == pytest.approx(END)
    await going
    assert ways.way == ()


async def test_move_starts_at_the_position_of_the_robot() -> None:
    bus = Bus()
    Controller(bus)
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    going = asyncio.ensure_future(bus.node("robot").do("/move", "maya_controller/Move", THERE._asdict()))
    await elapse(1.0)
    assert ways.way[0] == pytest.approx(START)
    assert ways.way[-1] == pytest.approx(END)
    ways.close()
    assert ways.way == ()
    await going


async def test_a_goal_that_is_refused_leaves_the_way_of_the_other() -> None:
    bus = Bus()
    Controller(bus)
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    robot = bus.node("robot")
    first = asyncio.ensure_future(
        robot.do("/controller/follow", "maya_controller/Follow", follow(Path.line(START, END)))
    )
    await elapse(1.0)
    await robot.do("/controller/follow", "maya_controller/Follow", follow(Path.line(END, START)))
    assert ways.way[-1] == pytest.approx(END)
    await first
    assert ways.way == ()


async def test_invalid_path_and_move_without_a_start_have_no_marker() -> None:
    bus = Bus()
    Controller(bus)
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: None)
    robot = bus.node("robot")
    short = {"trajectory": {**path_to_message(Path.line(START, END)), "joint_names": ["x", "y"]}}
    for action, kind, goal in (
        ("/controller/follow", "maya_controller/Follow", short),
        ("/move", "maya_controller/Move", THERE._asdict()),
    ):
        going = asyncio.ensure_future(robot.do(action, kind, goal))
        await elapse(1.0)
        assert ways.way == ()
        await going


async def test_subscriber_sees_the_path_appear_and_disappear() -> None:
    bus = Bus()
    told: list[tuple[str, int]] = []

    def hear(array: Message) -> None:
        told.extend((one["ns"], one["action"]) for one in array["markers"])

    async with controller_node(bus, homed=True) as layer:
        viewer = bus.node("rviz")
        viewer.subscribe("/maya_markers", "visualization_msgs/MarkerArray", hear)
        await elapse(1.0)
        assert ("workspace", 0) in told
        assert ("path", 0) not in told
        there = layer.rig.controller.mechanism.ik(Point(0.6, 1.3, 1.2))
        await viewer.do("/move", "maya_controller/Move", there._asdict())
        assert ("path", 0) in told
        assert ("path", 2) not in told
        await elapse(2.0)  # a state of the robot at rest comes once a second
        assert ("path", 2) in told


async def test_goal_that_no_result_would_end_or_that_is_too_long_has_no_marker() -> None:
    bus = Bus()
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    goals = bus.node("rostopic").advertise("/controller/follow/goal", "maya_controller/FollowActionGoal")
    line = follow(Path.line(START, END))
    goals.publish({"goal": line})
    await elapse(0.1)
    assert ways.way == ()
    points = [{"positions": [0.5 + 0.001 * (place % 300), 1.2, 1.5]} for place in range(MOST_SEGMENTS + 1)]
    for name, count in (("long", MOST_SEGMENTS + 1), ("fits", MOST_SEGMENTS)):
        trajectory = {"joint_names": ["a", "b", "c"], "points": points[:count]}
        goals.publish({"goal_id": {"id": name}, "goal": {"trajectory": trajectory}})
        await elapse(0.1)
        assert bool(ways.way) == (name == "fits")


async def test_goals_are_not_computed_before_they_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    bus, computed = Bus(), list[object]()
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    goals = bus.node("rostopic").advertise("/controller/follow/goal", "maya_controller/FollowActionGoal")
    monkeypatch.setattr(markers, "way_of", lambda route, _: computed.append(route) or (START,))
    for number in range(2 * markers.MOST_GOALS):
        goals.publish({"goal_id": {"id": str(number)}, "goal": follow(Path.line(START, END))})
        await elapse(0.01)
    assert computed == []
    assert [*ways.way, *ways.way] == [START, START]
    assert len(computed) == 1


async def test_path_without_a_result_disappears_when_the_robot_is_at_rest() -> None:
    bus = Bus()
    ways = PathMarkers(bus.node("sensors"), MECHANISM, lambda: HERE)
    goals = bus.node("rostopic").advertise("/controller/follow/goal", "maya_controller/FollowActionGoal")
    goals.publish({"goal_id": {"id": "lost"}, "goal": follow(Path.line(START, END))})
    for wait, mode, drawn in (
        (0.1, Mode.IDLE, True),
        (10.0, Mode.MOVING, True),
        (10.0, Mode.PAUSED, True),
        (0.1, Mode.IDLE, False),
    ):
        await elapse(wait)
        ways.update(replace(REST, mode=mode))
        assert bool(ways.way) == drawn, mode
