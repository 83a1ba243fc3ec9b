"""Time-optimal speeds made gentle: no axis' acceleration changes faster than its jerk limit.

The fastest way along the path is slowed a little and replaced by its mean over a window (`maya_un.motion.span`),
along the same path. Sharp corners are rests, and what lies between two rests is a stretch with a window of its own, no
longer than its jerk asks for. The axes' speeds, accelerations and jerks are looked at along all of it
(`maya_un.motion.span`). If a limit is exceeded, the window is widened or the allowed speed lowered, and the fastest
motion is computed again, a few times. The robot drives the best of these, slowed evenly until it keeps all limits. On
one straight line in the joints nothing is left to slow, and with accelerations as great as decelerations it is the
fastest way there is.

The controller follows by steps of speed: the limit applies to the change of the acceleration between their means. A
step itself is a change of speed that the controller carries out at VA and VD. So is a corner too slight to be a rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Self

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.motion.knots import STEP, Knots
from maya_un.motion.limits import Limits
from maya_un.motion.segmentation import Ramps
from maya_un.motion.span import ChordLimits, ChordSpan, Smooth
from maya_un.motion.speeds import Chords

Fastest = Callable[[Floats, Floats, Floats], Ramps]
"""The fastest way by the greatest speeds within chords (n,), at knots (n + 1,), and shares of accelerations (n,)."""

Allowed = Callable[[Floats], Floats]
"""From requested speeds on the chords (n,) to safe ones, infinite if the requested speed is safe."""

_ROUNDS = 12
_GOOD = 1.002
_WIDEST = 2.0
"""A window so much wider than an acceleration asks for has room for one up and one down."""

_OFF, _SLOW = 0.25, 0.02
"""The driven motion may differ from the plan by a step's share of the speed, within these shares of the greatest."""

_FINE = np.arange(8) / 8.0
_TINY = 1e-12


def smoothed(
    knots: Knots,
    limits: Limits,
    within: Floats,
    at: Floats,
    fastest: Fastest,
    allowed: Allowed | None = None,
    coarseness: float = 1.0,
) -> tuple[Chords, Ramps]:
    """Return chords and ramps that follow the fastest way along `knots` which keeps the limits of jerk.

    `within` (n,) and `at` (n + 1,) are the greatest speeds within the chords and at the knots [counts/s]. Chords are
    divided straight on, in whole counts, where the acceleration changes; with a greater `coarseness` less often.
    """
    found = gentle(knots, limits, within, at, fastest, allowed)
    return _driven(knots, [_EvenPieces.of(stretch, smooth, coarseness) for stretch, smooth in found])


def gentle(
    knots: Knots, limits: Limits, within: Floats, at: Floats, fastest: Fastest, allowed: Allowed | None = None
) -> list[tuple[ChordSpan, Smooth]]:
    """Return the stretches of a path, and for each the shortest way over time that was found; as `smoothed`."""
    rests = _rests(knots, within, at)
    stretches = [ChordSpan.of(knots, limits, first, last) for first, last in pairwise(rests)]
    at = at.copy()
    at[rests] = 0.0
    search = _Search(stretches, within, at, fastest)
    for _ in range(_ROUNDS):
        looks, tops = search.look()
        safe = np.full(len(tops), inf) if allowed is None else allowed(tops)
        if search.learn(looks, tops / safe):
            break
    return list(zip(stretches, search.best(), strict=True))


def _rests(knots: Knots, within: Floats, at: Floats) -> list[int]:
    """Return the knots at which the path comes to rest: its ends, and the corners where an axis' speed would jump."""
    inner = knots.sharp[1:-1] & (at[1:-1] < np.minimum(within[:-1], within[1:]))
    return [0, *(np.flatnonzero(inner) + 1).tolist(), len(within)]


class _Search:
    """Attempts for all spans of a path, and the best result of each.

    `tried` (n,) are the greatest speeds within chords that were sought with last, `share` (n,) how much of the
    accelerations, `widths` how much wider the windows are than need be.
    """

    def __init__(self, stretches: list[ChordSpan], within: Floats, at: Floats, fastest: Fastest) -> None:
        self._stretches, self._within, self._at, self._fastest = stretches, within, at, fastest
        self._ramps = fastest(within, at, np.ones(len(within)))
        self._share = self._spread([stretch.share(self._ramps) for stretch in stretches])
        self._tried = np.minimum(within, np.concatenate([stretch.bent_slowly() for stretch in stretches]))
        self._widths = [1.0] * len(stretches)
        self._smooth: list[Smooth] = []
        self._best: list[Smooth | None] = [None] * len(stretches)

    def best(self) -> list[Smooth]:
        """Return the best of every stretch."""
        return [smooth for smooth in self._best if smooth is not None]

    def look(self) -> tuple[list[ChordLimits], Floats]:
        """Return what the way over time is like that belongs to what is tried, and its speeds on the chords (n,)."""
        each = list(zip(self._stretches, self._widths, strict=True))
        self._ramps = self._sought(self._tried)
        level = self._spread([stretch.level(self._ramps, width) for stretch, width in each])
        if np.any(level < self._ramps.top):
            self._ramps = self._sought(np.minimum(self._tried, level))
        self._smooth = [stretch.mean(self._ramps, width) for stretch, width in each]
        found = zip(self._stretches, self._smooth, strict=True)
        looks = [stretch.look(smooth, self._within, self._at) for stretch, smooth in found]
        return looks, np.concatenate([look.tops for look in looks])

    def learn(self, looks: list[ChordLimits], unsafe: Floats) -> bool:
        """Keep what is better than the best, choose what to try next; return whether there is no need.

        `unsafe` (n,) is how much faster than allowed it is for any other reason.
        """
        good = True
        for number, (stretch, look) in enumerate(zip(self._stretches, looks, strict=True)):
            excess = np.maximum(look.excess, unsafe[stretch.part])
            worst = float(excess.max())
            self._keep(number, worst)
            good = good and worst <= _GOOD
            if look.strain > _GOOD and self._widths[number] < _WIDEST:
                self._widths[number] = min(_WIDEST, self._widths[number] * look.strain)
            else:
                self._hold_back(stretch.part, _beside(excess), _beside(look.pull))
        return good

    def _keep(self, number: int, worst: float) -> None:
        smooth, best = self._smooth[number], self._best[number]
        kept = smooth if worst <= 1.0 else smooth.slowed(worst)
        if best is None or kept.duration < best.duration:
            self._best[number] = kept

    def _hold_back(self, part: slice, excess: Floats, pull: Floats) -> None:
        lower = np.minimum(self._tried, self._ramps.top)[part] / excess
        self._tried[part] = np.where(excess > 1.0, lower, self._tried[part])
        self._share[part] /= pull

    def _sought(self, within: Floats) -> Ramps:
        beside = np.minimum(np.append(within, inf), np.concatenate(([inf], within)))
        return self._fastest(within, np.minimum(self._at, beside), self._share)

    def _spread(self, values: list[float]) -> Floats:
        """Return what holds for whole stretches for each of their chords (n,)."""
        return np.repeat(values, [stretch.last - stretch.first for stretch in self._stretches])


def _beside(excess: Floats) -> Floats:
    """Return by how much to hold back every chord (n,) for its own sake and that of the chords beside it, 1 or more."""
    much = np.pad(np.maximum(1.0, excess), 1, constant_values=1.0)
    return np.maximum(np.maximum(much[:-2], much[2:]), much[1:-1])


@dataclass(frozen=True, eq=False)
class _EvenPieces:
    """Pieces in which the acceleration may be taken for constant, (m,) each; no knot lies within one.

    They have the chord of each, the share of it, the time [s] and the speed at its end.
    """

    chord: NDArray[np.intp]
    share: Floats
    until: Floats
    end: Floats

    @classmethod
    def of(cls, stretch: ChordSpan, smooth: Smooth, coarseness: float) -> Self:
        """Return the pieces of a stretch; times are since its start."""
        knots = np.concatenate(([0.0], smooth.when(stretch.ways[1:-1]), [smooth.duration]))
        events = np.unique(np.concatenate((smooth.times, knots)))
        grid = np.unique(np.append(events[:-1, np.newaxis] + np.diff(events)[:, np.newaxis] * _FINE, events[-1]))
        way, speed, _ = smooth.at(grid)
        speed[0] = speed[-1] = 0.0
        top = float(speed.max())
        off = STEP * coarseness * np.clip(speed, _SLOW * top, _OFF * top)
        cuts = _cuts(grid, speed, off, np.searchsorted(grid, np.union1d(knots, smooth.cruises())))
        chord = np.clip(np.searchsorted(knots, grid[cuts[:-1]], side="right") - 1, 0, len(knots) - 2)
        share = (way[cuts[1:]] - stretch.ways[chord]) / np.diff(stretch.ways)[chord]
        return cls(chord + stretch.first, np.clip(share, 0.0, 1.0), grid[cuts[1:]], speed[cuts[1:]])


def _cuts(grid: Floats, values: Floats, off: Floats, cuts: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return places of a grid, `cuts` among them, between which straight lines are nowhere more than `off` off."""
    while True:
        excess = np.abs(values - np.interp(grid, grid[cuts], values[cuts])) / off
        worst = np.maximum.reduceat(excess, cuts[:-1])
        owner = np.clip(np.searchsorted(cuts, np.arange(len(grid)), side="right") - 1, 0, len(cuts) - 2)
        fresh = np.flatnonzero((excess > 1.0) & (excess == worst[owner]))
        if not len(fresh):
            return cuts
        cuts = np.unique(np.concatenate((cuts, fresh)))


def _driven(knots: Knots, stretches: list[_EvenPieces]) -> tuple[Chords, Ramps]:
    """Return the pieces in whole counts, as chords and as ramps along them, without those shorter than a count."""
    chord = np.concatenate([pieces.chord for pieces in stretches])
    begun = np.cumsum([0.0, *(pieces.until[-1] for pieces in stretches[:-1])])
    until = np.concatenate([at + pieces.until for at, pieces in zip(begun, stretches, strict=True)])
    end = np.concatenate([pieces.end for pieces in stretches])
    last = _last(chord)
    share = np.concatenate([pieces.share for pieces in stretches])
    share[last] = 1.0
    steps = np.diff(knots.counts, axis=0)
    longest = np.abs(steps).max(axis=1)[chord]
    share = np.rint(share * longest) / longest
    places = knots.counts[chord] + np.rint(steps[chord] * share[:, np.newaxis]).astype(np.int64)
    kept = np.any(np.diff(places, axis=0, prepend=knots.counts[:1]) != 0, axis=1)
    at_knots = _last(chord[kept])
    ends, times = end[kept], until[kept]
    ends[at_knots], times[at_knots] = end[last], until[last]
    sharp = np.concatenate(([True], at_knots & knots.sharp[chord[kept] + 1]))
    counts = np.concatenate((knots.counts[:1], places[kept]))
    chords = Chords.of(Knots(counts, counts.astype(np.float64), sharp, ()))
    return chords, _ramps(chords.lengths, ends, np.diff(times, prepend=0.0))


def _last(chord: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return which pieces are the last of their chords."""
    return np.append(chord[1:] != chord[:-1], True)


def _ramps(lengths: Floats, end: Floats, spans: Floats) -> Ramps:
    """Return ramps that rise all the way or fall all the way; from rest to rest up and down in their time."""
    start = np.concatenate(([0.0], end[:-1]))
    top = np.maximum(start, end)
    hop = top <= 0.0
    top = np.where(hop, 2.0 * lengths / spans, top)
    room = np.where(hop, lengths, 2.0 * lengths)
    up, down = ((top**2 - speed**2) / room for speed in (start, end))
    return Ramps(start, top, end, np.maximum(up, _TINY), np.maximum(down, _TINY))
