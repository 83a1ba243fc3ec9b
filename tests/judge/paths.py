"""Geometric paths as they are asked for, and a verdict on each by looking at many of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Literal

import numpy as np

from tests.judge.mechanism import Floats, Frame, from_cylinder, joints_at, margins, places, to_cylinder
from tests.judge.zones import Solid, clearances

Space = Literal["joint", "cartesian", "cylindrical"]

SAMPLES = 20_000
"""How many points of a path are looked at."""


class Opinion(StrEnum):
    """What many points say about a path; undecided where a limit is nearer than the width of doubt."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The opinion, and the worst of all points: `limit` by name, `margin` [m], `share` of the path's legs."""

    opinion: Opinion
    limit: str
    margin: float
    share: float


def drawn(frame: Frame, space: Space, waypoints: Floats, samples: int = SAMPLES) -> Floats:
    """Return the joints (m, 3) of about `samples` points of the path, every leg's as many, waypoints included.

    `waypoints` (n, 3) are joints, whatever the space; legs are straight in joints, in x, y, z, or in angle, radius
    and height.
    """
    if space == "joint":
        return _legs(waypoints, samples)
    points = places(frame, waypoints)
    if space == "cartesian":
        return joints_at(frame, _legs(points, samples))
    return joints_at(frame, from_cylinder(_legs(to_cylinder(points), samples)))


def _legs(waypoints: Floats, samples: int) -> Floats:
    shares = np.linspace(0.0, 1.0, max(2, samples // (len(waypoints) - 1)), endpoint=False)[:, None]
    legs = [start + shares * (end - start) for start, end in pairwise(waypoints)]
    return np.concatenate([*legs, waypoints[-1:]])


def judged(frame: Frame, joints: Floats, zones: Sequence[Solid] = (), doubt: float = 1e-6) -> Verdict:
    """Return the verdict on a path whose points are `joints` (m, 3); `doubt` is the width of doubt [m]."""
    found = margins(frame, joints) | {zone.name: clearances(frame, zone, joints, doubt) for zone in zones}
    limit, values = min(found.items(), key=lambda entry: entry[1].min())
    at, margin = int(values.argmin()), float(values.min())
    return Verdict(_opinion(margin, doubt), limit, margin, at / max(1, len(joints) - 1))


def _opinion(margin: float, doubt: float) -> Opinion:
    if abs(margin) <= doubt:
        return Opinion.UNDECIDED
    return Opinion.INSIDE if margin > 0.0 else Opinion.OUTSIDE


def deviations(points: Floats, line: Floats) -> Floats:
    """Return how far points (n, k) are from the polyline through `line` (m, k), shape (n,)."""
    starts, ways = line[:-1], np.diff(line, axis=0)
    squares = np.maximum((ways * ways).sum(axis=1), 1e-300)
    blocks = np.array_split(points, max(1, len(points) * len(line) // 200_000))
    return np.concatenate([_to_segments(block, starts, ways, squares) for block in blocks])


def _to_segments(points: Floats, starts: Floats, ways: Floats, squares: Floats) -> Floats:
    apart = points[:, None, :] - starts[None, :, :]
    shares = np.clip((apart * ways).sum(axis=2) / squares, 0.0, 1.0)
    return np.asarray(np.sqrt(((apart - shares[:, :, None] * ways) ** 2).sum(axis=2)).min(axis=1))
