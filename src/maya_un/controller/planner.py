"""Check every motion, jogs included, and plan it, with a controller or without one.

The distance of a jog is found in two steps. Places along the line show where it leaves the workspace. Then the way
there is proved like every path (`maya_un.motion.proof`). Only the proof detects a zone thinner than the distance
between places. Then bisection on the proof itself finds the end: if the way to a place is proved, so is the way to
every nearer place.

Without a controller, the preview equals the real motion.

In a worker (`maya_un.workers`) `prepare` creates one planner, which the functions of this module use.

Motions of the controller layer are planned in this process, or in a worker, so that planning never blocks the loop.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Generator
from dataclasses import dataclass
from functools import lru_cache
from math import cos, inf, pi, sin
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dmc41x3.i18n import phrase
from maya_un.axes import AXES, JOG_AXES
from maya_un.config import Config, Units
from maya_un.controller.command_slot import RunningCommand
from maya_un.controller.protocol import Inspection, Preview, inspect
from maya_un.controller.seek import SETTLE
from maya_un.errors import InvalidValue, PathRefused, TrajectoryRefused, UnknownName, Unreachable
from maya_un.kinematics.mechanism import Floats, Mechanism
from maya_un.kinematics.workspace import Reason, Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.clearance import extremes
from maya_un.motion.emergency import Emergency, emergency_speed
from maya_un.motion.move import CoordinatedMove, Knots, divided, lay
from maya_un.motion.path import Path, Route, Space
from maya_un.motion.profile import Limits
from maya_un.motion.proof import prove
from maya_un.motion.timing import plan
from maya_un.schema.robot import Jogged
from maya_un.values import FARTHEST, LEAST_SPEED, WITHIN, JogDirection, Joints, Point
from maya_un.workers import Workers, WorkResult

MOST_SEGMENTS = 511
"""Capacity of the controller's buffer of coordinated segments (Galil LM); a motion is sent whole before it begins."""

REMEMBERED = 8192
"""Number of cached previews: a job's legs are checked before it starts and again before each leg."""

AT_HAND = 2048
"""Number of cached plans: a job of 1 300 tasks need not plan again what it has previewed. After homing has measured the
strokes, a cached plan need only be proved again. Plans are arrays, some 13 kB each.
"""

START_TOLERANCE = (1e-3, 1e-4, 1e-4)
"""Greatest distance of a path's start from the robot's position (rad, m, m)."""

SHORT = 20_000.0
"""Longest chord where the speed is reduced [counts]: 20 mm of a line."""

_COARSER = (1.0, 2.0, 4.0)
_ENDLESS = (-inf, inf)


@dataclass(frozen=True, slots=True, eq=False)
class MotionPlan:
    """The knots of a path in whole counts, as joints of shape (n, 3) [rad, m, m], and the move through them.

    `move` is None if the path has no length.
    """

    knots: Floats
    move: CoordinatedMove | None

    @property
    def end(self) -> Joints:
        """Its end (rad, m, m)."""
        a, b, c = self.knots[-1].tolist()
        return Joints(a, b, c)


class _Timed(NamedTuple):
    """A plan that is not proved yet, and further knots to prove if its chords had to be divided, else None."""

    plan: MotionPlan
    between: Floats | None


class Planner:
    """Checks paths against a workspace and times them. Results are cached."""

    def __init__(self, config: Config, mechanism: Mechanism) -> None:
        self._limits = Limits.of(config)
        self._units = Units.of(config)
        a, b, c = self._units.per_unit
        self._grain = 1.0 / a, 1.0 / b, 1.0 / c
        self._mechanism = mechanism
        self._emergency = Emergency.of(config)
        self._laid = lru_cache(maxsize=AT_HAND)(self._lay)
        self._timed = lru_cache(maxsize=AT_HAND)(self._time)
        self._planned = lru_cache(maxsize=AT_HAND)(self._plan)
        self._told = lru_cache(maxsize=AT_HAND)(self._tell)
        self._previewed = lru_cache(maxsize=REMEMBERED)(self._preview)

    def plan(self, workspace: Workspace, route: Route, speed: float) -> MotionPlan:
        """Return the plan of a route at `speed` (above 0 up to 1, of the limits).

        Raises `InvalidValue`, `Unreachable`, `PathRefused`, and `TrajectoryRefused` for more segments than the
        controller can hold.
        """
        return self._planned(workspace, self._path(route), self._speed(speed))

    def preview(self, workspace: Workspace, route: Route, speed: float) -> Preview:
        """Return the preview of the motion along a route; raises as `plan` does."""
        return self._previewed(workspace, self._path(route), self._speed(speed))

    def prove(self, workspace: Workspace, route: Route) -> None:
        """Check a route without timing it; raises `Unreachable`, `PathRefused` as `plan` does."""
        self._prove(workspace, self._path(route), 1.0)

    def inspect(self, workspace: Workspace, route: Route, speed: float, samples: int) -> Inspection | None:
        """Return the details of the motion along a route, None if it has no length; raises as `plan` does."""
        planned = self.plan(workspace, route, speed)
        if planned.move is None:
            return None
        return inspect(workspace, planned.knots, planned.move, samples)

    def begun_at(self, route: Route, here: Joints) -> Path:
        """Return the route starting exactly at `here`; raises `TrajectoryRefused` if it starts somewhere else."""
        path = self._path(route)
        for axis, start, place, tolerance in zip(AXES, path.start(self._mechanism), here, START_TOLERANCE, strict=True):
            if not abs(start - place) <= tolerance:
                reason = phrase(
                    "it starts at {axis} = {start:.4f}, the robot is at {place:.4f}",
                    axis=axis,
                    start=start,
                    place=place,
                )
                raise TrajectoryRefused(reason=reason)
        return path.begun_at(self._mechanism, here)

    @staticmethod
    def _path(route: Route) -> Path:
        path = route if isinstance(route, Path) else Path.joints(*route)
        require_size(path)
        return path

    @staticmethod
    def _speed(speed: float) -> float:
        if not LEAST_SPEED <= speed <= 1.0:
            raise InvalidValue(
                key="speed", value=speed, reason=phrase("it must lie from {least:g} to 1", least=LEAST_SPEED)
            )
        return speed

    def _plan(self, workspace: Workspace, path: Path, speed: float) -> MotionPlan:
        needed = 0
        for coarseness in _COARSER:
            self._prove(workspace, path, coarseness)
            plan, between = self._timed(workspace.zones, path, speed, coarseness)
            if between is not None:
                prove(workspace, between)  # once more: the new knots are rounded to counts as well
            needed = 0 if plan.move is None else len(plan.move.segments)
            if needed <= MOST_SEGMENTS:
                return plan
        reason = phrase(
            "it needs {needed} segments, the controller's buffer holds {most} segments",
            needed=needed,
            most=MOST_SEGMENTS,
        )
        raise TrajectoryRefused(reason=reason)

    def _lay(self, path: Path, coarseness: float) -> tuple[Knots, Floats]:
        """Return the knots of a path, and the same as joints (n, 3) [rad, m, m]."""
        knots = lay(path, self._mechanism, self._units, self._limits, coarseness)
        return knots, self._joints(knots)

    def _joints(self, knots: Knots) -> Floats:
        return knots.counts / np.array(self._units.per_unit)

    def _time(self, zones: tuple[Zone, ...], path: Path, speed: float, coarseness: float) -> _Timed:
        """Return the move along a path, nowhere so fast that a fault could do harm beside it.

        The strokes of the axes do not matter here, because the proof checks them.
        """
        knots, joints = self._laid(path, coarseness)
        wide = Workspace(self._mechanism, _ENDLESS, _ENDLESS, _ENDLESS, inf, self._grain, zones)
        per_unit, here, slowed = np.array(self._units.per_unit)[:, np.newaxis], joints, False

        def safely(directions: Floats, braking: float, requested: Floats) -> Floats:
            nonlocal slowed
            found = emergency_speed(wide, self._emergency, here, directions / per_unit, braking, requested)
            slowed = slowed or bool((found < requested).any())
            return found

        move = plan(knots, self._limits, self._units, speed, safely=safely, coarseness=coarseness)
        if slowed:  # only where a fault could do harm: shorter chords
            knots = divided(knots, SHORT)
            here = self._joints(knots)
            move = plan(knots, self._limits, self._units, speed, safely=safely, coarseness=coarseness)
        return _Timed(MotionPlan(joints, move if len(move.segments) else None), here if slowed else None)

    def _prove(self, workspace: Workspace, path: Path, coarseness: float) -> None:
        """Prove every chord between the knots of a path."""
        knots, joints = self._laid(path, coarseness)
        if path.space is not Space.JOINT:
            workspace.require(path.end(self._mechanism))
            if not np.isfinite(knots.exact).all():
                raise PathRefused(target=_text(path), reason="its lines would have to meet above their anchors")
        boom = joints[:, 0]
        if path.space is Space.CARTESIAN and (np.abs(boom[1:] - boom[:-1]) > pi).any():
            raise PathRefused(
                target=_text(path),
                reason="it crosses the end of the boom's range, so the boom would have to turn all the way back",
            )
        vias = range(1, len(joints) - 1) if path.is_joint else ()
        prove(workspace, joints, vias)

    def _preview(self, workspace: Workspace, path: Path, speed: float) -> Preview:
        return self._told(self._planned(workspace, path, speed))

    def _tell(self, planned: MotionPlan) -> Preview:
        low, high = extremes(self._mechanism, planned.knots)
        return Preview(
            duration=0.0 if planned.move is None else planned.move.duration + SETTLE,
            lowest=low.z,
            highest=high.z,
            end=planned.end,
            vias=() if planned.move is None else planned.move.via_times(),
        )


def require_size(path: Path) -> None:
    """Raise `TrajectoryRefused` for a path with more points than the controller can hold."""
    if len(path.waypoints) > MOST_SEGMENTS:
        reason = phrase(
            "it has {count} points, the controller's buffer holds {most} segments",
            count=len(path.waypoints),
            most=MOST_SEGMENTS,
        )
        raise TrajectoryRefused(reason=reason)


def _text(path: Path) -> str:
    return "(" + ", ".join(f"{value:.4f}" for value in path.waypoints[-1]) + ")"


MARGIN = 5e-4
"""Distance before a limit at which a jog that the limit ends comes to rest (rad or m)."""

TOLERANCE = 1e-4
"""Accuracy of the search for the limit (rad or m)."""

LONGEST = 10.0
"""Upper bound of the ways in any workspace (rad or m)."""

_PLACES = 512


@dataclass(frozen=True, slots=True)
class JogLine:
    """The line of a jog from the robot's position: places on it by the way along it (rad or m)."""

    here: Joints
    start: tuple[float, float, float]
    direction: tuple[float, float, float]
    in_space: bool

    @classmethod
    def along(cls, axis: JogDirection, here: Joints, mechanism: Mechanism) -> JogLine:
        """Return the line of one of `JOG_AXES`, or along a unit vector, through `here`; raises `UnknownName`."""
        if not isinstance(axis, str):
            x, y, z = mechanism.fk(here)
            return cls(here, (x, y, z), axis, in_space=True)
        if axis in AXES:
            a, b, c = (float(axis == one) for one in AXES)
            return cls(here, (here.a, here.b, here.c), (a, b, c), in_space=False)
        directions = {
            "x": (1.0, 0.0, 0.0),
            "y": (0.0, 1.0, 0.0),
            "z": (0.0, 0.0, 1.0),
            "r": (sin(here.a), cos(here.a), 0.0),
        }
        if axis not in directions:
            raise UnknownName(name=axis, known=", ".join(JOG_AXES))
        x, y, z = mechanism.fk(here)
        return cls(here, (x, y, z), directions[axis], in_space=True)

    def at(self, way: float) -> Joints | Point:
        """Return the place `way` along the line: joints, or a point."""
        one, two, three = (start + way * share for start, share in zip(self.start, self.direction, strict=True))
        return Point(one, two, three) if self.in_space else Joints(one, two, three)

    def path(self, way: float, mechanism: Mechanism) -> Path:
        """Return the path to the place `way` along the line."""
        there = self.at(way)
        if isinstance(there, Joints):
            return Path.joints(self.here, there)
        return Path.line(Point(*self.start), there).begun_at(mechanism, self.here)

    def reached(self, workspace: Workspace, ways: Floats) -> NDArray[np.bool_]:
        """Return which of the ways along the line (n,) end in the workspace, shape (n,)."""
        places = np.array(self.start) + ways[:, np.newaxis] * np.array(self.direction)
        return workspace.reachable_many(places) if self.in_space else workspace.contains_many(places)


class Jogging:
    """Computes the distance of a jog, by the check of all motion."""

    def __init__(self, planner: Planner, mechanism: Mechanism) -> None:
        self._planner = planner
        self._mechanism = mechanism

    def path(self, axis: JogDirection, here: Joints, way: float) -> Path:
        """Return the path of a jog; raises `UnknownName`, and `InvalidValue` for an invalid way."""
        return JogLine.along(axis, here, self._mechanism).path(_sensible(way), self._mechanism)

    def within(self, workspace: Workspace, axis: JogDirection, here: Joints, way: float) -> Jogged:
        """Return how far of `way` (rad or m) the workspace allows, and the limit that ends it.

        Raises `UnknownName`, `InvalidValue`, and `Unreachable` if the robot is outside the workspace.
        """
        line = JogLine.along(axis, here, self._mechanism)
        wanted = max(-LONGEST, min(LONGEST, _sensible(way)))
        if wanted == way and self._refusal(workspace, line, wanted) is None:
            return Jogged(name_of(axis), way)
        self._planner.prove(workspace, line.path(0.0, self._mechanism))
        good, bad = self._edge(workspace, line, wanted)
        if good and self._refusal(workspace, line, good) is not None:
            good, bad = _halved(lambda s: self._refusal(workspace, line, s) is None, 0.0, good)
        reason = workspace.why_not(line.at(bad)) or self._refusal(workspace, line, bad)
        kept = max(0.0, abs(good) - MARGIN)
        limit = reason.limit.value if isinstance(reason, Reason) else "path"
        return Jogged(name_of(axis), kept if wanted > 0.0 else 0.0 - kept, limit, str(reason))

    def _edge(self, workspace: Workspace, line: JogLine, wanted: float) -> tuple[float, float]:
        """Return the last way along the line before it leaves the workspace, and one beyond it."""
        ways = np.linspace(0.0, wanted, _PLACES + 1)[1:]
        outside = np.flatnonzero(~line.reached(workspace, ways))
        if not len(outside):
            return wanted, wanted
        first = int(outside[0])
        last = float(ways[first - 1]) if first else 0.0
        return _halved(lambda s: workspace.why_not(line.at(s)) is None, last, float(ways[first]))

    def _refusal(self, workspace: Workspace, line: JogLine, way: float) -> PathRefused | Unreachable | None:
        try:
            self._planner.prove(workspace, line.path(way, self._mechanism))
        except (PathRefused, Unreachable) as refusal:
            return refusal
        return None


def name_of(direction: JogDirection) -> str:
    """Return the name of the direction of a jog, "" for a vector."""
    return direction if isinstance(direction, str) else ""


def _halved(good_at: Callable[[float], bool], good: float, bad: float) -> tuple[float, float]:
    """Return two ways closer than `TOLERANCE`: the first passes `good_at`, the second does not."""
    while abs(bad - good) > TOLERANCE:
        middle = 0.5 * (good + bad)
        if good_at(middle):
            good = middle
        else:
            bad = middle
    return good, bad


def _sensible(way: float) -> float:
    if not abs(way) <= FARTHEST:
        raise InvalidValue(key="distance", value=way, reason=WITHIN)
    return way


T = TypeVar("T")

_WORKSPACES = 4


class OfflineMachine:
    """A machine of `config` in a `workspace`, for planning without a controller."""

    def __init__(self, config: Config, workspace: Workspace, planner: Planner) -> None:
        self.config = config
        self.workspace = workspace
        self._planner = planner

    @property
    def mechanism(self) -> Mechanism:
        """Geometry of the machine."""
        return self.workspace.mechanism

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would; raises the errors of that motion."""
        return self._planner.preview(self.workspace, path, speed)

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None if it has no length; raises as `preview` does."""
        return self._planner.inspect(self.workspace, path, speed, samples)


class PlannerCache:
    """Caches a planner, and the result of `made` for each recently used workspace."""

    def __init__(self, config: Config) -> None:
        self.config = config
        mechanism = Mechanism.of(config)
        self.planner = Planner(config, mechanism)
        self.jogging = Jogging(self.planner, mechanism)
        self._made: OrderedDict[tuple[object, Workspace], Any] = OrderedDict()

    def on(self, workspace: Workspace, made: Callable[[OfflineMachine], T]) -> T:
        """Return the result of `made` for a workspace, cached."""
        key = (made, workspace)
        found = self._made.pop(key, None)
        if found is None:
            found = made(OfflineMachine(self.config, workspace, self.planner))
        self._made[key] = found
        while len(self._made) > _WORKSPACES:
            self._made.popitem(last=False)
        return found


_drawers: list[PlannerCache] = []


def prepare(config: Config) -> None:
    """Create the cache of this process."""
    _drawers[:] = [PlannerCache(config)]


def drawer() -> PlannerCache:
    """Return the cache of this process."""
    return _drawers[0]


def plan_offline(workspace: Workspace, route: Route, speed: float) -> Generator[None, None, MotionPlan]:
    """Return the plan of a route; raises as `Planner.plan` does."""
    yield
    return drawer().planner.plan(workspace, route, speed)


def jogged(workspace: Workspace, axis: JogDirection, here: Joints, way: float) -> Generator[None, None, Jogged]:
    """Return how far of a way along an axis the workspace allows; raises as `Jogging.within` does."""
    yield
    return drawer().jogging.within(workspace, axis, here, way)


OWN = "motion"
"""Principal of the robot's own plans, for the worker's scheduler."""


class Planning:
    """Plans by `planner` and `jogging`, in `workers` if they are not None."""

    def __init__(self, planner: Planner, jogging: Jogging, workers: Workers | None) -> None:
        self._planner = planner
        self._jogging = jogging
        self._workers = workers

    async def plan(self, command: RunningCommand, workspace: Workspace, route: Route, speed: float) -> MotionPlan:
        """Return the plan of a route for `command`.

        Raises as `Planner.plan`, the error that ends the command, and `WorkerFailed`.
        """
        if self._workers is None:
            return self._planner.plan(workspace, route, speed)
        return await _unless_ended(command, self._workers.run(plan_offline, workspace, route, speed, whose=OWN))

    async def jogged(
        self, command: RunningCommand, workspace: Workspace, axis: JogDirection, here: Joints, way: float
    ) -> Jogged:
        """Return how far a jog goes.

        Raises as `Jogging.within`, the error that ends the command, and `WorkerFailed`.
        """
        if self._workers is None:
            return self._jogging.within(workspace, axis, here, way)
        return await _unless_ended(command, self._workers.run(jogged, workspace, axis, here, way, whose=OWN))


async def _unless_ended(command: RunningCommand, work: Coroutine[Any, Any, WorkResult[T]]) -> T:
    """Return the result of work; a stop does not wait for it."""
    task = asyncio.ensure_future(work)
    try:
        await command.wait(inf, task)
        return task.result().value
    finally:
        task.cancel()
