"""Actions on DDS: every goal gets an answer and a result, whenever it is cancelled."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from maya_ros.graph.bus import Bus
from maya_ros.graph.halts import Halts
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, GoalResult, GoalStatus, Message
from maya_ros.graph.table import FOLLOW, FOLLOW_JOINTS, JOINTS, TASK, Row
from maya_ros.ros2.robot import RobotInterface
from maya_ros.ros2.server import ABORTED, CANCELED, SUCCEEDED, ActionServer, CarryOut, ServiceServer
from maya_ros.ros2.trajectory import JointTrajectories
from maya_un.errors import MayaError, NotSignedIn
from maya_un.events import EmergencyStopped, Event, EventLog, FaultEntered, LimitHit
from maya_un.motion.path import Path
from maya_un.values import Joints
from tests.ros2_fakes import FakeDds, rest

NOW = 100.0
STAMP = {"secs": 100, "nsecs": 0}
ALL = {"goal_info": {"goal_id": {"uuid": [0] * 16}, "stamp": {"secs": 0, "nsecs": 0}}}


class Program:
    """A program of ROS 2 with one goal after another."""

    def __init__(self, row: Row, carry_out: CarryOut, dds: FakeDds) -> None:
        self.row = row
        self.dds = dds
        self.server = ServiceServer(dds, lambda: STAMP)  # pyright: ignore[reportArgumentType]
        ActionServer(self.server, row, "hw", dds, carry_out)  # pyright: ignore[reportArgumentType]

    def send(self, number: int, goal: Message) -> None:
        """Send a goal, and ask for its result."""
        name = {"goal_id": {"uuid": [number] * 16}}
        self.dds.ask(self.row.name, "send_goal", {**name, "goal": goal})
        self.dds.ask(self.row.name, "get_result", name)

    def cancel(self) -> None:
        """Cancel all goals."""
        self.dds.ask(self.row.name, "cancel_goal", ALL)

    def accepted(self) -> list[bool]:
        """Return which goals were accepted."""
        return [one["accepted"] for one in self.dds.told(self.row.name, "send_goal")]

    def ends(self) -> list[tuple[int, Any]]:
        """Return the states and results of goals that have ended."""
        return [(one["status"], one["result"]) for one in self.dds.told(self.row.name, "get_result")]

    def states(self) -> list[int]:
        """Return the states of all goals."""
        return [one["status"] for one in self.dds.told(self.row.name, "status")[-1]["status_list"]]


HOME = {"task": {"command": "home", "target": {"x": 0.0, "y": 0.0, "z": 0.0}, "open": False}}


async def test_goal_that_is_cancelled_before_its_first_turn_is_cancelled() -> None:
    begun: list[Message] = []

    async def carry_out(goal: Message, feedback: Feedback) -> GoalResult:
        begun.append(goal)
        feedback({"phase": "x", "progress": 0.0, "position": {"x": 0.0, "y": 0.0, "z": 0.0}})
        return GoalResult(GoalStatus.SUCCEEDED, success())

    one = Program(TASK, carry_out, FakeDds())
    one.send(1, HOME)
    one.cancel()
    await rest()
    assert (begun, one.accepted(), one.ends(), one.states()) == ([], [True], [(CANCELED, {})], [CANCELED])
    one.send(2, HOME)
    await rest()
    assert (one.accepted(), one.states()) == ([True, True], [CANCELED, SUCCEEDED])
    await one.server.close()


async def test_goal_that_fails_is_aborted() -> None:
    async def carry_out(_goal: Message, _feedback: Feedback) -> GoalResult:
        raise ZeroDivisionError

    asyncio.get_running_loop().set_exception_handler(lambda *_: None)
    one = Program(TASK, carry_out, FakeDds())
    one.send(1, HOME)
    await rest()
    assert (one.accepted(), one.ends()) == ([True], [(ABORTED, {})])
    await one.server.close()


class Robot:
    """A robot that follows at once, and whose end shows later. A test may hold its check of paths, or its motion."""

    def __init__(self) -> None:
        self.bus = Bus(lambda: NOW)
        self.followed = 0
        self.settling = asyncio.Event()
        self.settled = asyncio.Event()
        self.now = NOW
        self.refusal: MayaError | None = None
        hardware = self.bus.node("hw")
        hardware.act(FOLLOW.name, FOLLOW.type, self.act)
        hardware.advertise(JOINTS.name, JOINTS.type)
        me = self.bus.node("ros2")
        joints = Joints(1.0, 1.2, 1.5)
        self.stops = 0
        self.events = EventLog(lambda: self.now)
        self.checked = asyncio.Event()
        self.checked.set()
        self.checking = 0
        self.begins = asyncio.Event()
        self.begins.set()
        self.moves = asyncio.Event()
        self.moves.set()
        self.stopped = 0
        self.halts = Halts(self)
        self.events.heard_by(self.halts.hear)
        robot = RobotInterface("", self, lambda: joints, self.halts, scaled=False, settled=self.settle)  # type: ignore[arg-type]
        self.trajectories = JointTrajectories(me, me, robot, lambda: self.now, self.permit)

    async def duration(self, _: Path) -> float:
        """Check a path, as long as a test wants: the motion takes almost no time."""
        self.checking += 1
        await self.checked.wait()
        return 0.01

    def permit(self) -> None:
        """Raise the refusal of the test."""
        if self.refusal is not None:
            raise self.refusal

    async def act(self, _: Message, feedback: Feedback) -> Message:
        """Be there."""
        await self.begins.wait()
        self.followed += 1
        feedback({"a": 1.0, "b": 1.2, "c": 1.5, "progress": 0.0})
        try:
            await self.moves.wait()
        except asyncio.CancelledError:
            self.stopped += 1
            raise
        return success()

    def halt(self, event: Event | None = None) -> None:
        """Report a fault, or a stop."""
        if event is None:
            self.stops += 1
        else:
            self.events.emit(event)

    async def settle(self) -> None:
        """Wait until a test lets the end show."""
        self.settling.set()
        await self.settled.wait()


def waiting(robot: Robot, *starts: int) -> Program:
    """Send trajectories with these starts."""
    one = Program(FOLLOW_JOINTS, robot.trajectories.carry_out, FakeDds())
    for number, start in enumerate(starts, 1):
        one.send(number, trajectory(start))
    return one


def trajectory(start: int = 0) -> Message:
    """Return a trajectory to where the robot is."""
    point = {"positions": [1.0, 1.2, 1.5], "time_from_start": {"secs": 1, "nsecs": 0}}
    header = {"stamp": {"secs": start, "nsecs": 0}}
    return {"trajectory": {"header": header, "joint_names": ["a", "b", "c"], "points": [point]}}


async def test_trajectory_that_is_cancelled_while_its_end_settles_is_cancelled() -> None:
    robot = Robot()
    one = Program(FOLLOW_JOINTS, robot.trajectories.carry_out, FakeDds())
    one.send(1, trajectory())
    await robot.settling.wait()
    one.cancel()
    await rest()
    assert (robot.followed, one.accepted(), one.states()) == (1, [True], [CANCELED])
    assert one.ends() == [(CANCELED, {"error_string": "cancelled at its end"})]
    await one.server.close()


async def test_one_trajectory_at_a_time_waits_for_its_start_and_not_for_long() -> None:
    robot = Robot()
    one = waiting(robot, 159, 160, 161, 4_000_000)
    await rest()
    assert one.accepted() == [True] * 4
    busy, late, later = (end["error_string"].partition(":")[0] for _, end in one.ends())
    assert (busy, late, later) == ("2104", "2107", "2107")
    robot.now, robot.settled = 159.0, asyncio.Event()
    robot.settled.set()
    await rest(0.1)
    assert (robot.followed, one.ends()[-1]) == (1, (SUCCEEDED, {}))
    one.send(9, trajectory(170))
    await rest()
    one.cancel()
    await rest()
    assert one.ends()[-1] == (CANCELED, {"error_string": "cancelled before its start"})
    one.send(10, trajectory(170))
    await rest()
    assert len(one.ends()) == 5, "another one may wait again"
    await one.server.close()


async def test_program_without_rights_cannot_have_a_trajectory_wait() -> None:
    robot = Robot()
    robot.refusal = NotSignedIn(reason="test")
    one = waiting(robot, 110)
    await rest()
    assert [(status, end["error_string"].partition(":")[0]) for status, end in one.ends()] == [(ABORTED, "4101")]
    await one.server.close()


def codes(one: Program) -> list[tuple[int, str]]:
    """Return the states of goals that have ended, and the codes of their errors."""
    return [(status, end["error_string"].partition(":")[0]) for status, end in one.ends()]


@pytest.mark.parametrize("halt", [EmergencyStopped(), FaultEntered(), LimitHit(), None])
async def test_stop_or_fault_ends_a_trajectory_that_waits_for_its_start(halt: Event | None) -> None:
    robot = Robot()
    one = waiting(robot, 130)
    await rest(1.0)
    robot.halt(halt)
    await rest(0.1)
    assert codes(one) == [(ABORTED, "2201")]
    robot.now = 130.0
    await rest(0.1)
    assert robot.followed == 0
    one.send(2, trajectory(131))
    await rest()
    robot.now = 131.0
    robot.settled.set()
    await rest(0.1)
    assert (robot.followed, one.ends()[-1]) == (1, (SUCCEEDED, {})), "a later goal is carried out"
    await one.server.close()


@pytest.mark.parametrize("start", [0, 130])
async def test_stop_while_a_trajectory_is_checked_ends_it(start: int) -> None:
    robot = Robot()
    robot.checked.clear()
    one = waiting(robot, start)
    await rest()
    assert robot.checking == 1
    robot.halt()
    robot.checked.set()
    await rest()
    assert (robot.followed, codes(one)) == (0, [(ABORTED, "2201")])
    await one.server.close()


async def test_stop_at_the_end_of_the_wait_ends_the_trajectory() -> None:
    robot = Robot()
    one = waiting(robot, 130)
    await rest()
    robot.now = 130.0
    robot.halt()
    await rest(0.1)
    assert (robot.followed, codes(one)) == (0, [(ABORTED, "2201")])
    await one.server.close()


async def test_stop_on_the_way_to_the_robot_ends_the_trajectory_as_it_begins() -> None:
    robot = Robot()
    robot.begins.clear()
    robot.moves = asyncio.Event()
    one = waiting(robot, 0)
    await rest()
    robot.halt()
    robot.begins.set()
    await rest()
    assert (robot.stopped, codes(one)) == (1, [(ABORTED, "2201")])
    await one.server.close()


async def test_trajectory_can_be_cancelled_while_it_is_checked() -> None:
    robot = Robot()
    robot.checked.clear()
    one = waiting(robot, 130)
    await rest()
    one.cancel()
    await rest()
    assert one.ends() == [(CANCELED, {"error_string": "cancelled before its start"})]
    robot.checked.set()
    one.send(2, trajectory(130))
    await rest(0.1)
    assert one.accepted() == [True, True], "another one may wait again"
    await one.server.close()


async def test_trajectory_is_refused_unchecked_while_another_one_waits_or_moves() -> None:
    robot = Robot()
    one = waiting(robot, 130, 131)
    await rest()
    assert (robot.checking, codes(one)) == (1, [(ABORTED, "2104")])
    robot.moves = asyncio.Event()
    one.send(3, trajectory())
    await rest()
    one.send(4, trajectory())
    await rest()
    assert (robot.followed, robot.checking, codes(one)) == (1, 2, [(ABORTED, "2104")] * 2)
    robot.settled.set()
    await one.server.close()
