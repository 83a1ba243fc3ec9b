"""The reference of one axis as a function of time, and the profiles that it is made of.

It is piecewise quadratic and in closed form, never stepped. Profiles are trapezoids, ramps and stops.

Positions are motor counts since power-up. The machine plans a timeline, the plant follows it (and may read the past,
because it lags).

All values are in motor counts and seconds. A profile starts from any state of motion, so a change of speed is a new
profile from the present state. A profile that ends rests on a whole count.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from math import copysign, inf, nextafter, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FLAT = 1e-9
"""An acceleration below this [counts/s²] does not reverse an axis."""

_FEW = 12
"""Up to this number of pieces, a loop is faster than numpy."""


class TimelinePiece(NamedTuple):
    """From time `t` [s]: position `p` [counts], velocity `v` [counts/s], acceleration `a` [counts/s²].

    A piece is valid until the `t` of the next one; the last one for ever.
    """

    t: float
    p: float
    v: float
    a: float

    def at(self, t: float) -> tuple[float, float]:
        """Return position [counts] and velocity [counts/s] at time `t` [s]."""
        s = t - self.t
        return self.p + (self.v + 0.5 * self.a * s) * s, self.v + self.a * s

    def turn(self, start: float, end: float) -> float | None:
        """Return the time strictly between `start` and `end` [s] at which the velocity changes its sign."""
        if abs(self.a) < FLAT:
            return None
        turn = self.t - self.v / self.a
        return turn if start < turn < end else None

    def arrival(self, level: float, rising: bool) -> float:
        """Return the time [s] at which the piece passes `level` [counts], upward if `rising`, else downward.

        Uses the solution of the quadratic equation without cancellation of digits. The piece must pass `level` in this
        direction.
        """
        direction = 1.0 if rising else -1.0
        gap, v, a = direction * (level - self.p), direction * self.v, direction * self.a
        speed = sqrt(max(0.0, v * v + 2.0 * a * gap))
        if v >= 0.0:
            return self.t + (2.0 * gap / (v + speed) if v + speed > 0.0 else 0.0)
        return self.t + ((speed - v) / a if a else 0.0)


class Timeline:
    """Reference of one axis; begins at rest at `position` [counts] and, unless planned, stays there."""

    __slots__ = ("_pieces", "_table", "_times", "_version")

    def __init__(self, position: float = 0.0, t: float = 0.0) -> None:
        self._pieces = [TimelinePiece(t, position, 0.0, 0.0)]
        self._times = [t]
        self._table: _TimelineTable | None = None
        self._version = 0

    @property
    def end(self) -> float:
        """Time when the last piece begins [s]; the axis then rests, unless it jogs."""
        return self._times[-1]

    @property
    def jogs(self) -> bool:
        """Whether the last piece still moves, so that the axis never comes to rest by itself."""
        return self._pieces[-1].v != 0.0 or self._pieces[-1].a != 0.0

    @property
    def version(self) -> int:
        """Number of plans made; a reader that stores predictions compares it."""
        return self._version

    @property
    def pieces(self) -> tuple[TimelinePiece, ...]:
        """The stored pieces, oldest first."""
        return tuple(self._pieces)

    def ahead(self, t: float) -> list[TimelinePiece]:
        """Return the plan from time `t` [s] on; the first piece begins there."""
        index = self._index(t)
        piece = self._pieces[index]
        return [TimelinePiece(t, *self.at(t), piece.a if t >= piece.t else 0.0), *self._pieces[index + 1 :]]

    def plan(self, t: float, pieces: Sequence[TimelinePiece]) -> None:
        """Replace everything from time `t` [s] on; `pieces` are in order of time and the first begins at `t`.

        The last piece extends for ever, so it is at rest or of constant velocity. Raises `ValueError` if
        the pieces do not begin at `t`.
        """
        if not pieces or pieces[0].t != t:
            raise ValueError(f"the first piece must begin at {t}")
        kept = bisect_left(self._times, t)
        self._pieces[kept:] = pieces
        self._times[kept:] = [piece.t for piece in pieces]
        self._table = None
        self._version += 1

    def hold(self, t: float) -> None:
        """Stop at once: rest from time `t` [s] on at the position of that time."""
        position, _ = self.at(t)
        self.plan(t, (TimelinePiece(t, position, 0.0, 0.0),))

    def at(self, t: float) -> tuple[float, float]:
        """Return position [counts] and velocity [counts/s] at time `t` [s]; rest before the first piece."""
        piece = self._pieces[-1]  # mostly the present is in the last one, at rest or at speed
        if t < piece.t:
            piece = self._pieces[self._index(t)]
            if t < piece.t:
                return piece.p, 0.0
        return piece.at(t)

    def sample(self, ts: Floats) -> Floats:
        """Return the positions [counts] at the times `ts` [s], shape of `ts`."""
        return self.motion(ts)[0]

    def motion(self, ts: Floats) -> tuple[Floats, Floats, Floats]:
        """Return positions [counts], velocities [counts/s] and accelerations [counts/s²] at `ts` [s].

        Each has the shape of `ts`. Before the first piece the axis is at rest.
        """
        times, p0, v0, a0 = self._arrays().columns
        index = np.searchsorted(times, ts, side="right") - 1
        early = index < 0
        index[early] = 0
        s = ts - times[index]
        a = a0[index]
        v = v0[index]
        if early.any():
            s[early] = a[early] = v[early] = 0.0
        return p0[index] + (v + 0.5 * a * s) * s, v + a * s, a

    def boundaries(self, t0: float, t1: float) -> list[float]:
        """Return the times in (t0, t1] at which a piece begins."""
        return self._times[bisect_right(self._times, t0) : bisect_right(self._times, t1)]

    def changes(self, t0: float, t1: float) -> Floats:
        """Return the times in (t0, t1] at which a piece begins, and in [t0, t1] at which the axis turns within one."""
        table = self._arrays()
        begins, turns = table.columns[0], table.turns
        return np.concatenate((begins[(begins > t0) & (begins <= t1)], turns[(turns >= t0) & (turns <= t1)]))

    def bounds(self, t0: float, t1: float) -> tuple[float, float]:
        """Return a lower and an upper bound of the positions [counts] in [t0, t1]; they may be a little wide."""
        first, last = self._index(t0), self._index(t1)
        if last - first <= _FEW:
            return self._span(t0, t1)
        table = self._arrays()
        low, high = self._span(self._times[last], t1)
        return min(low, float(table.low[first:last].min())), max(high, float(table.high[first:last].max()))

    def crossing(self, level: float, t0: float, t1: float, rising: bool) -> float | None:
        """Return the first time in (t0, t1] at which the position reaches `level` [counts] from below.

        With `rising` false: from above. A position that only touches the level has reached it; one that
        begins at the level must leave it first.
        """
        low, high = self.bounds(t0, t1)
        if t1 <= t0 or not low <= level <= high:
            return None
        direction = 1.0 if rising else -1.0
        before = direction * (self.at(t0)[0] - level)
        for piece, a, b in self._monotone(t0, t1):
            after = direction * (piece.at(b)[0] - level)
            if before < 0.0 <= after:
                return min(max(piece.arrival(level, rising), a, nextafter(t0, inf)), b)
            before = after
        return None

    def forget(self, before: float) -> None:
        """Drop the pieces that end before time `before` [s].

        The plant calls it, because only the plant knows how far into the past it reads.
        """
        gone = self._index(before)
        if gone > 0:
            del self._pieces[:gone]
            del self._times[:gone]
            self._table = self._table and self._table.without(gone)

    def _index(self, t: float) -> int:
        return max(0, bisect_right(self._times, t) - 1)

    def _monotone(self, t0: float, t1: float) -> Iterator[tuple[TimelinePiece, float, float]]:
        """Yield the stretches (piece, from, to) of (t0, t1] within which the axis does not turn."""
        index = self._index(t0)
        start = max(t0, self._times[index])
        while start < t1 and index < len(self._pieces):
            piece = self._pieces[index]
            index += 1
            end = t1 if index == len(self._pieces) else min(t1, self._times[index])
            turn = piece.turn(start, end)
            if turn is not None:
                yield piece, start, turn
                start = turn
            yield piece, start, end
            start = end

    def _span(self, t0: float, t1: float) -> tuple[float, float]:
        low = high = self.at(t0)[0]
        for piece, a, b in self._monotone(t0, t1):
            for position in (piece.at(a)[0], piece.at(b)[0]):
                low, high = min(low, position), max(high, position)
        return low, high

    def _arrays(self) -> _TimelineTable:
        if self._table is None:
            self._table = _TimelineTable.of(self._pieces)
        return self._table


class _TimelineTable(NamedTuple):
    """The pieces as columns; for each but the last, its smallest and largest position, and when it turns, if at all."""

    columns: tuple[Floats, Floats, Floats, Floats]  # t, p, v, a
    low: Floats
    high: Floats
    turns: Floats

    @classmethod
    def of(cls, pieces: list[TimelinePiece]) -> _TimelineTable:
        flat = np.fromiter(chain.from_iterable(pieces), np.float64, 4 * len(pieces))
        columns = np.ascontiguousarray(flat.reshape(-1, 4).T)  # (4, pieces)
        t, p, v, a = columns[:, :-1]
        length = columns[0, 1:] - t
        end = p + (v + 0.5 * a * length) * length
        turn = np.divide(-v, a, out=np.zeros(len(a)), where=np.abs(a) >= FLAT)
        turn = np.minimum(np.maximum(turn, 0.0), length)
        extreme = p + (v + 0.5 * a * turn) * turn
        low = np.minimum(np.minimum(p, end), extreme)
        high = np.maximum(np.maximum(p, end), extreme)
        turns = (t + turn)[(turn > 0.0) & (turn < length)]
        return cls((columns[0], columns[1], columns[2], columns[3]), low, high, turns)

    def without(self, gone: int) -> _TimelineTable:
        """Return the table without its first `gone` pieces."""
        t, p, v, a = self.columns
        return _TimelineTable((t[gone:], p[gone:], v[gone:], a[gone:]), self.low[gone:], self.high[gone:], self.turns)


_COPIES = 4
_ROUNDING = 1e-9


class AxisProfile(NamedTuple):
    """The future motion of an axis.

    `pieces` begin at the time of planning; `braking` is when the last deceleration begins and `end` when the axis
    rests [s] (infinite for a jog); `peak` is the largest speed on the way [counts/s].
    """

    pieces: list[TimelinePiece]
    braking: float
    end: float
    peak: float


def stop_profile(t: float, p: float, v: float, deceleration: float) -> AxisProfile:
    """Return the profile to rest at a constant `deceleration` [counts/s²]."""
    if v == 0.0:
        return AxisProfile([TimelinePiece(t, round(p), 0.0, 0.0)], t, t, 0.0)
    duration = abs(v) / deceleration
    braking = TimelinePiece(t, p, v, -copysign(deceleration, v))
    rest = TimelinePiece(t + duration, round(p + 0.5 * v * duration), 0.0, 0.0)
    return AxisProfile([braking, rest], t, rest.t, abs(v))


def jog_profile(t: float, p: float, v: float, wanted: float, acceleration: float, deceleration: float) -> AxisProfile:
    """Return the profile to the velocity `wanted` [counts/s], held for ever; a reversal brakes first."""
    pieces: list[TimelinePiece] = []
    if v * wanted < 0.0:
        t, p, v = _ramp(pieces, t, p, v, 0.0, deceleration)
    t, p, v = _ramp(pieces, t, p, v, wanted, acceleration if abs(wanted) > abs(v) else deceleration)
    pieces.append(TimelinePiece(t, p if wanted else round(p), wanted, 0.0))
    return AxisProfile(pieces, inf, inf, max(abs(piece.v) for piece in pieces))


def move_profile(
    t: float, p: float, v: float, target: int, speed: float, acceleration: float, deceleration: float
) -> AxisProfile:
    """Return the profile to rest at `target` [counts]: accelerate, slew at `speed` [counts/s], decelerate.

    An axis that moves away, or too fast to stop in time, brakes to rest first and then returns. With a `speed` of 0 the
    axis rests at its place, and the move never ends.
    """
    pieces: list[TimelinePiece] = []
    way = 1.0 if target >= p else -1.0
    gap, w = way * (target - p), way * v
    if w < 0.0 or w * w > 2.0 * deceleration * gap * (1.0 + 1e-9) + 1e-6 or (speed == 0.0 and w > 0.0):
        t, p, v = _ramp(pieces, t, p, v, 0.0, deceleration)
        way = 1.0 if target >= p else -1.0
        gap, w = way * (target - p), 0.0
    if speed == 0.0 and gap > 0.0:
        pieces.append(TimelinePiece(t, p, 0.0, 0.0))
        return AxisProfile(pieces, inf, inf, abs(v))
    _approach(pieces, t, p, w, way, gap, (speed, acceleration, deceleration))
    end = pieces[-1]
    pieces[-1] = TimelinePiece(end.t, target, 0.0, 0.0)
    braking = pieces[-2].t if len(pieces) > 1 else t
    return AxisProfile(pieces, braking, end.t, max(abs(piece.v) for piece in pieces))


def _approach(
    pieces: list[TimelinePiece],
    t: float,
    p: float,
    w: float,
    way: float,
    gap: float,
    limits: tuple[float, float, float],
) -> None:
    """Append the pieces from speed `w` to rest at the target, which must be reachable without reversal."""
    speed, acceleration, deceleration = limits
    reachable = sqrt((2.0 * gap * acceleration * deceleration + w * w * deceleration) / (acceleration + deceleration))
    peak = max(min(speed, reachable), 0.0)
    rate = acceleration if peak > w else deceleration
    t, p, v = _ramp(pieces, t, p, way * w, way * peak, rate)
    rest = gap - abs(peak * peak - w * w) / (2.0 * rate) - peak * peak / (2.0 * deceleration)
    if peak and rest > 0.0 and speed <= reachable:
        pieces.append(TimelinePiece(t, p, v, 0.0))
        t, p = t + rest / peak, p + way * rest
    t, p, _ = _ramp(pieces, t, p, v, 0.0, deceleration)
    pieces.append(TimelinePiece(t, p, 0.0, 0.0))


def _ramp(
    pieces: list[TimelinePiece], t: float, p: float, v: float, wanted: float, rate: float
) -> tuple[float, float, float]:
    """Append the piece that changes the velocity from `v` to `wanted`; return the state at its end."""
    if v == wanted:
        return t, p, v
    duration = abs(wanted - v) / rate
    pieces.append(TimelinePiece(t, p, v, copysign(rate, wanted - v)))
    return t + duration, p + 0.5 * (v + wanted) * duration, wanted


def pass_profile(t: float, p: float, level: int, speed: float, acceleration: float, deceleration: float) -> AxisProfile:
    """Return the profile from rest at the velocity `speed` [counts/s] past `level` [counts], where braking begins.

    `level` lies ahead. With a `speed` of 0 the axis stays at rest, and its motion never ends.
    """
    way = jog_profile(t, p, 0.0, speed, acceleration, deceleration)
    if speed == 0.0:
        return way
    rising = speed > 0.0
    first, last = way.pieces
    ramping = (last.p - level) * speed >= 0.0
    met = (first if ramping else last).arrival(level, rising)
    _, v = (first if ramping else last).at(met)
    braking = stop_profile(met, level, v, deceleration)
    return AxisProfile([first, *([] if ramping else [last]), *braking.pieces], met, braking.end, abs(v))


def smoothed_profile(way: AxisProfile, t: float, p: float, v: float, spread: float) -> AxisProfile:
    """Return a profile smoothed by the mean of four copies of it, delayed by 0 to `spread` [s].

    The mean stands for the low-pass filter of IT, whose delay is half of that on average; every piece remains
    quadratic. The axis is at `p` [counts] with velocity `v` [counts/s] at time `t`; `way` was planned from the place of
    an unfiltered profile at that time, `p + v * spread / 2`, so that position and velocity have no step.
    """
    ahead = p + 0.5 * v * spread
    delays = [spread * copy / (_COPIES - 1) for copy in range(_COPIES)]
    pieces: list[TimelinePiece] = []
    for at in sorted({piece.t + delay for piece in way.pieces for delay in delays}):
        state = [_departure(way.pieces, at - delay, t, ahead, v) for delay in delays]
        dp, dv, a = (sum(part) / _COPIES for part in zip(*state, strict=True))
        pieces.append(TimelinePiece(at, p + v * (at - t) + dp, v + dv, a))
    rest = way.pieces[-1]
    end = TimelinePiece(pieces[-1].t, rest.p if rest.v == 0.0 else pieces[-1].p, rest.v, 0.0)
    return AxisProfile([*pieces[:-1], end], way.braking, way.end + spread, max(way.peak, abs(v)))


def turning_times(pieces: Sequence[TimelinePiece]) -> list[float]:
    """Return the times [s] at which the velocity passes through 0, without the ends."""
    found: list[float] = []
    for piece, following in pairwise(pieces):
        if piece is not pieces[0] and piece.v == 0.0:
            found.append(piece.t)
        turn = piece.turn(piece.t, following.t)
        if turn is not None:
            found.append(turn)
    return found


def _departure(pieces: Sequence[TimelinePiece], at: float, t: float, p: float, v: float) -> tuple[float, float, float]:
    """Return the deviation of a profile at a time from a motion at `v` that began at `p` at time `t`."""
    soon = at + _ROUNDING
    if soon < t:
        return 0.0, 0.0, 0.0
    piece = pieces[max(0, bisect_right(pieces, soon, key=lambda one: one.t) - 1)]
    position, velocity = piece.at(at)
    return position - p - v * (at - t), velocity - v, piece.a
