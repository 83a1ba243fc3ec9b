"""Geometric paths as they are asked for, and a verdict on each by looking at many of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from math import hypot
from typing import Literal, NamedTuple

import numpy as np

from tests.judge.mechanism import Floats, Frame, from_cylinder, joints_at, margins
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


class Piece(NamedTuple):
    """A line or a parabola by its control points (3, 3), in the coordinates of its way.

    `width` is what its parameter runs over, so that the way's derivative is the same before and behind a blend;
    `sharp` is True where it ends at a corner, or at the end of the way.
    """

    points: Floats
    width: float
    sharp: bool


@dataclass(frozen=True, slots=True)
class Way:
    """A path as it is asked for: straight legs in one space, corners cut by parabolas.

    Waypoints are in the coordinates of `space`: a, b, c; or x, y, z; or a, d, z [rad, m]. A corner with a blend is left
    so long before the waypoint and met so long behind it [m] (an angle counts at 1 m in joints, at the leg's mean
    radius in cylindrical coordinates), at most half of a leg that has corners at both ends, or all of one that has not.
    """

    space: Space
    waypoints: tuple[tuple[float, float, float], ...]
    blends: tuple[float, ...] = ()

    def pieces(self) -> list[Piece]:
        """Return all lines and parabolas, in order."""
        corners, cuts, lengths = np.array(self.waypoints), self._cuts(), self._lengths()
        pieces: list[Piece] = []
        for leg, (one, two) in enumerate(pairwise(corners)):
            behind, before = cuts[leg][1], cuts[leg + 1][0]
            begin, end = one + behind * (two - one), two + before * (one - two)
            if behind + before < 1.0 - 1e-12:
                line = np.array((begin, 0.5 * (begin + end), end))
                pieces.append(Piece(line, (1.0 - behind - before) * lengths[leg], before == 0.0))
            if before > 0.0:
                onward = two + cuts[leg + 1][1] * (corners[leg + 2] - two)
                pieces.append(Piece(np.array((end, two, onward)), 2.0 * before * lengths[leg], sharp=False))
        return pieces

    def _cuts(self) -> list[tuple[float, float]]:
        """Return which share of the legs before and behind each waypoint its blend takes."""
        lengths = self._lengths()
        cuts = [(0.0, 0.0)]
        for via, blend in enumerate(self.blends or (0.0,) * (len(self.waypoints) - 2), start=1):
            before, behind = lengths[via - 1], lengths[via]
            most = (before if via == 1 else 0.5 * before, behind if via == len(lengths) - 1 else 0.5 * behind)
            reach = min(blend, *most)
            cuts.append((reach / before, reach / behind) if reach > 0.0 else (0.0, 0.0))
        return [*cuts, (0.0, 0.0)]

    def _lengths(self) -> list[float]:
        return [self._length(*ends) for ends in pairwise(self.waypoints)]

    def _length(self, one: tuple[float, float, float], two: tuple[float, float, float]) -> float:
        across, second, third = (there - here for here, there in zip(one, two, strict=True))
        return hypot(across * (0.5 * (one[1] + two[1]) if self.space == "cylindrical" else 1.0), second, third)

    def joints(self, frame: Frame, piece: Piece, shares: Floats) -> Floats:
        """Return the joints (n, 3) at shares (n,) of one of `pieces`."""
        rest, share = (1.0 - shares)[:, None], shares[:, None]
        first, control, last = piece.points
        places = rest * rest * first + 2.0 * rest * share * control + share * share * last
        if self.space == "joint":
            return places
        return joints_at(frame, places if self.space == "cartesian" else from_cylinder(places))


def drawn(frame: Frame, way: Way, samples: int = SAMPLES) -> Floats:
    """Return the joints (m, 3) of about `samples` points of the way, as many on every line and parabola."""
    pieces = way.pieces()
    shares = np.linspace(0.0, 1.0, max(2, samples // len(pieces)), endpoint=False)
    joints = [way.joints(frame, piece, shares) for piece in pieces]
    return np.concatenate([*joints, way.joints(frame, pieces[-1], np.ones(1))])


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
