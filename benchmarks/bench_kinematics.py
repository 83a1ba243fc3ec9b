"""How fast the mechanism and the planning of a move are: `python benchmarks/bench_kinematics.py`.

Ratios compare with work of the same run, so that they mean the same on every machine.
"""

from __future__ import annotations

from collections.abc import Callable
from timeit import Timer

import numpy as np

from maya_un.config import Config, Units
from maya_un.kinematics import Workspace
from maya_un.motion import JointPath, Limits, check_path, commands, lowest_point, plan
from maya_un.values import Point

POINTS = 1_000_000


def best(work: Callable[[], object], calls: int, rounds: int = 7) -> float:
    """Return the time of one call in the fastest of some rounds [s]."""
    return min(Timer(work).repeat(rounds, calls)) / calls


def single_calls(workspace: Workspace) -> None:
    """Time one call with limit checks (goal: IK and FK 2 µs at most)."""
    point = Point(0.5, 1.2, 0.4)
    joints = workspace.ik(point)
    for name, work in (
        ("IK with limit checks", lambda: workspace.ik(point)),
        ("FK with limit checks", lambda: workspace.fk(joints)),
        ("a refusal's nearest place", lambda: workspace.nearest(Point(0.1, 0.1, 2.3))),
    ):
        print(f"{name:32s} {best(work, 2000) * 1e6:9.2f} µs")


def vectors(workspace: Workspace) -> None:
    """Time a million points (goal: IK at most 6 × a memcpy of the 48 MB it reads and writes)."""
    rng = np.random.default_rng(1)
    joints = rng.uniform((0.0, 1.2, 1.2), (2.0, 2.2, 2.2), (POINTS, 3))
    mechanism = workspace.mechanism
    points = mechanism.fk_many(joints)
    block = np.ones(6 * POINTS)
    copy = np.empty_like(block)
    memcpy = best(lambda: np.copyto(copy, block), 1)
    for name, work in (
        ("IK of 1e6 points", lambda: mechanism.ik_many(points)),
        ("FK of 1e6 points", lambda: mechanism.fk_many(joints)),
    ):
        took = best(work, 1)
        print(f"{name:32s} {took * 1e3:9.2f} ms  {took / memcpy:5.1f} × memcpy of 48 MB")


def planning(workspace: Workspace) -> None:
    """Time what one leg of a job costs before it can start."""
    config = Config()
    limits, units = Limits.of(config), Units.of(config)
    path = JointPath.through(*map(workspace.ik, (Point(0.5, 1.2, 0.5), Point(1.2, 0.4, 1.0))))
    move = plan(path, limits, units)
    for name, work in (
        ("proof of a leg", lambda: check_path(workspace, path)),
        ("lowest point of a leg", lambda: lowest_point(workspace.mechanism, path)),
        (f"plan of {len(move.segments)} segments", lambda: plan(path, limits, units)),
        ("its commands", lambda: commands(move)),
    ):
        print(f"{name:32s} {best(work, 200) * 1e6:9.2f} µs")


def main() -> None:
    """Print every measurement."""
    workspace = Workspace.of(Config())
    single_calls(workspace)
    vectors(workspace)
    planning(workspace)


if __name__ == "__main__":
    main()
