"""The action control_msgs/FollowJointTrajectory: a trajectory of a, b, c, carried out by /controller/follow.

The whole trajectory is checked before anything moves. The robot follows its path with its own timing law, and takes
at least as long as the last `time_from_start` says. A tolerance refers to the position of the trajectory at the same
time, interpolated linearly between its points. A goal whose start is later waits; only one goal can wait. A stop or a
fault ends a goal that has not begun to move the robot.

A goal that cannot be carried out is aborted and not rejected, because only a result has room for the reason.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, NamedTuple

from dmc41x3.i18n import phrase
from maya_ros.graph.conversions import NAMES, path_from_message, path_to_message
from maya_ros.graph.outcome import error_of, goal_to_its_end
from maya_ros.graph.protocol import Feedback, GoalResult, GoalStatus, Graph, Message, header, in_seconds, stamp
from maya_ros.graph.table import FOLLOW, FOLLOW_JOINTS, JOINTS
from maya_ros.ros2.robot import RobotInterface
from maya_un.errors import Busy, InvalidMessage, MayaError, NotHomed, Stopped, TrajectoryRefused
from maya_un.motion.path import Path, Space
from maya_un.values import Joints

SUCCESSFUL, INVALID_GOAL, INVALID_JOINTS, OLD_HEADER_TIMESTAMP, PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = (
    0, -1, -2, -3, -4, -5,
)  # fmt: skip
"""Codes of results (control_msgs/FollowJointTrajectory)."""

Tolerances = tuple[float, float, float]
"""The largest deviations of a, b, c (rad, m, m); 0 for any."""

_LOOK = 0.02
"""Time between two looks at the clock while a start is awaited [s]."""

LONGEST_WAIT = 60.0
"""Longest time from a goal to its start [s]."""

_STOPPED = f"{Stopped.code}: A stop or a fault came before the start. Send the goal again if you still need it."


class Timetable(NamedTuple):
    """The wanted joints at times after the start [s]; `goal_time` is the allowed delay, 0 for any."""

    times: tuple[float, ...]
    places: tuple[Joints, ...]
    start: float
    path_tolerance: Tolerances
    goal_tolerance: Tolerances
    goal_time: float

    def at(self, time: float) -> Joints:
        """Return the joints at a time, interpolated linearly between the points."""
        if time <= self.times[0]:
            return self.places[0]
        for (t0, p0), (t1, p1) in pairwise(zip(self.times, self.places, strict=True)):
            if time < t1:
                share = (time - t0) / (t1 - t0)
                return Joints(*(x + share * (y - x) for x, y in zip(p0, p1, strict=True)))
        return self.places[-1]


class _Violation(NamedTuple):
    code: int
    reason: str


class JointTrajectories:
    """Carries out goals of `robot` on `graph`; `own` is its own graph, `now` returns the time of its stamps [s].

    `permit` raises the reason if programs of ROS 2 may not send goals now.
    """

    def __init__(
        self, graph: Graph, own: Graph, robot: RobotInterface, now: Callable[[], float], permit: Callable[[], None]
    ) -> None:
        self._graph = graph
        self._timer = robot.timer
        self._joints = robot.joints
        self._settled = robot.settled
        self._halts = robot.halts
        self._now = now
        self._own = own
        self._permit = permit
        self._waiting = False
        self._following = False

    async def carry_out(self, goal: Message, feedback: Feedback) -> GoalResult:
        """Carry out a goal to its end, also after a cancellation."""
        halts = self._halts.count
        try:
            self._permit()
            table = self._table(goal)
            with self._place(table):
                await self._require_fast(table)
                if table.start and table.start + table.times[-1] < self._now():
                    return _aborted(OLD_HEADER_TIMESTAMP, "the whole trajectory lies in the past")
                await self._wait_for_start(table, feedback, halts)
        except asyncio.CancelledError:
            return GoalResult(GoalStatus.PREEMPTED, {"error_string": "cancelled before its start"})
        except Stopped:
            return _aborted(INVALID_GOAL, _STOPPED)
        except MayaError as error:
            joints = isinstance(error, InvalidMessage) and error.details.get("name") == "joint_names"
            return _aborted(INVALID_JOINTS if joints else INVALID_GOAL, f"{error.code}: {error}")
        return await self._follow(table, feedback, halts)

    @contextmanager
    def _place(self, table: Timetable) -> Iterator[None]:
        """Hold the only place for a goal that waits, from its check to its start.

        Raises `TrajectoryRefused` if the start is more than `LONGEST_WAIT` away. Raises `Busy` if the start is in the
        future and another goal waits, or if the start is now and the robot follows another goal.
        """
        wait = table.start - self._now()
        if wait > LONGEST_WAIT:
            raise TrajectoryRefused(reason=phrase("it must start within {most:g} s from now", most=LONGEST_WAIT))
        if wait <= 0.0:
            if self._following:
                raise Busy(doing=FOLLOW_JOINTS.name)
            yield
            return
        if self._waiting:
            raise Busy(doing=FOLLOW_JOINTS.name)
        self._waiting = True
        try:
            yield
        finally:
            self._waiting = False

    async def _wait_for_start(self, table: Timetable, feedback: Feedback, halts: int) -> None:
        """Wait until the robot is to begin; raises `Stopped` if a stop or a fault came since `halts`."""
        self._halts.require(halts)
        while self._now() < table.start:
            feedback(self._told(table, 0.0))
            await asyncio.sleep(_LOOK)
            self._halts.require(halts)

    async def _follow(self, table: Timetable, feedback: Feedback, halts: int) -> GoalResult:
        task = asyncio.current_task()
        assert task is not None
        begun: list[float] = []
        found: list[_Violation] = []

        def look(_: Message) -> None:
            violation = self._violation(table, self._now() - begun[0]) if begun and not found else None
            if violation is not None:
                found.append(violation)
                task.cancel()  # stops the motion; its end follows

        def told(_: Message) -> None:
            if not begun:
                begun.append(self._now())
                if self._halts.count != halts and not found:  # it came while the goal was on its way to the robot
                    found.append(_Violation(INVALID_GOAL, _STOPPED))
                    task.cancel()
            feedback(self._told(table, self._now() - begun[0]))

        states = self._own.subscribe(JOINTS.name, JOINTS.type, look, queue_size=1)
        self._following = True
        try:
            message = path_to_message(Path.joints(*table.places), table.times[-1])
            ended = await goal_to_its_end(self._graph, FOLLOW.name, FOLLOW.type, {"trajectory": message}, told)
        except MayaError as error:
            return _aborted(INVALID_GOAL, f"{error.code}: {error}")
        finally:
            self._following = False
            states.close()
        if found:
            return _aborted(*found[0])
        if not begun and isinstance(error_of(ended.result, FOLLOW.name), Stopped):
            return _aborted(INVALID_GOAL, _STOPPED)
        try:
            await self._settled()
        except asyncio.CancelledError:
            if ended.outcome is GoalStatus.SUCCEEDED:
                return GoalResult(GoalStatus.PREEMPTED, {"error_string": "cancelled at its end"})
        return self._ended(table, ended)

    def _ended(self, table: Timetable, ended: GoalResult) -> GoalResult:
        if ended.outcome is GoalStatus.SUCCEEDED:
            missed = _missed(self._joints(), table.places[-1], table.goal_tolerance)
            return _aborted(GOAL_TOLERANCE_VIOLATED, missed) if missed else GoalResult(ended.outcome, {})
        error = error_of(ended.result, FOLLOW.name)
        reason = "" if error is None else f"{error.code}: {error}"
        if ended.outcome in (GoalStatus.PREEMPTED, GoalStatus.RECALLED):
            return GoalResult(ended.outcome, {"error_string": reason})
        return _aborted(INVALID_GOAL, reason)

    def _violation(self, table: Timetable, time: float) -> _Violation | None:
        """Return what is violated at a time after the start [s]."""
        if table.goal_time and time > table.times[-1] + table.goal_time:
            late = f"not at the end {table.goal_time:g} s after the time of the last point"
            return _Violation(GOAL_TOLERANCE_VIOLATED, late)
        missed = _missed(self._joints(), table.at(time), table.path_tolerance)
        return _Violation(PATH_TOLERANCE_VIOLATED, missed) if missed else None

    def _told(self, table: Timetable, time: float) -> Message:
        """Return control_msgs/FollowJointTrajectory_Feedback."""
        wanted = table.at(time)
        actual = self._joints() or wanted
        error = [x - y for x, y in zip(wanted, actual, strict=True)]
        when = stamp(time)
        return {
            "header": header(self._now()),
            "joint_names": list(NAMES[Space.JOINT]),
            "desired": {"positions": list(wanted), "time_from_start": when},
            "actual": {"positions": list(actual), "time_from_start": when},
            "error": {"positions": error, "time_from_start": when},
        }

    def _table(self, goal: Message) -> Timetable:
        """Return what a goal wants; raises `InvalidMessage`, `InvalidValue`, `TrajectoryRefused`, `NotHomed`."""
        joints = self._joints()
        if joints is None:
            raise NotHomed(command="maya home")
        _require_supported(goal)
        trajectory: Message = goal["trajectory"]
        names: Sequence[str] = trajectory["joint_names"]
        if sorted(names) != list(NAMES[Space.JOINT]):
            reason = phrase("they must be a, b and c, not {given!r}", given=" ".join(names)[:60])
            raise InvalidMessage(name="joint_names", reason=reason)
        points: list[Message] = [
            {**point, "effort": []} for point in trajectory["points"]
        ]  # an effort would cut a corner
        times: tuple[float, ...] = tuple(in_seconds(point["time_from_start"]) for point in points)
        _require_growing(times)
        if times[0] > 0.0:
            here: Message = {"positions": [joints["abc".index(name)] for name in names], "effort": []}
            points, times = [here, *points], (0.0, *times)
        path, _ = path_from_message({"joint_names": names, "points": points})
        return Timetable(
            times,
            tuple(Joints(*point) for point in path.waypoints),
            in_seconds(trajectory["header"]["stamp"]),
            _tolerances(goal["path_tolerance"], "path_tolerance"),
            _tolerances(goal["goal_tolerance"], "goal_tolerance"),
            max(0.0, in_seconds(goal["goal_time_tolerance"])),
        )

    async def _require_fast(self, table: Timetable) -> None:
        """Check the whole path; raises the errors of its motion, and `TrajectoryRefused` if that takes too long."""
        shortest = await self._timer.duration(Path.joints(*table.places))
        if table.goal_time and shortest > table.times[-1] + table.goal_time:
            reason = phrase("it is to take {wanted:.1f} s, and the robot needs {shortest:.1f} s",
                            wanted=table.times[-1] + table.goal_time, shortest=shortest)  # fmt: skip
            raise TrajectoryRefused(reason=reason)


def _require_supported(goal: Message) -> None:
    for name in ("component_path_tolerance", "component_goal_tolerance"):
        if goal[name]:
            raise InvalidMessage(name=name, reason="Maya has no joint with several degrees of freedom")
    if goal["multi_dof_trajectory"]["points"]:
        raise InvalidMessage(name="multi_dof_trajectory", reason="Maya has no joint with several degrees of freedom")


def _require_growing(times: Sequence[float]) -> None:
    if not times:
        raise TrajectoryRefused(reason="it has no points")
    if times[0] < 0.0 or any(later <= earlier for earlier, later in pairwise(times)):
        raise TrajectoryRefused(reason="time_from_start must grow from point to point, from 0 or above")


def _tolerances(given: Sequence[Mapping[str, Any]], field: str) -> Tolerances:
    """Return the tolerances of a, b, c; 0 and below are none (control_msgs/JointTolerance)."""
    found = dict.fromkeys(NAMES[Space.JOINT], 0.0)
    for one in given:
        if one["name"] not in found:
            reason = phrase("there is no joint {name!r}", name=str(one["name"])[:40])
            raise InvalidMessage(name=field, reason=reason)
        if one["velocity"] > 0.0 or one["acceleration"] > 0.0:
            raise InvalidMessage(name=field, reason="Maya checks positions, not velocities or accelerations")
        found[one["name"]] = max(0.0, one["position"])
    return found["a"], found["b"], found["c"]


def _missed(actual: Joints | None, wanted: Joints, allowed: Tolerances) -> str:
    """Return which joint is too far from where it is to be, "" if none is."""
    if actual is None:
        return ""
    for name, is_at, to_be, most in zip(NAMES[Space.JOINT], actual, wanted, allowed, strict=True):
        if most > 0.0 and abs(is_at - to_be) > most:
            return f"{name} is {abs(is_at - to_be):.4g} from its place, and the tolerance is {most:g}"
    return ""


def _aborted(code: int, reason: str) -> GoalResult:
    return GoalResult(GoalStatus.ABORTED, {"error_code": code, "error_string": reason})
