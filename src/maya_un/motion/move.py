"""Divide a path into straight pieces in whole counts, and make the coordinated move of them.

The controller can drive only straight pieces in whole counts.

Between two knots the controller moves straight in the joints. On a curve the knots lie so close that

    the chord stays within `TOLERANCE` of the curve, and
    no axis' speed jumps at a knot by more than its share in `JUMPS`, at the speed that the curve allows there,

and both require a density of knots along the way: √(κ/8e) for the first, κᵢ v / jumpᵢ for the second. The density is
computed on a fine grid and integrated, and the knots are placed at equal parts of the sum. Then each knot is moved a
little to where the boom is at a whole count, because a count of the boom is coarse.

A coordinated move as the controller gets it, and its curves over time.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from maya_un.config import Units
from maya_un.kinematics import Floats, Mechanism
from maya_un.motion.path import BezierPieces, Path, Space, boom_angles, to_joints
from maya_un.motion.polyline import Polyline
from maya_un.motion.profile import Limits, SpeedProfile
from maya_un.values import Joints

Whole = NDArray[np.int64]
"""An array of whole numbers; each use documents its shape."""

STEP = 0.02
"""Change of the speed from one segment of a slow-down to the next, as a share of the slew speed."""

JUMPS = np.array([[0.05], [0.02], [0.02]])
"""Greatest jumps of the speeds of a, b, c where two chords meet, as shares of their slew speeds; a column.

The boom's counts are coarse: where the lines come to rest and the boom continues, it requires most of the knots.
"""

_LOOSE = 1.5
"""At any coarseness, chords are off the curve by at most the square of this times `TOLERANCE`."""

TOLERANCE = 5e-5
"""Greatest distance of a chord from its curve [m]; an angle counts at 1 m."""

_GRID = 24
_SHARES = np.arange(_GRID)[:, np.newaxis] / _GRID
_WEIGHTS = ((1.0 - _SHARES) ** 2, 2.0 * _SHARES * (1.0 - _SHARES), _SHARES**2)
_TINY = 1e-12
_FARTHEST = 2.0**53


@dataclass(frozen=True)
class Knots:
    """The ends of all chords of a path.

    `counts` (n, 3) are the commanded positions; `exact` (n, 3) the same before rounding, in counts. `sharp` (n,) is
    True at corners of the path. `vias` are the ways to the path's waypoints between its ends [counts].
    """

    counts: Whole
    exact: Floats
    sharp: NDArray[np.bool_]
    vias: tuple[float, ...]


def straight(units: Units, waypoints: Sequence[Joints]) -> Knots:
    """Return the knots of straight lines in the joints through `waypoints` (rad, m, m)."""
    exact = np.array([units.to_counts(waypoint) for waypoint in waypoints], dtype=np.float64)
    ways = np.cumsum(np.sqrt(np.sum(np.diff(exact, axis=0) ** 2.0, axis=1)))
    return _distinct(exact.astype(np.int64), exact, np.full(len(exact), True), tuple(ways[:-1].tolist()))


def lay(path: Path, mechanism: Mechanism, units: Units, limits: Limits, coarseness: float = 1.0) -> Knots:
    """Return the knots of `path`; a greater `coarseness` gives fewer knots and greater steps."""
    pieces = path.pieces
    scale = np.array(units.per_unit)
    if path.space is Space.JOINT and all(pieces.straight):
        parameters = np.arange(len(pieces) + 1.0)
        exact = pieces.at(parameters) * scale
    else:
        parameters, exact = _laid(path, mechanism, scale, limits, coarseness)
    nearest = np.rint(parameters)
    sharp = (parameters == nearest) & np.array(pieces.sharp)[nearest.astype(np.intp)]
    counts = np.rint(_finite(exact)).astype(np.int64)
    return _distinct(counts, exact, sharp, _vias(parameters, counts, pieces))


def divided(knots: Knots, longest: float) -> Knots:
    """Return knots with chords longer than `longest` [counts] divided evenly along their line.

    All else is unchanged.
    """
    steps = np.diff(knots.exact, axis=0)
    parts = np.maximum(1, np.ceil(np.sqrt(np.sum(steps * steps, axis=1)) / longest)).astype(np.intp)
    chord = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(chord)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[chord]
    exact = np.concatenate((knots.exact[chord] + share[:, np.newaxis] * steps[chord], knots.exact[-1:]))
    sharp = np.append((share == 0.0) & knots.sharp[chord], knots.sharp[-1])
    return _distinct(np.rint(exact).astype(np.int64), exact, sharp, knots.vias)


def _finite(places: Floats) -> Floats:
    """Return places with undefined ones (above the anchors of the lines) as 0, and bounded to exact whole numbers."""
    return np.clip(np.where(np.isfinite(places), places, 0.0), -_FARTHEST, _FARTHEST)


def _vias(parameters: Floats, counts: Whole, pieces: BezierPieces) -> tuple[float, ...]:
    if not pieces.vias:
        return ()
    ways = np.zeros(len(counts))
    norms(steps(counts)).cumsum(out=ways[1:])
    return tuple(np.interp(pieces.vias, parameters, ways).tolist())


def _distinct(counts: Whole, exact: Floats, sharp: NDArray[np.bool_], vias: tuple[float, ...]) -> Knots:
    """Drop knots that do not differ from the one before by a count, and return the others."""
    moves = (counts[1:] != counts[:-1]).any(axis=1)
    if moves.all():
        return Knots(counts, exact, sharp, vias)
    kept = np.concatenate(([True], moves))
    number = np.cumsum(kept) - 1
    corners = np.zeros(int(number[-1]) + 1, dtype=np.bool_)
    np.logical_or.at(corners, number, sharp)
    return Knots(counts[kept], exact[kept], corners, vias)


def steps(places: Floats | Whole) -> Floats:
    """Return the ways (3, n) between places (n + 1, 3)."""
    rows = np.array(places.T, dtype=np.float64, order="C")
    return rows[:, 1:] - rows[:, :-1]


def norms(ways: Floats) -> Floats:
    """Return the lengths (n,) of ways (3, n)."""
    a, b, c = ways
    return np.sqrt(a * a + c * c + b * b)


def _laid(path: Path, mechanism: Mechanism, scale: Floats, limits: Limits, coarseness: float) -> tuple[Floats, Floats]:
    """Return the parameters of the knots (m,) and their places in counts (m, 3).

    They are the ends of all pieces, the vias, and as many between as needed.
    """
    pieces = path.pieces
    fine = to_joints(path.space, mechanism, _fine(pieces)) * scale
    density = _density(_finite(fine), scale, limits, coarseness)
    if path.space is Space.JOINT:
        density[np.repeat(pieces.straight, _GRID)] = 0.0
    along = np.zeros(len(fine))
    np.cumsum(density, out=along[1:])
    ends = along[::_GRID]
    asked = ends[1:] - ends[:-1]
    parts = np.maximum(1, np.ceil(asked - 1e-9)).astype(np.intp)
    if parts.max() == 1:
        return np.arange(len(parts) + 1.0), fine[::_GRID]
    firsts = parts.cumsum() - parts
    piece = np.arange(len(parts)).repeat(parts)
    wanted = ends[piece] + asked[piece] * ((np.arange(len(piece)) - firsts[piece]) / parts[piece])
    chosen = np.empty(len(piece) + 1)
    chosen[:-1] = np.interp(wanted, along, np.arange(len(along)) / _GRID)
    chosen[firsts], chosen[-1] = np.arange(len(parts)), len(parts)
    _to_whole_counts(chosen, fine[:, 0], path, mechanism, scale[0])
    return chosen, to_joints(path.space, mechanism, pieces.at(chosen)) * scale


def _fine(pieces: BezierPieces) -> Floats:
    """Return the coordinates of an even grid along all pieces."""
    one, two, three = _WEIGHTS
    grid = one * pieces.first[:, np.newaxis] + two * pieces.control[:, np.newaxis] + three * pieces.last[:, np.newaxis]
    return np.concatenate((grid.reshape(-1, 3), pieces.last[-1:]))


def _to_whole_counts(chosen: Floats, boom: Floats, path: Path, mechanism: Mechanism, per_angle: float) -> None:
    """Move the parameters between the ends of the pieces to where the boom is at whole counts, if that is near.

    `boom` is its position on the fine grid [counts].
    """
    if boom.max() - boom.min() < 1.0:
        return
    inner = chosen[1:-1]
    angles = boom_angles(path.space, mechanism, path.pieces.at(inner)) * per_angle
    slope = np.interp(inner, (np.arange(len(boom) - 1) + 0.5) / _GRID, (boom[1:] - boom[:-1]) * _GRID)
    gap = chosen[1:] - chosen[:-1]
    shift = (np.rint(angles) - angles) / np.where(np.abs(slope) > _TINY, slope, np.inf)
    movable = (inner != np.rint(inner)) & (np.abs(shift) < 0.3 * np.minimum(gap[1:], gap[:-1]))
    inner += np.where(movable, shift, 0.0)


def _density(exact: Floats, scale: Floats, limits: Limits, coarseness: float) -> Floats:
    """Return the number of chords that every interval of a fine grid of (n + 1, 3) counts requires, (n,)."""
    ways = steps(exact)
    lengths = norms(ways) + _TINY
    directions = ways / lengths
    turns = directions[:, 1:] - directions[:, :-1]
    between = 0.5 * (lengths[1:] + lengths[:-1])
    turned = np.abs(turns)
    speeds = fastest(0.5 * (directions[:, 1:] + directions[:, :-1]), turns / between, limits)
    jump = (turned / (limits.slew * JUMPS)).max(axis=0) * speeds
    off = (turned / scale[:, np.newaxis]).max(axis=0) * between / (8.0 * TOLERANCE)
    at_points = np.maximum(jump / coarseness, np.sqrt(off) / min(coarseness, _LOOSE))
    density = np.empty(len(lengths))
    density[0], density[-1] = at_points[0], at_points[-1]
    np.maximum(at_points[1:], at_points[:-1], out=density[1:-1])
    density[~np.isfinite(density)] = 0.0
    return density


def fastest(directions: Floats, bends: Floats, limits: Limits) -> Floats:
    """Return the greatest speed along the path where its direction is q' and its bend q'', both (3, n), as (n,).

    Speeds of the axes: |q'ᵢ| v ≤ spᵢ. Accelerations |q'ᵢ u + q''ᵢ v²| ≤ aᵢ for some u: the intervals of u that the axes
    allow have a point in common if every two of them have one, which is |q''ᵢ q'ⱼ − q''ⱼ q'ᵢ| v² ≤ aᵢ|q'ⱼ| + aⱼ|q'ᵢ|.
    """
    share, rates = np.abs(directions), np.minimum(limits.rise, limits.fall)
    speed = (limits.slew / np.maximum(share, _TINY)).min(axis=0)
    crossed = np.abs(bends * directions[_OTHER] - bends[_OTHER] * directions)
    room = rates * share[_OTHER] + rates[_OTHER] * share
    square = (np.maximum(room, _TINY) / np.maximum(crossed, _TINY * _TINY)).min(axis=0)
    return np.minimum(speed, np.sqrt(square))


_OTHER = np.array([1, 2, 0])
"""For every axis another one, so that all pairs occur."""


Counts = tuple[int, int, int]
"""Whole encoder counts of the axes a, b, c."""


def norm(counts: Counts) -> float:
    """Return the length of a way in counts, as the controller measures it over the axes of a sequence."""
    one, two, three = counts
    return sqrt(one * one + two * two + three * three)


class Segment(NamedTuple):
    """One LI: the way of each axis [counts], the target speed and the speed at its end [counts/s]."""

    counts: Counts
    speed: int
    end_speed: int

    @property
    def length(self) -> float:
        """Way along the path [counts]: the norm over the axes."""
        return norm(self.counts)


class Segments(Sequence[Segment]):
    """Segments as arrays: whole `counts` (n, 3), `speeds` and `end_speeds` (n,); indexing returns a `Segment`."""

    def __init__(self, counts: Whole, speeds: Whole, end_speeds: Whole) -> None:
        self.counts, self.speeds, self.end_speeds = counts, speeds, end_speeds
        self.lengths = norms(counts.T.astype(np.float64, order="C"))

    @classmethod
    def of(cls, segments: Iterable[Segment]) -> Segments:
        """Return these segments as arrays."""
        rows = [(*counts, speed, end_speed) for counts, speed, end_speed in segments]
        table = np.array(rows, dtype=np.int64).reshape(-1, 5)
        return cls(table[:, :3], table[:, 3], table[:, 4])

    def __reduce__(self) -> tuple[type[Segments], tuple[Whole, Whole, Whole]]:
        # compiled, it cannot be made without its arguments, as pickle does it
        return Segments, (self.counts, self.speeds, self.end_speeds)

    def __len__(self) -> int:
        return len(self.speeds)

    @overload
    def __getitem__(self, index: int) -> Segment: ...
    @overload
    def __getitem__(self, index: slice) -> Segments: ...
    def __getitem__(self, index: int | slice) -> Segment | Segments:
        if isinstance(index, slice):
            return Segments(self.counts[index], self.speeds[index], self.end_speeds[index])
        a, b, c = self.counts[index].tolist()
        return Segment((a, b, c), int(self.speeds[index]), int(self.end_speeds[index]))

    def __iter__(self) -> Iterator[Segment]:
        rows = zip(self.counts.tolist(), self.speeds.tolist(), self.end_speeds.tolist(), strict=True)
        return (Segment((a, b, c), speed, end_speed) for (a, b, c), speed, end_speed in rows)


@dataclass(frozen=True, eq=False)
class CoordinatedMove:
    """A move in linear mode, complete before it starts.

    `start` is in counts, `va` and `vd` in counts/s². `columns` has the joint (0 to 2) of each of the controller's axes
    A, B, C …, None for an axis that takes no part. `profile` is the way over time, `via_ways` the way along the path at
    every waypoint between its ends [counts].
    """

    start: Counts
    segments: Segments
    columns: tuple[int | None, ...]
    va: int
    vd: int
    units: Units
    profile: SpeedProfile
    via_ways: tuple[float, ...] = ()

    @classmethod
    def along(
        cls,
        start: Counts,
        segments: Segments,
        letters: tuple[str, str, str],
        va: int,
        vd: int,
        units: Units,
        vias: tuple[float, ...] = (),
    ) -> CoordinatedMove:
        """Return the move over `segments` from `start`; `letters` are the controller's names of a, b, c.

        `vias` are the ways at which the waypoints between the ends are passed [counts].
        """
        profile = SpeedProfile.over(segments.lengths, segments.speeds, segments.end_speeds, va, vd)
        return cls(start, segments, _columns(segments, letters), va, vd, units, profile, vias)

    @cached_property
    def places(self) -> tuple[Counts, ...]:
        """Positions of the axes at the start and at every segment's end [counts]."""
        ways = np.cumsum(self.segments.counts, axis=0)
        return (self.start, *((a, b, c) for a, b, c in (ways + np.array(self.start)).tolist()))

    @cached_property
    def polyline(self) -> Polyline:
        """The path as chords between `places` [counts]."""
        return Polyline(np.array(self.places, dtype=np.float64))

    @cached_property
    def ways(self) -> tuple[float, ...]:
        """The way along the path at every segment's end [counts]."""
        return tuple(np.cumsum(self.segments.lengths).tolist())

    @cached_property
    def end(self) -> Counts:
        """The end [counts]."""
        a, b, c = (self.segments.counts.sum(axis=0) + np.array(self.start)).tolist()
        return a, b, c

    @property
    def vs(self) -> int:
        """The greatest requested speed along the path [counts/s]."""
        return int(self.segments.speeds.max(initial=0))

    @property
    def axes(self) -> str:
        """Letters of the controller's axes that take part, "" for a move without segments."""
        return "".join("ABC"[place] for place, joint in enumerate(self.columns) if joint is not None)

    @property
    def duration(self) -> float:
        """Time from start to rest [s], as the controller takes it."""
        return self.profile.duration

    def via_times(self) -> tuple[float, ...]:
        """Return the times at which the waypoints between the ends of the path are passed [s]."""
        return tuple(self.profile.when(way) for way in self.via_ways)

    def position_at(self, t: float) -> Joints:
        """Return the position of the axes at time `t` [s] after the start (rad, m, m)."""
        return self.position_after(self.profile.at(t)[0])

    def nearest_way(self, place: Floats, first: float, last: float) -> float:
        """Return the way from `first` to `last` along the path [counts] that is nearest to `place` (3,) [counts].

        Of ways that are equally near to a count, as there and back, it is the first.
        """
        begin, end = (min(bisect_right(self.ways, way), len(self.ways) - 1) for way in (first, last))
        found = self.polyline.nearest(place, slice(begin, end + 1), same=1.0)
        way = self.ways[found.chord] - (1.0 - found.share) * float(self.segments.lengths[found.chord])
        return min(max(way, first), last)

    def speed_at(self, t: float) -> float:
        """Return the speed along the path at time `t` [counts/s]."""
        return self.profile.at(t)[1]

    def velocity_at(self, t: float) -> tuple[float, float, float]:
        """Return the speed of every axis at time `t` (rad/s, m/s, m/s)."""
        way, speed = self.profile.at(t)
        if speed == 0.0:
            return 0.0, 0.0, 0.0
        segment = self.segments[min(bisect_right(self.ways, way), len(self.segments) - 1)]
        per_length = speed / segment.length
        a, b, c = (
            counts * per_length / scale for counts, scale in zip(segment.counts, self.units.per_unit, strict=True)
        )
        return a, b, c

    def stop_distance(self, speed: float) -> float:
        """Return the distance along the path of a stop from `speed` [counts/s] [counts]."""
        return 0.5 * speed * speed / self.vd

    def stop_at(self, t: float) -> tuple[float, Joints]:
        """Return the duration of a stop commanded at time `t` [s], and where on the path it ends (rad, m, m)."""
        way, speed = self.profile.at(t)
        return speed / self.vd, self.position_after(min(self.profile.length, way + self.stop_distance(speed)))

    def position_after(self, way: float) -> Joints:
        """Return the position of the axes (rad, m, m) after a `way` [counts] along the path."""
        index = bisect_right(self.ways, way)
        if index >= len(self.segments):
            return self.units.to_joints(self.end)
        segment, place = self.segments[index], self.places[index]
        share = 1.0 - (self.ways[index] - way) / segment.length
        a, b, c = (begun + counts * share for begun, counts in zip(place, segment.counts, strict=True))
        return self.units.to_joints((a, b, c))


def speed_ratio(ratio: float) -> str:
    """Return the command that scales the speeds of a sequence, also of one under way (Galil DMC-41x3, command VR)."""
    return f"VR {round(ratio, 4):g}"


def commands(move: CoordinatedMove, ratio: float = 1.0) -> list[str]:
    """Return the commands that load a move into the controller, in order; BGS starts it.

    They select plane S and set its speed ratio to `ratio`, whatever another program left, and clear the sequence of an
    earlier stop. A move without segments needs no commands.
    """
    if not move.segments:
        return []
    setup = ["CA S", "CS S", speed_ratio(ratio), f"LM {move.axes}", f"VA {move.va}", f"VD {move.vd}", f"VS {move.vs}"]
    segments, taking_part = move.segments, [joint for joint in move.columns if joint is not None]
    numbers = np.column_stack((segments.counts[:, taking_part], segments.speeds, segments.end_speeds))
    pattern = "LI " + ",".join("" if joint is None else "%d" for joint in move.columns) + "<%d>%d\n"
    lines = (pattern * len(numbers)) % tuple(numbers.ravel().tolist())
    return [*setup, *lines.splitlines(), "LE"]


def _columns(segments: Segments, letters: tuple[str, str, str]) -> tuple[int | None, ...]:
    """Return the joints in the places of A, B, C: those that move, and b and c always together."""
    moving = set(np.flatnonzero(segments.counts.any(axis=0)).tolist())
    if moving & {1, 2}:
        moving |= {1, 2}
    places = {letters[joint]: joint for joint in moving}
    last = max(places, default="")
    return tuple(places.get(letter) for letter in "ABC" if letter <= last)


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Samples in order of time [s], (n,): joints (n, 3) [rad, m, m] and their velocities (n, 3) [rad/s, m/s, m/s]."""

    time: Floats
    joints: Floats
    velocity: Floats


@dataclass(frozen=True, slots=True)
class LongestStop:
    """The longest stop on a move: its duration [s] and the gripper's way [m]."""

    time: float
    distance: float


def sample(move: CoordinatedMove, count: int) -> Trajectory:
    """Return `count` samples of a move, evenly in time, the first at its start and the last at its end."""
    time = np.linspace(0.0, move.duration, count)
    way, speed = _along(move, time)
    return _at(move, time, way, speed)


def stopping(move: CoordinatedMove, mechanism: Mechanism) -> LongestStop:
    """Return the longest stop on a move (Galil DMC-41x3, ST S: along the path at VD), checked where the law changes.

    The way of the gripper is measured along the path.
    """
    times = np.array([piece.t for piece in move.profile.pieces])
    way, speed = _along(move, times)
    ahead = np.minimum(move.profile.length, way + speed * speed / (2.0 * move.vd))
    knots = np.concatenate(([0.0], move.ways))
    points = mechanism.fk_many(np.array(move.places) / np.array(move.units.per_unit))
    gone = np.concatenate(([0.0], np.cumsum(np.sqrt(np.sum(np.diff(points, axis=0) ** 2, axis=1)))))
    distances = np.interp(ahead, knots, gone) - np.interp(way, knots, gone)
    return LongestStop(float(np.max(speed)) / move.vd, float(np.max(distances)))


def _along(move: CoordinatedMove, time: Floats) -> tuple[Floats, Floats]:
    """Return way [counts] and speed [counts/s] at times of shape (n,)."""
    t, s, v, acceleration = np.array(move.profile.pieces).T
    piece = np.maximum(0, np.searchsorted(t, time, side="right") - 1)
    passed = time - t[piece]
    way = s[piece] + passed * (v[piece] + 0.5 * acceleration[piece] * passed)
    speed = np.maximum(0.0, v[piece] + acceleration[piece] * passed)
    over = time >= move.duration
    return np.where(over, move.profile.length, np.minimum(way, move.profile.length)), np.where(over, 0.0, speed)


def _at(move: CoordinatedMove, time: Floats, way: Floats, speed: Floats) -> Trajectory:
    ends = np.array(move.ways)
    places = np.array(move.places, dtype=np.float64)
    begins = np.concatenate(([0.0], ends[:-1]))
    segment = np.minimum(np.searchsorted(ends, way, side="right"), len(ends) - 1)
    directions = np.diff(places, axis=0) / (ends - begins)[:, np.newaxis]
    scale = np.array(move.units.per_unit)
    counts = places[segment] + directions[segment] * (way - begins[segment])[:, np.newaxis]
    return Trajectory(time, counts / scale, directions[segment] * speed[:, np.newaxis] / scale)
