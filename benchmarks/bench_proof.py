"""The cost of a path of a hundred chords before it may begin: its proof, its margins, the speeds that faults allow."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from harness import Case, Goal, measure, report, timed

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.zones import Box, Cylinder, HalfSpace
from maya_un.motion.clearance import closest, lowest
from maya_un.motion.emergency import Emergency, emergency_speed
from maya_un.motion.proof import prove
from maya_un.values import Point

CHORDS = 100
ZONES = (
    Box("crate", Point(1.0, 1.0, 0.0), Point(1.5, 1.5, 0.4)),
    Cylinder("post", 0.2, 0.3, 0.1, 0.0, 0.3),
    HalfSpace("wall", Point(0.0, -1.0, 0.0), Point(0.0, 1.0, 0.0)),
)


def proofs(workspace: Workspace, path: Floats) -> list[Case]:
    """Return the proof of a path, alone and beside three zones, and that of a single leg."""
    fenced, leg = workspace.with_zones(ZONES), path[::CHORDS]
    return [
        Case("proof of a leg", timed(lambda: prove(workspace, leg), 50), goal=Goal(40.0)),
        Case("proof of 100 chords", timed(lambda: prove(workspace, path), 50), goal=Goal(150.0)),
        Case("proof of 100 chords, 3 zones", timed(lambda: prove(fenced, path), 20), goal=Goal(600.0)),
    ]


def margins(workspace: Workspace, path: Floats) -> list[Case]:
    """Return what a preview asks of a path."""
    fenced = workspace.with_zones(ZONES)
    return [
        Case("margins of 100 chords", timed(lambda: closest(workspace, path), 20), goal=Goal(100.0)),
        Case("margins of 100 chords, 3 zones", timed(lambda: closest(fenced, path), 20)),
        Case("lowest point of 100 chords", timed(lambda: lowest(workspace.mechanism, path), 20)),
    ]


def speeds(workspace: Workspace, path: Floats, name: str, goal: Goal | None = None) -> Case:
    """Return the emergency speeds of a path under the configuration's limits."""
    config = Config()
    per_unit = np.array(Units.of(config).per_unit)
    axes = (config.axes.a, config.axes.b, config.axes.c)
    ways = np.diff(path, axis=0) * per_unit
    ways /= np.sqrt((ways * ways).sum(axis=1, keepdims=True))
    slew = (np.array([axis.speed_counts for axis in axes]) / np.maximum(np.abs(ways), 1e-9)).min(axis=1)
    braking = float((np.array([axis.stop_deceleration_counts for axis in axes]) / np.maximum(np.abs(ways), 1e-9)).min())
    emergency, directions = Emergency.of(config), (ways / per_unit).T
    work = timed(lambda: emergency_speed(workspace, emergency, path, directions, braking, slew), 20)
    return Case(name, work, goal=goal)


def main() -> None:
    workspace = Workspace.of(Config())
    shares = np.linspace(0.0, 1.0, CHORDS + 1)
    path = workspace.mechanism.ik_many(
        np.column_stack((0.4 + 0.8 * shares, 1.2 - 0.8 * shares, np.full_like(shares, 0.5)))
    )
    radii = np.linspace(1.0, 1.6, CHORDS + 1)
    ceiling = workspace.mechanism.ik_many(
        np.column_stack((radii * sin(0.5), radii * cos(0.5), np.full_like(radii, 2.048)))
    )
    cases = [
        *proofs(workspace, path),
        *margins(workspace, path),
        speeds(workspace, path, "emergency speeds, nothing near", Goal(200.0)),
        speeds(workspace, ceiling, "emergency speeds below the ceiling"),
    ]
    report(measure(cases, rounds=9))


if __name__ == "__main__":
    main()
