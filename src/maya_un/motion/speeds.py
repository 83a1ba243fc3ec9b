"""The fastest motion along a path, and its division into the segments that the controller drives.

The fastest motion has time-optimal speeds at the knots under the limits of every axis.

With x = v² along the path, v and u = dv/dt, an axis i whose direction is dᵢ and whose bend is cᵢ = dᵢ' moves at dᵢ v
and accelerates by dᵢ u + cᵢ x. Over a chord of length L at constant u, x changes by 2 L u. This is the problem of
time-optimal path parametrisation (Bobrow 1985), solved by reachability analysis (Pham and Pham, 2018): one pass
backwards finds for every knot the greatest x from which the rest can be done, one pass forwards takes the greatest u
that keeps below it. In a chord that can be faster in its middle than at both ends, it is.

Speeds are in counts/s, lengths in counts, as the norm over the axes.

Division of the fastest motion into the segments that the controller drives:

The controller accelerates to a segment's speed at VA and brakes at VD to its end speed, each within the segment; VD is
the deceleration of a stop and cannot be changed while a sequence runs. So a slow-down has steps: it is cut wherever the
speed has fallen by a step, and every piece is driven at the mean of its speeds, which takes as long. The speed then
differs by less than a step from the fastest motion's, and the stop's deceleration bounds the acceleration at any time.
A rise at VA is one ramp, and a gentler rise has as few steps as that rule requires.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.motion.move import JUMPS, STEP, Knots, Segment, Segments, norms, steps
from maya_un.motion.profile import Limits

_TINY = 1e-12

NOTHING = 1e-9
"""A smaller share of a chord counts as zero [counts per count]; divisions use this instead of 0."""

_FASTEST = 15_000_000
"""Greatest speed along a path [counts/s] (Galil DMC-41x3, commands VS, LI)."""

_LEAST = 1e-6
"""Least share of a chord for the limits: an axis with a smaller share limits only by its bend."""

MERCY = 1.5
"""Knots are placed for the allowed jumps; the speed is reduced where a jump exceeds them by this factor."""


class Chords(NamedTuple):
    """Straight pieces of a path: counts (3, n), lengths (n,) [counts], directions (3, n), bends at knots (3, n + 1).

    `smooth` (3, n) are the directions before rounding to counts, `turns` (3, n − 1) their changes at the knots, `sharp`
    (n − 1,) is True at corners. `shares` (3, n) are the shares of the axes in a chord, never 0. The axes come first,
    because numpy is faster so.
    """

    counts: Floats
    lengths: Floats
    directions: Floats
    bends: Floats
    smooth: Floats
    turns: Floats
    sharp: NDArray[np.bool_]
    shares: Floats

    @classmethod
    def of(cls, knots: Knots) -> Chords:
        """Return the chords between knots; a sharp corner has no bend, because it is passed next to rest."""
        counts, smooth = steps(knots.counts), steps(knots.exact)
        lengths = norms(counts)
        directions = counts / lengths
        smooth /= norms(smooth)
        turns = smooth[:, 1:] - smooth[:, :-1]
        bends = np.zeros((3, len(lengths) + 1))
        bends[:, 1:-1] = 2.0 * turns / (lengths[1:] + lengths[:-1])
        bends[:, knots.sharp] = 0.0
        shares = np.maximum(np.abs(directions), NOTHING)
        return cls(counts, lengths, directions, bends, smooth, turns, knots.sharp[1:-1], shares)


def caps(chords: Chords, limits: Limits, scale: float) -> tuple[Floats, Floats]:
    """Return the greatest speeds within the chords, (n,), and at the knots, (n + 1,), by the slew speeds.

    `scale` slows the slew speeds. The ends of the path are at rest.
    """
    slew = limits.slew
    within = np.minimum(_FASTEST, scale * (slew / chords.shares).min(axis=0))
    at = np.zeros(len(within) + 1)
    if len(within) > 1:
        allowed = np.where(chords.sharp, STEP * slew, MERCY * slew * JUMPS)
        held = (allowed / np.maximum(np.abs(chords.turns), _TINY)).min(axis=0)
        at[1:-1] = np.minimum(np.minimum(within[:-1], within[1:]), held)
    return within, at


class Budget(NamedTuple):
    """The axes' limits of acceleration and deceleration along every chord, with the controller itself as a fourth axis.

    In the middle of a chord, where x has become x + L u, an axis accelerates by (dᵢ + cᵢL) u + cᵢ x. `up` and `down`
    (4, n) are aᵢ/|dᵢ + cᵢL| [counts/s²] and `bend` (4, n) is cᵢ/(dᵢ + cᵢL): −(down + bend x) ≤ u ≤ up − bend x.
    """

    up: Floats
    down: Floats
    bend: Floats

    @classmethod
    def of(cls, chords: Chords, limits: Limits, most_up: float, most_down: float) -> Budget:
        """Return the budget; the controller itself rises by at most `most_up`, falls by at most `most_down`."""
        bends = 0.5 * (chords.bends[:, 1:] + chords.bends[:, :-1])
        effect = chords.directions + bends * chords.lengths
        share = np.maximum(np.abs(effect), _LEAST)
        up, down, bend = np.empty((3, 4, len(chords.lengths)))
        up[:3], up[3] = limits.rise / share, most_up
        down[:3], down[3] = limits.fall / share, most_down
        bend[:3], bend[3] = bends / np.copysign(share, effect), 0.0
        return cls(up, down, bend)

    def less(self, share: Floats) -> Budget:
        """Return the budget with a share (n,) of its accelerations."""
        return Budget(self.up * share, self.down * share, self.bend)

    def most(self) -> Floats:
        """Return the greatest x at the start of every chord, (n,), for which all axes allow a common u."""
        apart = self.bend - self.bend[:, np.newaxis]
        room = self.up + self.down[:, np.newaxis]
        most = np.where(apart > 0.0, room / np.maximum(apart, _TINY * _TINY), np.inf)
        return most.reshape(-1, most.shape[-1]).min(axis=0)


def knot_squares(chords: Chords, budget: Budget, at: Floats) -> Floats:
    """Return x = v² at every knot, (n + 1,), below the squares of the caps `at`.

    From x at the start of a chord its end is reached at x + 2 L u, so backwards x (1 − 2 L bend) ≤ x' + 2 L down, and
    forwards x' ≤ x (1 − 2 L bend) + 2 L up.
    """
    double = 2.0 * chords.lengths
    kept = 1.0 - double * budget.bend
    squares = at * at
    squares[:-1] = np.minimum(squares[:-1], budget.most())
    back = 1.0 / np.maximum(kept, _TINY)
    squares[-2::-1] = _held(squares[::-1], back[:, ::-1], (double * budget.down * back)[:, ::-1])
    squares[1:] = _held(squares, kept, double * budget.up)
    return squares


def _held(squares: Floats, slopes: Floats, offsets: Floats) -> Floats:
    """Return the squares (n,) after the first of (n + 1,), each no more than any line (4, n) of the one before it.

    Most are not limited. From one that is, the following squares are recomputed as long as they are limited too.
    """
    reached = (slopes * squares[:-1] + offsets).min(axis=0)
    held = (reached < squares[1:]).nonzero()[0].tolist()
    if not held:
        return squares[1:]
    found, lines = squares.tolist(), np.concatenate((slopes, offsets))
    seen = -1
    for first in held:
        for k in range(max(first, seen + 1), len(reached)):
            s0, s1, s2, s3, o0, o1, o2, o3 = lines[:, k].tolist()
            before = found[k]
            least = min(s0 * before + o0, s1 * before + o1, s2 * before + o2, s3 * before + o3)
            seen = k
            if least >= found[k + 1]:
                break
            found[k + 1] = max(0.0, least)
    return np.array(found[1:])


def peaks(chords: Chords, budget: Budget, within: Floats, squares: Floats) -> tuple[Floats, Floats, Floats]:
    """Return for every chord the greatest x inside it and the rates up to it and down from it, (n,) each.

    If a chord only rises, or only falls, its peak is at that end, and the rate follows from it.
    """
    start, end = squares[:-1], squares[1:]
    ceiling, room = within * within, 2.0 * chords.lengths
    reached = np.minimum(ceiling, start + room * budget.up.min(axis=0))
    up = (budget.up - np.maximum(0.0, budget.bend) * reached).min(axis=0)
    down = (budget.down + np.minimum(0.0, budget.bend) * reached).min(axis=0)
    usable = (up > _TINY) & (down > _TINY)
    up, down = np.where(usable, up, 1.0), np.where(usable, down, 1.0)
    top = np.minimum(ceiling, (up * down * room + down * start + up * end) / (up + down))
    higher = np.maximum(start, end)
    inside = usable & (top >= higher * (1.0 - 1e-9))
    top = np.maximum(top, higher)
    change = (end - start) / room
    return (
        np.where(inside, top, higher),
        np.where(inside, up, np.maximum(change, _TINY)),
        np.where(inside, down, np.maximum(-change, _TINY)),
    )


LONGEST = 8_388_607
"""Largest distance of one axis in one segment [counts]."""

_STUB = 0.02
"""A level stretch shorter than this share of its chord gets no segment, because it would be mostly rounding."""

SLOWEST = 2.0
"""Speeds are whole and even [counts/s]."""


class Ramps(NamedTuple):
    """The motion in every chord: from speed `start` up to `top`, on at `top`, and down to `end`; (n,) each.

    `up` is the acceleration, `down` the deceleration. Speeds in counts/s, accelerations in counts/s², none of them 0.
    """

    start: Floats
    top: Floats
    end: Floats
    up: Floats
    down: Floats


class _ChordPieces(NamedTuple):
    """Pieces of chords in order: index of the chord, passed share of the chord at the end of the piece, and speeds.

    `target` is the target speed, `end` the speed at the end of the piece [counts/s].
    """

    chord: NDArray[np.intp]
    share: Floats
    target: Floats
    end: Floats


def segments(
    chords: Chords, ramps: Ramps, slew: Floats, va: float, coarseness: float = 1.0, scale: float = 1.0
) -> Segments:
    """Return the segments along `chords`.

    `slew` (3, 1) are the slew speeds of the axes [counts/s]; no axis exceeds the share `scale` of its slew speed. From
    one piece to the next the speed of no axis changes by more than `STEP` of its slew speed, on curves by no more than
    its share in `JUMPS`, times `coarseness`.
    """
    steps = coarseness * _shares(chords) * slew
    pieces = _pieces(chords, ramps, va, (steps / chords.shares).min(axis=0))
    counts, keep = _whole(chords, pieces)
    chord = pieces.chord[keep]
    lengths = norms(counts)
    shares = np.maximum(np.abs(counts), NOTHING)
    allowed = (scale * slew / shares).min(axis=0) * lengths
    target = _even(np.minimum(pieces.target[keep], allowed))
    end = np.minimum(target, _even(pieces.end[keep]))
    end[:-1] = np.minimum(end[:-1], target[1:])
    end[-1] = 0.0
    own = (steps.take(chord, axis=1) / shares).min(axis=0) * lengths
    # Steps shorter than a count are lost to rounding. Then a piece ends with at most a step. For very slow axes, for
    # which a step is nothing, it ends with a speed that a count suffices to brake from.
    tiny = own < 2.0 * SLOWEST
    if tiny.any():
        own = np.where(tiny, np.sqrt(end * end + 2.0 * ramps.down[chord]) - end, own)
    target = np.maximum(end, np.minimum(target, _even(end + own)))
    found = Segments(counts.T.astype(np.int64, order="C"), target.astype(np.int64), end.astype(np.int64))
    return found if shares.max(initial=0.0) <= LONGEST else _split(found)


def _shares(chords: Chords) -> Floats:
    """Return the allowed change of speed from piece to piece on every chord (3, n), as shares of the slew speeds."""
    corners = np.concatenate(([True], chords.sharp, [True]))
    return np.where(corners[1:] & corners[:-1], STEP, JUMPS)


def _pieces(chords: Chords, ramps: Ramps, va: float, own: Floats) -> _ChordPieces:
    lengths, rise, fall = chords.lengths, ramps.top - ramps.start, ramps.top - ramps.end
    haste = np.maximum(0.0, 1.0 - ramps.up / va)  # factor by which the controller's own ramp is too fast
    rising = np.ceil(rise * haste / own - 1e-6).astype(np.intp)
    falling = np.ceil(fall / own - 1e-6).astype(np.intp)
    start, top, end = ramps.start * ramps.start, ramps.top * ramps.top, ramps.end * ramps.end
    up, down = 2.0 * ramps.up, 2.0 * ramps.down
    long_rise, long_fall = (top - start) / up, (top - end) / down
    even = lengths - long_fall - np.where(rising > 0, long_rise, 0.0)
    level = (even > _STUB * lengths) | (rising + falling == 0)
    # A single step beside a level stretch needs no separate segment: the level one begins or ends with that step.
    rising[level & (rising == 1) & (2.0 * long_rise < lengths)] = 0
    blunt = level & (falling == 1)
    falling[blunt] = 0
    stairs = rising + level
    number = stairs + falling
    behind = number.cumsum()
    chord = np.arange(len(number)).repeat(number)
    place = np.arange(1, len(chord) + 1) - (behind - number)[chord]
    flat = stairs[chord]
    # The speed at the start and at the end of each piece: equal steps up, the top, equal steps down.
    up_step = (rise / np.maximum(rising, 1))[chord]
    down_step = (fall / np.maximum(falling, 1))[chord]
    tops = (ramps.top - np.where(blunt, 0.5 * fall * long_fall / lengths, 0.0))[chord]
    is_up, is_down = place <= rising[chord], place > flat
    after = np.where(
        is_up, ramps.start[chord] + place * up_step, ramps.top[chord] - np.maximum(place - flat, 0) * down_step
    )
    target = np.where(is_up, after - 0.5 * haste[chord] * up_step, np.where(is_down, after + 0.5 * down_step, tops))
    square, whole = after * after, lengths[chord]
    by_rise = (square - start[chord]) / up[chord]
    by_fall = whole - (square - end[chord]) / down[chord]
    share = np.where(is_up, by_rise, by_fall) / whole
    share[behind - 1], after[behind - 1] = 1.0, ramps.end
    return _ChordPieces(chord, share, target, after)


def _whole(chords: Chords, pieces: _ChordPieces) -> tuple[Floats, NDArray[np.intp]]:
    """Return the pieces in whole counts (3, m), and the indices of the remaining ones, (m,).

    They end on whole counts of the axis that moves farthest, so that rounding turns the direction as little as
    possible.
    """
    longest = np.abs(chords.counts).max(axis=0)[pieces.chord]
    share = np.rint(pieces.share * longest) / longest
    begun = chords.counts.cumsum(axis=1) - chords.counts
    places = np.rint(begun.take(pieces.chord, axis=1) + chords.counts.take(pieces.chord, axis=1) * share)
    steps = places.copy()
    steps[:, 1:] -= places[:, :-1]
    keep = steps.any(axis=0).nonzero()[0]
    return steps if len(keep) == len(share) else steps[:, keep], keep


def _even(speeds: Floats) -> Floats:
    even = np.floor(speeds * 0.5 + 1e-9)
    even *= 2.0
    return np.maximum(SLOWEST, even, out=even)


def _split(segments: Segments) -> Segments:
    """Return the segments, with those too long for the controller divided into equal parts."""
    found: list[Segment] = []
    for (a, b, c), target, end in segments:
        parts = ceil(max(abs(a), abs(b), abs(c)) / LONGEST)
        done = (0, 0, 0)
        for part in range(1, parts + 1):
            reached = (round(a * part / parts), round(b * part / parts), round(c * part / parts))
            step = (reached[0] - done[0], reached[1] - done[1], reached[2] - done[2])
            found.append(Segment(step, target, target if part < parts else end))
            done = reached
    return Segments.of(found)
