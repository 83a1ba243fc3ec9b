"""How fast a DMC-41x3 goes along the segments of a coordinated sequence, as a closed form.

Every segment has a length, a target speed (`<o`) and an end speed (`>p`). The controller accelerates towards the
target speed at VA, cruises, and brakes at VD just in time to have the end speed at the segment's end; it enters
the next segment with the speed it then has, and comes to rest at the end of the last. Lengths are in counts, measured
as the norm over the axes of the sequence; speeds in counts/s; accelerations in counts/s².
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

_ROUNDING = 1e-6
"""Counts: a ramp that misses its segment by less fits it; only rounding makes such a difference."""


class Piece(NamedTuple):
    """A stretch of constant acceleration: begins at time `t` [s], way `s`, speed `v`; lasts until the next."""

    t: float
    s: float
    v: float
    acceleration: float


@dataclass(frozen=True, slots=True)
class Profile:
    """Way and speed over time: pieces in order of time, `duration` [s] and `length` [counts] of the whole."""

    pieces: tuple[Piece, ...]
    duration: float
    length: float

    @classmethod
    def along(cls, segments: Iterable[tuple[float, float, float]], va: float, vd: float) -> Profile:
        """Return the profile over segments (length > 0, target speed > 0, end speed), begun at rest.

        The last end speed should be 0: what is left of the speed at the end of the sequence is cut off.
        """
        run = _Run(va, vd)
        for length, target, end in segments:
            run.segment(length, target, min(end, target))
        return cls(tuple(run.pieces), run.t, run.s)

    def at(self, t: float) -> tuple[float, float]:
        """Return (way [counts], speed [counts/s]) at time `t` [s]; before the start and after the end at rest."""
        if t <= 0.0 or not self.pieces:
            return 0.0, 0.0
        if t >= self.duration:
            return self.length, 0.0
        begun, s, v, acceleration = self.pieces[bisect_right(self.pieces, t, key=lambda piece: piece.t) - 1]
        passed = t - begun
        return min(self.length, s + passed * (v + 0.5 * acceleration * passed)), v + acceleration * passed


class _Run:
    """Where the sequence has come to while its pieces are laid."""

    __slots__ = ("pieces", "s", "t", "v", "va", "vd")

    def __init__(self, va: float, vd: float) -> None:
        self.va, self.vd = va, vd
        self.t = self.s = self.v = 0.0
        self.pieces: list[Piece] = []

    def segment(self, length: float, target: float, end: float) -> None:
        """Lay the pieces of one segment: brake to the target speed if entered faster, then rise, cruise, fall."""
        va, vd = self.va, self.vd
        stop = self.s + length
        if self.v > target:
            self._ramp(target, stop - self.s)
        v, left = self.v, stop - self.s
        square = v * v
        # Where a rise from v at VA meets the fall to `end` at VD; a segment too short to fall only rises.
        meeting = (2.0 * va * vd * left + vd * square + va * end * end) / (va + vd)
        peak = min(target, sqrt(max(square, min(meeting, square + 2.0 * va * left))))
        if peak > v:
            self._ramp(peak, left)
            left = stop - self.s
        fall = (self.v * self.v - end * end) / (2.0 * vd) if self.v > end else 0.0
        if left > fall:
            self._cruise(left - fall)
        if fall > 0.0:
            self._ramp(end, stop - self.s)
        self.s = stop

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
