"""The cost of planning a motion, its time beside the least that physics allows, and its deviation from its path.

The bounds are another programme's: `tests/lower_bound.py` knows the axes' limits and the shape of the way, and nothing
of how it is driven. Durations are those of the axes themselves, from the first that moves to the last that stops, as
the twin's mechanics recorded them; grips and pauses between motions count on neither side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, sin, sqrt
from random import Random

import numpy as np
from harness import Case, Figure, Goal, measure, report, timed

from dmc41x3.loops import run_virtual
from maya_un.config import Config
from maya_un.controller.controller import GalilController
from maya_un.controller.planner import Planner
from maya_un.controller.seek import SETTLE
from maya_un.kinematics import Workspace
from maya_un.motion.path import Path
from maya_un.robot.plan_builder import PlanBuilder, Pose, TravelAction
from maya_un.robot.primitives.pick import Pick
from maya_un.robot.primitives.place import Place
from maya_un.robot.robot import MayaRobot
from maya_un.testing import Rig
from maya_un.values import GripperState, Joints, Point
from tests.judge.mechanism import Floats, places
from tests.judge.paths import Cut, Way, deviations, drawn
from tests.judge.trajectory import Trajectory
from tests.lower_bound import least_time_of
from tests.machines import Machine, homed
from tests.virtual_time import elapse

PLANS = 64
"""Different motions are planned in turn: more than a planner remembers."""

REST = 0.1
"""After so long the axes are at rest that follow what has ended [s]."""

MACHINE = Machine.of(Config())
START = Joints(0.5, 1.5, 1.5)


@dataclass(frozen=True, slots=True)
class Standard:
    """A motion that the twin went along: its ways, how long its axes moved [s], how far they were off [m]."""

    name: str
    ways: tuple[Way, ...]
    duration: float
    off: float

    def bound(self) -> float:
        """Return the least time along its ways [s]."""
        return sum(least_time_of(MACHINE.frame, way, MACHINE.rates) for way in self.ways)

    def one_axis_at_a_time(self) -> float:
        """Return how long it takes with every axis for itself and a stop at every waypoint, the confirmation included.

        That is a trapezoid for each axis, and the longest of the three for each leg [s].
        """
        return sum(_leg(one, two) + SETTLE for way in self.ways for one, two in pairwise(_waypoints(way)))


def _waypoints(way: Way) -> Floats:
    sharp = Way(way.space, way.waypoints)
    legs = sharp.pieces()
    starts = [sharp.joints(MACHINE.frame, leg, np.zeros(1)) for leg in legs]
    return np.concatenate([*starts, sharp.joints(MACHINE.frame, legs[-1], np.ones(1))])


def _leg(one: Floats, two: Floats) -> float:
    rates = MACHINE.rates
    return max(
        _trapezoid(abs(float(there - here)), rates.speed[axis], rates.acceleration[axis], rates.deceleration[axis])
        for axis, (here, there) in enumerate(zip(one, two, strict=True))
    )


def _trapezoid(way: float, speed: float, up: float, down: float) -> float:
    ramps = 0.5 * speed * speed * (1.0 / up + 1.0 / down)
    if way >= ramps:
        return (way - ramps) / speed + speed / up + speed / down
    peak = sqrt(2.0 * way / (1.0 / up + 1.0 / down))
    return peak / up + peak / down


def _way(path: Path) -> Way:
    return Way(path.space.value, path.waypoints, tuple(Cut(*blend) for blend in path.blends))


def _at(a: float, d: float, z: float) -> Point:
    return Point(d * sin(a), d * cos(a), z)


def paths(controller: GalilController) -> dict[str, list[Path]]:
    """Return the standard motions, each from `START` on; one after the other where it is more than one path."""
    here = controller.mechanism.fk(START)
    a, d = START.a, sqrt(here.x**2 + here.y**2)
    corner, end = _at(1.2, 1.0, 1.0), _at(1.6, 1.7, 0.8)
    return {
        "line": [Path.line(here, end)],
        "lines with a blend": [Path.line(here, corner, end, blend=0.1)],
        "lift of 0.1 m": [Path.line(here, here._replace(z=here.z + 0.1))],
        "joint move": [Path.joints(START, Joints(1.6, 1.0, 1.9))],
        "swing": [Path.swing((a, d, here.z), (1.8, 1.6, 0.9))],
        "pick and place": _pick_and_place(controller, _at(0.9, 1.0, 0.4), _at(1.7, 1.5, 0.4)),
    }


def _pick_and_place(controller: GalilController, source: Point, target: Point) -> list[Path]:
    builder = PlanBuilder(controller, Pose(START, GripperState.OPEN))
    Pick(source).plan(builder)
    Place(target).plan(builder)
    return [action.path for action in builder.build().actions if isinstance(action, TravelAction)]


async def carried_out() -> list[Standard]:
    """Have a twin go along every standard motion at full speed, and return what its mechanics saw."""
    async with homed(MACHINE, START) as bench:
        standard = paths(bench.controller)
    found: list[Standard] = []
    for name, legs in standard.items():
        async with homed(MACHINE, START) as bench:
            moved = [await _followed(bench, path) for path in legs]
        durations, offs = zip(*moved, strict=True)
        found.append(Standard(name, tuple(map(_way, legs)), sum(durations), max(offs)))
    return found


async def _followed(bench: Rig, path: Path) -> tuple[float, float]:
    """Return how long the axes moved along a path [s], and how far the gripper was off it at most [m]."""
    await elapse(REST)
    bench.virtual.sync()
    mark = bench.mechanics.now
    await bench.controller.follow(path)
    await elapse(REST)
    bench.virtual.sync()
    trajectory = Trajectory.of(bench.mechanics.record.trace, mark)
    begun, over = trajectory.moving()
    way = places(MACHINE.frame, drawn(MACHINE.frame, _way(path), 2_000))
    return over - begun, float(deviations(places(MACHINE.frame, trajectory.finer(2e-3)), way).max())


def motions(standards: Sequence[Standard]) -> Iterator[Case]:
    """Yield every motion with the two that it is compared with, and how far it was off its way."""
    for standard in standards:
        bound, alone, name = standard.bound(), standard.one_axis_at_a_time(), standard.name
        yield Case(f"{name}: least time", _known(bound), "s")
        yield Case(f"{name}: each axis alone", _known(alone), "s")
        yield Case(f"{name}: carried out", _known(standard.duration), "s", Goal(1.02, to=f"{name}: least time"))
        yield Case(f"{name}: off its way", _known(standard.off), "mm", Goal(0.5))


def _known(value: float) -> Callable[[], float]:
    return lambda: value


def legs_and_lines() -> list[Case]:
    """Return what a move in the joints and a straight line of 1 to 2 m cost: each a new one, which no planner knows."""
    workspace = Workspace.of(MACHINE.config)
    planner = Planner(MACHINE.config, workspace.mechanism)
    rng = Random(1)

    def leg() -> None:
        planner.plan(workspace, Path.joints(START, Joints(rng.uniform(1.2, 1.8), 1.0, rng.uniform(1.7, 1.9))), 1.0)

    def line() -> None:
        ends = _at(rng.uniform(0.3, 0.8), 1.0, 0.5), _at(rng.uniform(1.2, 1.8), 1.6, 0.9)
        planner.plan(workspace, Path.line(*ends), 1.0)

    return [
        Case("a leg, planned and checked", timed(leg, PLANS), "ms", Goal(0.1)),
        Case("a line, planned and checked", timed(line, PLANS), "ms", Goal(0.3)),
    ]


def skills(robot: MayaRobot) -> Case:
    """Return what a pick and a place cost to work out, whose ways are six legs; the targets are new every time."""
    rng = Random(2)

    def both() -> None:
        pose = Pose(START, GripperState.OPEN)
        for skill in (Pick, Place):
            pose = robot.preview(skill(_at(rng.uniform(0.6, 1.9), rng.uniform(0.9, 1.6), 0.4)), pose).end

    return Case("pick and place, planned and checked", timed(both, 16), "ms", Goal(5.0))


async def _figures() -> list[Figure]:
    standards = await carried_out()
    compared = measure(list(motions(standards)), rounds=1)
    async with homed(MACHINE, START) as bench:
        robot = MayaRobot(bench.controller, MACHINE.config)
        return [*measure([*legs_and_lines(), skills(robot)], rounds=9), *compared]


def main() -> None:
    report(run_virtual(_figures()))


if __name__ == "__main__":
    main()
