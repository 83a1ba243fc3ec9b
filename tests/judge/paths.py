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

BACK = -0.99
"""Cosine of the angle between two legs beyond which a way goes back."""

_VERTICES = 4
_FARTHEST = 100

SAMPLES = 20_000
"""Number of samples of a path."""


class Opinion(StrEnum):
    """The result of many samples of a path; undecided where a limit is nearer than the width of doubt."""

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


class Cut(NamedTuple):
    """The cut of a corner: left `before` ahead of the waypoint, met `after` behind it [m].

    Meanwhile the leg before slows down evenly during the last share `fall` of the time, and the leg behind speeds up
    evenly during the first share `rise` of it.
    """

    before: float
    after: float
    fall: float = 1.0
    rise: float = 1.0


@dataclass(frozen=True, slots=True)
class Way:
    """A path as it is asked for: straight legs in one space, corners cut.

    Waypoints are in the coordinates of `space`: a, b, c; or x, y, z; or a, d, z [rad, m]. Lengths are in them too, with
    an angle at 1 m in joints, and at the leg's mean radius in cylindrical coordinates. Cuts that together take more
    than the leg between them are made smaller in the same proportion. A reversing path has no cut.
    """

    space: Space
    waypoints: tuple[tuple[float, float, float], ...]
    cuts: tuple[Cut, ...] = ()

    def pieces(self) -> list[Piece]:
        """Return all lines and parabolas, in order."""
        corners, cuts, lengths = np.array(self.waypoints), self._fitted(), self._lengths()
        pieces: list[Piece] = []
        pace = 1.0
        for leg, (one, two) in enumerate(pairwise(corners)):
            length, before = lengths[leg], cuts[leg + 1].before
            rest = length - cuts[leg].after - before
            if rest > 1e-12 * length:
                ends = one + cuts[leg].after / length * (two - one), two + before / length * (one - two)
                line = np.array((ends[0], 0.5 * (ends[0] + ends[1]), ends[1]))
                pieces.append(Piece(line, rest / pace, before == 0.0))
            if before > 0.0:
                cut, onward = cuts[leg + 1], corners[leg + 2]
                width = _drawn_out(before, cut.fall) / pace
                back, ahead = (one - two) * before / length, (onward - two) * cut.after / lengths[leg + 1]
                pieces += _cut(two, back, ahead, cut, width)
                pace = _drawn_out(cut.after, cut.rise) / width
        return pieces

    def _fitted(self) -> list[Cut]:
        """Return the cuts as they fit, with none at the ends."""
        none = Cut(0.0, 0.0)
        cuts = [none, *(self.cuts or [none] * (len(self.waypoints) - 2)), none]
        fits = [1.0] * len(cuts)
        for leg, length in enumerate(self._lengths()):
            taken = cuts[leg].after + cuts[leg + 1].before
            fit = length / taken if taken > length else 1.0
            fits[leg], fits[leg + 1] = min(fits[leg], fit), min(fits[leg + 1], fit)
        found = [Cut(fit * cut.before, fit * cut.after, *cut[2:]) for cut, fit in zip(cuts, fits, strict=True)]
        return [cut if min(cut.before, cut.after) > 0.0 and self._turns(via) else none for via, cut in enumerate(found)]

    def _turns(self, via: int) -> bool:
        """Whether there is a corner to cut: the way does not go back where it came from."""
        one, two, three = np.array(self.waypoints[via - 1 : via + 2])
        to, fro = two - one, three - two
        return float(to @ fro) >= BACK * float(np.linalg.norm(to) * np.linalg.norm(fro))

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


def _cut(corner: Floats, back: Floats, ahead: Floats, cut: Cut, width: float) -> list[Piece]:
    """Return the parabolas from `corner` + `back` to `corner` + `ahead`, over `width` in all."""

    def at(moment: float) -> Floats:
        return corner + back * _gone(1.0 - moment, cut.fall) + ahead * _gone(moment, cut.rise)

    pieces: list[Piece] = []
    for begin, end in pairwise(sorted((0.0, 1.0 - cut.fall, cut.rise, 1.0))):
        if end - begin > 1e-9:
            first, middle, last = at(begin), at(0.5 * (begin + end)), at(end)
            control = 2.0 * middle - 0.5 * (first + last)
            pieces.append(Piece(np.array((first, control, last)), (end - begin) * width, sharp=False))
    return pieces


def _gone(moment: float, rise: float) -> float:
    """Return the share of its way that something has gone which speeds up evenly until `rise`, and goes on until 1."""
    fastest = 1.0 / (1.0 - 0.5 * rise)
    return fastest * (moment * moment / (2.0 * rise) if moment < rise else moment - 0.5 * rise)


def _drawn_out(length: float, rise: float) -> float:
    """Return how far something goes at the speed it has in the end, while it speeds up to it over `length`."""
    return length / (1.0 - 0.5 * rise)


def drawn(frame: Frame, way: Way, samples: int = SAMPLES) -> Floats:
    """Return the joints (m, 3) of about `samples` points of the way, evenly along it in its own coordinates."""
    pieces = way.pieces()
    lengths = [float(np.linalg.norm(np.diff(piece.points, axis=0), axis=1).sum()) for piece in pieces]
    per_length = samples / sum(lengths)
    counts = [max(8, round(per_length * length)) for length in lengths]
    shares = [np.linspace(0.0, 1.0, count, endpoint=False) for count in counts]
    joints = [way.joints(frame, *pair) for pair in zip(pieces, shares, strict=True)]
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
    """Return how far points (n, k) are from the polyline through `line` (m, k), shape (n,).

    At first only the pieces beside the vertices nearest to a point are looked at, which finds no less than the
    distance; for the points that seem to be the farthest off, then all pieces.
    """
    from scipy.spatial import KDTree  # half a second, which processes of tests that import a machine need not wait

    near = min(_VERTICES, len(line))
    vertices = KDTree(line).query(points, near)[1].reshape(len(points), near)
    found = np.full(len(points), np.inf)
    for column in vertices.T:
        for first in (np.maximum(column - 1, 0), np.minimum(column, len(line) - 2)):
            found = np.minimum(found, _to_pieces(points, line[first], line[first + 1]))
    for index in np.argsort(found)[-_FARTHEST:]:
        found[index] = _to_pieces(points[index], line[:-1], line[1:]).min()
    return found


def _to_pieces(points: Floats, starts: Floats, ends: Floats) -> Floats:
    """Return how far each of n points, or one point, is from n straight pieces, shape (n,)."""
    ways, apart = ends - starts, points - starts
    squares = np.maximum(np.einsum("ij,ij->i", ways, ways), 1e-300)
    shares = np.clip(np.einsum("ij,ij->i", apart, ways) / squares, 0.0, 1.0)
    rest = apart - shares[:, None] * ways
    return np.sqrt(np.einsum("ij,ij->i", rest, rest))
