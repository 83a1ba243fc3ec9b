"""How fast a DMC-41x3 goes along the segments of a coordinated sequence, as a closed form.

Every segment has a length, a target speed (`<o`) and an end speed (`>p`). The controller accelerates towards the
target speed at VA, cruises, and brakes at VD just in time to have the end speed at the segment's end, and every
later one at its own; it enters the next segment with the speed it then has, and comes to rest at the end of the last.
Lengths are in counts, measured as the norm over the axes of the sequence; speeds in counts/s; accelerations in
counts/s².

The speed ratio (Galil DMC-41x3, command VR) acts at once, at VA and VD. It scales the target speeds. The manual does
not say whether it scales end speeds too; taken as they are, they are never above a scaled target, and whoever
looks before believing the predicted end is right either way. At a ratio of 0 the sequence brakes on its path and
stands there.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

_ROUNDING = 1e-6
"""Counts: a ramp that misses its segment by less fits it; only rounding makes such a difference."""


class Piece(NamedTuple):
    """A stretch of constant acceleration: begins at time `t` [s], way `s`, speed `v`; lasts until the next."""

    t: float
    s: float
    v: float
    acceleration: float


class Leg(NamedTuple):
    """A segment as it is driven: the way at its end, its target speed, and the largest speed allowed at its end."""

    stop: float
    target: float
    bound: float


@dataclass(frozen=True, slots=True)
class Profile:
    """Way and speed over time: pieces in order of time, `duration` [s] and `length` [counts] of the whole.

    The duration of a sequence that stands at a ratio of 0 is infinite. `legs`, `va` and `vd` are what it is made of.
    """

    pieces: tuple[Piece, ...]
    duration: float
    length: float
    legs: tuple[Leg, ...]
    va: float
    vd: float

    @classmethod
    def along(
        cls, segments: Iterable[tuple[float, float, float]], va: float, vd: float, ratio: float = 1.0
    ) -> Profile:
        """Return the profile over segments (length > 0, target speed > 0, end speed), begun at rest.

        `ratio` is the speed ratio from the start on, 0 or above.
        """
        legs = _legs(segments, vd)
        return cls._driven(_Run(va, vd), legs, 0, ratio)

    def at(self, t: float) -> tuple[float, float]:
        """Return (way [counts], speed [counts/s]) at time `t` [s]; before the start and after the end at rest."""
        if t <= 0.0 or not self.pieces:
            return 0.0, 0.0
        if t >= self.duration:
            return self.length, 0.0
        begun, s, v, acceleration = self.pieces[bisect_right(self.pieces, t, key=lambda piece: piece.t) - 1]
        passed = t - begun
        return min(self.length, s + passed * (v + 0.5 * acceleration * passed)), max(0.0, v + acceleration * passed)

    def changed(self, t: float, ratio: float) -> Profile:
        """Return the profile as it goes on when the speed ratio becomes `ratio` at time `t` [s]; the past stays."""
        if t >= self.duration:
            return self
        way, speed = self.at(t)
        past = self.pieces[: bisect_left(self.pieces, max(0.0, t), key=lambda piece: piece.t)]
        here = bisect_right(self.legs, way, key=lambda leg: leg.stop)
        return self._driven(_Run(self.va, self.vd, max(0.0, t), way, speed, past), self.legs, here, ratio)

    def when(self, way: float) -> float:
        """Return the time at which the sequence has gone `way` [counts]; infinite where it stands before."""
        if way <= 0.0:
            return 0.0
        if way >= self.length:
            return self.duration
        index = bisect_right(self.pieces, way, key=lambda piece: piece.s) - 1
        begun, s, v, acceleration = self.pieces[index]
        left = way - s
        speed = v + sqrt(max(0.0, v * v + 2.0 * acceleration * left))
        if speed <= 0.0:
            return begun if left <= 0.0 else inf
        until = self.pieces[index + 1].t if index + 1 < len(self.pieces) else self.duration
        return min(begun + 2.0 * left / speed, until)

    @classmethod
    def _driven(cls, run: _Run, legs: tuple[Leg, ...], first: int, ratio: float) -> Profile:
        stands = False
        for leg in legs[first:]:
            stands = not run.leg(leg, ratio * leg.target)
            if stands:
                break
        length = legs[-1].stop if legs else 0.0
        return cls(tuple(run.pieces), inf if stands else run.t, length, legs, run.va, run.vd)


def _legs(segments: Iterable[tuple[float, float, float]], vd: float) -> tuple[Leg, ...]:
    """Return the segments with the speed at every end bounded by what lets all later ones be kept."""
    known = list(segments)
    bounds: list[float] = []
    limit = 0.0
    for length, _, end in reversed(known):
        limit = min(limit, end)
        bounds.append(limit)
        limit = sqrt(limit * limit + 2.0 * vd * length)
    legs: list[Leg] = []
    stop = 0.0
    for (length, target, _), bound in zip(known, reversed(bounds), strict=True):
        stop += length
        legs.append(Leg(stop, target, bound))
    return tuple(legs)


class _Run:
    """Where the sequence has come to while its pieces are laid."""

    __slots__ = ("pieces", "s", "t", "v", "va", "vd")

    def __init__(
        self, va: float, vd: float, t: float = 0.0, s: float = 0.0, v: float = 0.0, past: Iterable[Piece] = ()
    ) -> None:
        self.va, self.vd = va, vd
        self.t, self.s, self.v = t, s, v
        self.pieces = list(past)

    def leg(self, leg: Leg, target: float) -> bool:
        """Lay the pieces of one segment: brake to the target speed if entered faster, then rise, cruise, fall.

        Returns False where it comes to stand in it, at a target of 0.
        """
        if self.v > target:
            self._ramp(target, leg.stop - self.s)
        if target <= 0.0 and self.v <= 0.0:
            self.pieces.append(Piece(self.t, self.s, 0.0, 0.0))
            return False
        end = min(leg.bound, target)
        self._rise(target, end, leg.stop - self.s)
        left = leg.stop - self.s
        fall = (self.v * self.v - end * end) / (2.0 * self.vd) if self.v > end else 0.0
        if left > fall:
            self._cruise(left - fall)
        if fall > 0.0 and left > 0.0:
            self._ramp(end, leg.stop - self.s)
        self.s = leg.stop
        return True

    def _rise(self, target: float, end: float, left: float) -> None:
        """Go up to where the fall to `end` at VD begins; a segment too short to fall only rises."""
        va, vd, square = self.va, self.vd, self.v * self.v
        meeting = (2.0 * va * vd * left + vd * square + va * end * end) / (va + vd)
        peak = min(target, sqrt(max(square, min(meeting, square + 2.0 * va * left))))
        if peak > self.v:
            self._ramp(peak, left)

    def _cruise(self, way: float) -> None:
        self.pieces.append(Piece(self.t, self.s, self.v, 0.0))
        self.t += way / self.v
        self.s += way

    def _ramp(self, after: float, left: float) -> None:
        """Change the speed to `after`, or as far towards it as the way `left` allows."""
        v = self.v
        acceleration = self.va if after > v else -self.vd
        way = (after * after - v * v) / (2.0 * acceleration)
        if way - left > _ROUNDING:
            way = max(0.0, left)
            after = sqrt(max(0.0, v * v + 2.0 * acceleration * way))
        self.pieces.append(Piece(self.t, self.s, v, acceleration))
        # The mean speed gives the time without the cancellation in (after − v)/acceleration.
        self.t += 2.0 * way / (v + after)
        self.s += way
        self.v = after
