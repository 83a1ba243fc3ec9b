"""All that can be known of a motion before it starts: where it is when, how near it comes to what, how it stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from maya_un.kinematics.mechanism import Floats
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.clearance import ClosestApproach, closest
from maya_un.motion.move import CoordinatedMove, LongestStop, Trajectory, sample, stopping


@dataclass(frozen=True, slots=True)
class Closest:
    """How near a motion comes to a limit or, with `zone`, to a zone of that `name`, and when [s].

    `margin` is in `unit`: "rad", "m", or "load" for the tension of a line; negative is beyond.
    """

    name: str
    margin: float
    unit: str
    zone: bool
    time: float


@dataclass(frozen=True, slots=True)
class Inspection:
    """A motion in detail: `trajectory` are samples of it, `closest` its least margins, `stopping` its longest stop."""

    trajectory: Trajectory
    closest: tuple[Closest, ...]
    stopping: LongestStop


def inspect(workspace: Workspace, knots: Floats, move: CoordinatedMove, samples: int) -> Inspection:
    """Return the details of a move through `knots` (n, 3) [rad, m, m], with so many samples."""
    return Inspection(
        sample(move, samples),
        tuple(_timed(approach, knots, move) for approach in closest(workspace, knots)),
        stopping(move, workspace.mechanism),
    )


def _timed(approach: ClosestApproach, knots: Floats, move: CoordinatedMove) -> Closest:
    chord, share = approach.place
    steps = np.diff(knots[: chord + 2], axis=0) * np.array(move.units.per_unit)
    lengths = np.sqrt(np.sum(steps * steps, axis=1))
    way = float(np.sum(lengths[:chord]) + share * lengths[chord])
    return Closest(approach.name, approach.margin, approach.unit, approach.zone, move.profile.when(way))
