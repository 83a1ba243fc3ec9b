"""The mechanism and the planning of a move, against a copy of the memory that a million points fill."""

from __future__ import annotations

import numpy as np
from harness import Case, Goal, measure, report, timed

from maya_un.config import Config, Units
from maya_un.kinematics import Workspace
from maya_un.motion import JointPath, Limits, check_path, commands, lowest_point, plan
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
    block = np.ones(6 * POINTS)
    copy = np.empty_like(block)
    return [
        Case(COPY, timed(lambda: np.copyto(copy, block)), "ms"),
        Case("IK of 1e6 points", timed(lambda: mechanism.ik_many(points)), "ms", Goal(6.0, to=COPY)),
        Case("FK of 1e6 points", timed(lambda: mechanism.fk_many(joints)), "ms"),
    ]


def planning(workspace: Workspace) -> list[Case]:
    """Return what one leg of a job costs before it can start."""
    config = Config()
    limits, units = Limits.of(config), Units.of(config)
    path = JointPath.through(*map(workspace.ik, (Point(0.5, 1.2, 0.5), Point(1.2, 0.4, 1.0))))
    move = plan(path, limits, units)
    return [
        Case("proof of a leg", timed(lambda: check_path(workspace, path), 50)),
        Case("lowest point of a leg", timed(lambda: lowest_point(workspace.mechanism, path), 50)),
        Case(f"plan of a leg ({len(move.segments)} segments)", timed(lambda: plan(path, limits, units), 50)),
        Case("its commands", timed(lambda: commands(move), 50)),
    ]


def main() -> None:
    workspace = Workspace.of(Config())
    report(measure([*single_calls(workspace), *vectors(workspace), *planning(workspace)], rounds=9))


if __name__ == "__main__":
    main()
