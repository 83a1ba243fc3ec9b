"""The mechanism and the planning of a move, against a copy of the memory that a million points fill."""

from __future__ import annotations

import numpy as np
from harness import Case, Goal, measure, report, timed

from maya_un.config import Config, Units
from maya_un.kinematics import Box, Workspace
from maya_un.motion import Limits, commands, plan
from maya_un.motion.clearance import lowest
from maya_un.motion.move import straight
from maya_un.motion.proof import prove
from maya_un.values import Point

POINTS = 1_000_000
COPY = "memcpy of 48 MB"


def single_calls(workspace: Workspace) -> list[Case]:
    """Return one call at a time, limit checks with it."""
    point = Point(0.5, 1.2, 0.4)
    joints = workspace.ik(point)
    return [
        Case("IK with limit checks", timed(lambda: workspace.ik(point), 5000), goal=Goal(2.0)),
        Case("FK with limit checks", timed(lambda: workspace.fk(joints), 5000), goal=Goal(2.0)),
        Case("a refusal's nearest place", timed(lambda: workspace.nearest(Point(0.1, 0.1, 2.3)), 200)),
    ]


def vectors(workspace: Workspace) -> list[Case]:
    """Return a million points at once; IK reads 24 MB and writes 24 MB."""
    mechanism = workspace.mechanism
    joints = np.random.default_rng(1).uniform((0.0, 1.2, 1.2), (2.0, 2.2, 2.2), (POINTS, 3))
    points = mechanism.fk_many(joints)
    inside = np.empty(POINTS, dtype=np.bool_)
    block = np.ones(6 * POINTS)
    copy = np.empty_like(block)
    return [
        Case(COPY, timed(lambda: np.copyto(copy, block)), "ms"),
        Case("IK of 1e6 points", timed(lambda: mechanism.ik_many(points)), "ms", Goal(6.0, to=COPY)),
        Case("FK of 1e6 points", timed(lambda: mechanism.fk_many(joints)), "ms"),
        Case("which of 1e6 points", timed(lambda: workspace.reachable_many(points, inside)), "ms", Goal(25.0)),
        Case("which of 1e6 joints", timed(lambda: workspace.contains_many(joints, inside)), "ms", Goal(25.0)),
    ]


def zones(workspace: Workspace) -> list[Case]:
    """Return what a zone costs: as a limit of one place, over a path's knots, and where a place beside it is wanted."""
    tower = Box("tower", Point(0.4, 0.9, 0.0), Point(0.8, 1.3, 0.6))
    guarded, point = workspace.with_zones([tower]), Point(1.2, 0.4, 0.9)
    start, end = np.array(workspace.ik(Point(0.5, 1.2, 1.0))), np.array(workspace.ik(point))
    knots = start + np.linspace(0.0, 1.0, 101)[:, None] * (end - start)
    mechanism = workspace.mechanism
    return [
        Case("IK with limit checks and a zone", timed(lambda: guarded.ik(point), 200)),
        Case("clearance of 101 knots", timed(lambda: tower.clearances(mechanism, knots), 100)),
        Case("nearest place beside a zone", timed(lambda: guarded.nearest(Point(0.6, 1.1, 0.5))), "ms"),
        Case("volume of the workspace", timed(workspace.volume), "ms"),
    ]


def planning(workspace: Workspace) -> list[Case]:
    """Return what one leg of a job costs before it can start."""
    config = Config()
    limits, units = Limits.of(config), Units.of(config)
    ends = list(map(workspace.ik, (Point(0.5, 1.2, 0.5), Point(1.2, 0.4, 1.0))))
    knots = straight(units, ends)
    move = plan(knots, limits, units)
    return [
        Case("proof of a leg", timed(lambda: prove(workspace, np.array(ends)), 50)),
        Case("lowest point of a leg", timed(lambda: lowest(workspace.mechanism, ends), 50)),
        Case(f"plan of a leg ({len(move.segments)} segments)", timed(lambda: plan(knots, limits, units), 50)),
        Case("its commands", timed(lambda: commands(move), 50)),
    ]


def main() -> None:
    workspace = Workspace.of(Config())
    report(measure([*single_calls(workspace), *vectors(workspace), *zones(workspace), *planning(workspace)], rounds=9))


if __name__ == "__main__":
    main()
