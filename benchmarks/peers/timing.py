"""The fastest motion within the limits of the axes: Maya's planner beside ruckig and toppra.

All get the same limits, in rad and m. Maya's result is more: segments for the controller, with a
speed for each. One more side of Maya proves the whole path against the workspace too, which no other does.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np

from benchmarks.peers.contest import Contest, Floats, Side, peer, sides_of, spent
from maya_un.config import Config, Units
from maya_un.controller.planner import Planner
from maya_un.kinematics import Mechanism, Workspace
from maya_un.motion.move import lay
from maya_un.motion.path import Path
from maya_un.motion.profile import Limits
from maya_un.motion.timing import plan
from maya_un.values import Joints, Point
from scripts.performance_results import OURS

CONFIG = Config()
LIMITS, UNITS = Limits.of(CONFIG), Units.of(CONFIG)
SPEED, ACCELERATION = (np.array(limit) / np.array(UNITS.per_unit) for limit in (LIMITS.speed, LIMITS.acceleration))

START, END = Joints(0.5, 1.5, 1.5), Joints(1.6, 1.4, 1.6)
"""A move from joints to joints [rad, m, m]. The boom is always the slowest axis: ruckig limits each axis alone."""

FROM, TO = Point(0.5, 0.9, 0.7), Point(1.4, 0.6, 1.1)
"""A straight way of the gripper [m]."""

KNOTS = 100
"""The others follow a spline through so many places of that way."""

NEAR = 1e-6
"""A motion must begin and end so near the places that were asked for [rad, m]."""

STRICT = 1.01
"""An axis may be faster than its limit by this factor, between the places where it is looked at."""

DIFFERENT = 0.02
"""Durations may differ by this share."""

PROVEN = "Maya, path proven"


def contests(left_out: dict[str, str]) -> list[Contest]:
    """Return a move in the joints and a straight line in space."""
    mechanism = Workspace.of(CONFIG).mechanism
    ends = np.array((START, END))
    line = _line(mechanism)
    joint_move, straight = Path.joints(START, END), Path.line(FROM, TO)
    return [
        _contest(
            "a move from joints to joints",
            mechanism,
            joint_move,
            lambda end: Path.joints(START, Joints(END.a, END.b + end, END.c)),
            sides_of({"ruckig": lambda: ruckig(*ends), "toppra": lambda: toppra(ends)}, left_out),
        ),
        _contest(
            "a straight line of the gripper",
            mechanism,
            straight,
            lambda end: Path.line(FROM, TO._replace(z=TO.z + end)),
            sides_of({"toppra": lambda: toppra(line)}, left_out),
        ),
    ]


def _line(mechanism: Mechanism) -> Floats:
    shares = np.linspace(0.0, 1.0, KNOTS)[:, np.newaxis]
    points = np.array(FROM) + shares * np.subtract(TO, FROM)
    return mechanism.ik_many(points)


def _contest(work: str, mechanism: Mechanism, path: Path, near: Callable[[float], Path], others: list[Side]) -> Contest:
    def timed() -> Floats:
        return np.array([plan(lay(path, mechanism, UNITS, LIMITS), LIMITS, UNITS).duration])

    workspace, planner = Workspace.of(CONFIG), Planner(CONFIG, mechanism)
    numbers = count(1)

    def proven() -> Floats:
        """Plan a path that is another one every time: the planner remembers those that it has planned."""
        found = planner.plan(workspace, near(next(numbers) * 1e-7), 1.0)
        assert found.move is not None
        return np.array([found.move.duration])

    ours = [Side(OURS, timed, spent(timed, 20)), Side(PROVEN, proven, spent(proven, 20))]
    return Contest("timing", work, "µs", "s", DIFFERENT * float(timed()[0]), [*ours, *others])


def ruckig(start: Floats, end: Floats) -> Side:
    """Return ruckig's move from rest to rest, all axes along one straight line, without a limit of the jerk."""
    module = peer("ruckig", "ruckig")
    asked: Any = module.InputParameter(3)
    asked.current_position, asked.target_position = start.tolist(), end.tolist()
    asked.max_velocity = SPEED.tolist()
    asked.max_acceleration = ACCELERATION.tolist()
    asked.synchronization = module.Synchronization.Phase
    solver: Any = module.Ruckig(3)
    found: Any = module.Trajectory(3)

    def work() -> None:
        result = solver.calculate(asked, found)
        assert result.value >= 0, f"ruckig says {result}"

    def answer() -> Floats:
        work()
        times = np.linspace(0.0, found.duration, 500)
        places, speeds, _ = (np.array(column) for column in zip(*map(found.at_time, times.tolist()), strict=True))
        must_keep(places, speeds, start, end)
        return np.array([found.duration])

    return Side("ruckig", answer, spent(work, 20))


def toppra(knots: Floats) -> Side:
    """Return toppra's parametrization of a spline through `knots` (n, 3) [rad, m, m]."""
    algorithms, module = peer("toppra.algorithm", "toppra"), peer("toppra", "toppra")
    constraints = peer("toppra.constraint", "toppra")
    module.setup_logging("ERROR")
    limits = [
        constraints.JointVelocityConstraint(np.stack((-SPEED, SPEED), axis=1)),
        constraints.JointAccelerationConstraint(np.stack((-ACCELERATION, ACCELERATION), axis=1)),
    ]
    way = np.linspace(0.0, 1.0, len(knots))

    def work() -> Any:
        instance = algorithms.TOPPRA(
            limits, module.SplineInterpolator(way, knots), parametrizer="ParametrizeConstAccel"
        )
        found = instance.compute_trajectory()
        assert found is not None, "toppra found no motion"
        return found

    def answer() -> Floats:
        found = work()
        times = np.linspace(0.0, found.duration, 500)
        must_keep(found(times), found(times, 1), knots[0], knots[-1])
        return np.array([found.duration])

    return Side("toppra", answer, spent(work, 3))


def must_keep(places: Floats, speeds: Floats, start: Floats, end: Floats) -> None:
    assert np.abs(places[0] - start).max() < NEAR, "it does not begin at the start"
    assert np.abs(places[-1] - end).max() < NEAR, "it does not end at the end"
    assert (np.abs(speeds) <= STRICT * SPEED).all(), "it is faster than an axis may be"
