"""From the fastest way to the segments that the controller drives.

The controller rises towards a segment's speed at VA and brakes at VD to its end speed, each within the segment; VD is
the deceleration of a stop and cannot be changed while a sequence runs. So a slow-down has steps: it is cut wherever the
speed has fallen by a step, and every piece is driven at the mean of its speeds, which takes as long. The speed is then
never a step away from the fastest way's, and the bound of the acceleration at any instant is the stop's. A rise at VA
is one ramp, and a gentler rise has as few steps as that rule requires.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.motion.knots import JUMPS, STEP, norms
from maya_un.motion.move import Segment, Segments
from maya_un.motion.speeds import NOTHING, Chords

LONGEST = 8_388_607
"""Largest distance of one axis in one segment [counts]."""

_STUB = 0.02
"""A level stretch shorter than this share of its chord gets no segment: so short a piece would be all rounding."""

SLOWEST = 2.0
"""Speeds are whole and even [counts/s]."""


class Ramps(NamedTuple):
    """The motion in every chord: from speed `start` to `top` at `up`, on at `top`, and to `end` at `down`; (n,) each.

    Speeds in counts/s, accelerations in counts/s², none of them 0.
    """

    start: Floats
    top: Floats
    end: Floats
    up: Floats
    down: Floats


class _ChordPieces(NamedTuple):
    """Pieces in order: the chord of each, the share of it where each ends, target speed, and speed at its end."""

    chord: NDArray[np.intp]
    share: Floats
    target: Floats
    end: Floats


def segments(
    chords: Chords, ramps: Ramps, slew: Floats, va: float, coarseness: float = 1.0, scale: float = 1.0
) -> Segments:
    """Return the segments along `chords`.

    `slew` (3, 1) are the slew speeds of the axes [counts/s]; no axis is faster than the share `scale` of its own. From
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
    """Return for every chord how much the axes' speeds may change from piece to piece (3, n), of their slew speeds."""
    corners = np.concatenate(([True], chords.sharp, [True]))
    return np.where(corners[1:] & corners[:-1], STEP, JUMPS)


def _pieces(chords: Chords, ramps: Ramps, va: float, own: Floats) -> _ChordPieces:
    lengths, rise, fall = chords.lengths, ramps.top - ramps.start, ramps.top - ramps.end
    haste = np.maximum(0.0, 1.0 - ramps.up / va)  # how much faster than wanted the controller's own ramp is
    rising = np.ceil(rise * haste / own - 1e-6).astype(np.intp)
    falling = np.ceil(fall / own - 1e-6).astype(np.intp)
    start, top, end = ramps.start * ramps.start, ramps.top * ramps.top, ramps.end * ramps.end
    up, down = 2.0 * ramps.up, 2.0 * ramps.down
    long_rise, long_fall = (top - start) / up, (top - end) / down
    even = lengths - long_fall - np.where(rising > 0, long_rise, 0.0)
    level = (even > _STUB * lengths) | (rising + falling == 0)
    # A single stair beside a level stretch needs no segment of its own: the level one begins or ends with that step.
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
    """Return the pieces in whole counts (3, m), and which of them are left, (m,).

    They end on whole counts of the axis that goes farthest, so that rounding turns the direction as little as
    can be.
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
    """Return the segments; what is longer than the controller takes in one goes in equal parts."""
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
