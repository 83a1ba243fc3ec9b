"""Profiles of one independent axis: trapezoids, ramps and stops as pieces of constant acceleration.

Everything is in motor counts and seconds and starts from any state of motion, so a change of speed on the way is
a new profile from where the axis is. A profile that ends rests on a whole count.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import copysign, inf, sqrt
from typing import NamedTuple

from dmc41x3.twin.timeline import TimelinePiece

_COPIES = 4
_ROUNDING = 1e-9


class AxisProfile(NamedTuple):
    """What an axis will do.

    `pieces` begin at the time of planning; `braking` is when the last deceleration begins and `end` when the axis
    rests [s] (infinite for a jog); `peak` is the largest speed on the way [counts/s].
    """

    pieces: list[TimelinePiece]
    braking: float
    end: float
    peak: float


def stop(t: float, p: float, v: float, deceleration: float) -> AxisProfile:
    """Return the way to rest at a constant `deceleration` [counts/s²]."""
    if v == 0.0:
        return AxisProfile([TimelinePiece(t, round(p), 0.0, 0.0)], t, t, 0.0)
    duration = abs(v) / deceleration
    braking = TimelinePiece(t, p, v, -copysign(deceleration, v))
    rest = TimelinePiece(t + duration, round(p + 0.5 * v * duration), 0.0, 0.0)
    return AxisProfile([braking, rest], t, rest.t, abs(v))


def jog(t: float, p: float, v: float, wanted: float, acceleration: float, deceleration: float) -> AxisProfile:
    """Return the way to the velocity `wanted` [counts/s], kept for ever; a reversal brakes first."""
    pieces: list[TimelinePiece] = []
    if v * wanted < 0.0:
        t, p, v = _ramp(pieces, t, p, v, 0.0, deceleration)
    t, p, v = _ramp(pieces, t, p, v, wanted, acceleration if abs(wanted) > abs(v) else deceleration)
    pieces.append(TimelinePiece(t, p if wanted else round(p), wanted, 0.0))
    return AxisProfile(pieces, inf, inf, max(abs(piece.v) for piece in pieces))


def move(
    t: float, p: float, v: float, target: int, speed: float, acceleration: float, deceleration: float
) -> AxisProfile:
    """Return the way to rest at `target` [counts]: accelerate, slew at `speed` [counts/s], decelerate.

    An axis that moves away, or too fast to stop in time, brakes to rest first and then comes back. A `speed`
    of 0 leaves the axis at rest where it is, its move never ending.
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
    """Append the pieces from speed `w` towards the target to rest there; it can be reached without reversal."""
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


def past(t: float, p: float, level: int, speed: float, acceleration: float, deceleration: float) -> AxisProfile:
    """Return the way from rest at the velocity `speed` [counts/s] past `level` [counts], where braking begins.

    `level` lies ahead. A `speed` of 0 leaves the axis at rest, its motion never ending.
    """
    way = jog(t, p, 0.0, speed, acceleration, deceleration)
    if speed == 0.0:
        return way
    rising = speed > 0.0
    first, last = way.pieces
    ramping = (last.p - level) * speed >= 0.0
    met = (first if ramping else last).arrival(level, rising)
    _, v = (first if ramping else last).at(met)
    braking = stop(met, level, v, deceleration)
    return AxisProfile([first, *([] if ramping else [last]), *braking.pieces], met, braking.end, abs(v))


def smoothed(way: AxisProfile, t: float, p: float, v: float, spread: float) -> AxisProfile:
    """Return a way made smoother by the mean of four copies of it, late by 0 to `spread` [s].

    The mean stands for the low-pass filter of IT, which is late by half of that on average, and keeps every piece
    quadratic. The axis is at `p` [counts] with velocity `v` [counts/s] at time `t`; `way` was planned from where an
    unfiltered profile would be then, `p + v * spread / 2`, so that position and velocity have no step.
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


def turns(pieces: Sequence[TimelinePiece]) -> list[float]:
    """Return the times at which the velocity passes through 0 on the way, ends apart [s]."""
    found: list[float] = []
    for piece, following in pairwise(pieces):
        if piece is not pieces[0] and piece.v == 0.0:
            found.append(piece.t)
        turn = piece.turn(piece.t, following.t)
        if turn is not None:
            found.append(turn)
    return found


def _departure(pieces: Sequence[TimelinePiece], at: float, t: float, p: float, v: float) -> tuple[float, float, float]:
    """Return by how much a profile departs at a time from going on at `v` from `p` since `t`."""
    soon = at + _ROUNDING
    if soon < t:
        return 0.0, 0.0, 0.0
    piece = pieces[max(0, bisect_right(pieces, soon, key=lambda one: one.t) - 1)]
    position, velocity = piece.at(at)
    return position - p - v * (at - t), velocity - v, piece.a
