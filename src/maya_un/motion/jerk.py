"""The motion between two rests, smoothed so that no axis exceeds its jerk limit.

The span of a path between two rests, and the smoothed motion of the axes along it over time.

Let V be a speed that is linear in time between its corners, A its slope and S the way. The mean over a window τ has

    the speed          v(t) = (S(t) − S(t − τ))/τ
    the acceleration   a(t) = (V(t) − V(t − τ))/τ
    the jerk           j(t) = (A(t) − A(t − τ))/τ

and takes τ longer from rest to rest. The corners of a are the corners of V and the same corners τ later; between them
the jerk is constant. If V rises with A to a cruise not shorter than τ, and falls likewise, and A = Jτ, this is the
fastest motion over a distance under limits of speed, acceleration and the jerk J.

With direction d, bend c = d' and the way s, v = s', a = v', j = a', an axis has the

    acceleration   d a + c v²
    jerk           d j + d' v a + 2 c v a + c' v³

where d and c are interpolated linearly between their values at the knots.

Time-optimal speeds, smoothed: no axis' acceleration changes faster than its jerk limit.

The fastest motion along the path is slowed a little and replaced by its mean over a window (`Smooth.mean`), along the
same path. Sharp corners are rests. Each stretch between two rests has a separate window, no longer than its jerk
requires. The axes' speeds, accelerations and jerks are checked along all of it (`ChordSpan.look`). If a limit is
exceeded, the window is widened or the allowed speed lowered, and the fastest motion is computed again, a few times. The
robot drives the best of these, slowed evenly until it keeps all limits. On one straight line in the joints no slowing
remains, and with accelerations as great as decelerations it is the fastest motion possible.

The controller follows by steps of speed: the limit applies to the change of the acceleration between their means. A
step itself is a change of speed that the controller executes at VA and VD. So is a corner too slight to be a rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import cbrt, inf, sqrt
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.motion.move import STEP, Knots
from maya_un.motion.profile import Limits
from maya_un.motion.speeds import Chords, Ramps

SHORTEST = 1e-3
"""Shortest window [s]: the controller itself samples no finer (Galil DMC-41x3, command TM)."""

_BISECTIONS = 48


@dataclass(frozen=True, eq=False)
class Ramped:
    """A speed that is linear between times (m,) [s]: `speeds` and `ways` at them, (m,) each, from rest to rest."""

    times: Floats
    speeds: Floats
    ways: Floats

    @classmethod
    def over(cls, spans: Floats, speeds: Floats) -> Self:
        """Return the speed that changes in `spans` (m − 1,) [s] from each of `speeds` (m,) to the next.

        Spans of 0 are dropped.
        """
        kept = np.concatenate(([True], spans > 0.0))
        times = np.concatenate(([0.0], np.cumsum(spans)))[kept]
        speeds = speeds[kept]
        gone = 0.5 * np.diff(times) * (speeds[1:] + speeds[:-1])
        return cls(times, speeds, np.concatenate(([0.0], np.cumsum(gone))))

    def way(self, times: Floats) -> Floats:
        """Return the ways at any times, also before the start and after the end."""
        within = np.clip(times, 0.0, self.times[-1])
        here = np.clip(np.searchsorted(self.times, within, side="right") - 1, 0, len(self.times) - 2)
        mean = 0.5 * (self.speeds[here] + np.interp(within, self.times, self.speeds))
        return self.ways[here] + (within - self.times[here]) * mean

    def level(self, window: float) -> float:
        """Return the speed to which the highest peak must be cut to last for `window` [s].

        Its own speed if it lasts as long.
        """
        peak = int(self.speeds.argmax())
        low, high = 0.0, float(self.speeds[peak])
        if self._lasts(peak, high) >= window:
            return high
        for _ in range(_BISECTIONS):
            tried = 0.5 * (low + high)
            low, high = (tried, high) if self._lasts(peak, tried) >= window else (low, tried)
        return low

    def _lasts(self, peak: int, level: float) -> float:
        """Return how long the peak lasts when it is cut to a level above 0 [s]."""
        before = int(np.flatnonzero(self.speeds[: peak + 1] < level)[-1])
        after = peak + int(np.flatnonzero(self.speeds[peak:] < level)[0])
        begun, ended = self._crossing(before, level), self._crossing(after - 1, level)
        return (ended - begun) / level

    def _crossing(self, piece: int, level: float) -> float:
        """Return the way at which a piece that rises or falls through `level` has this speed."""
        one, two = self.speeds[piece : piece + 2].tolist()
        share = (level - one) * (level + one) / ((two - one) * (two + one))
        return float(self.ways[piece] + share * (self.ways[piece + 1] - self.ways[piece]))


@dataclass(frozen=True, eq=False)
class Smooth:
    """The way over time: at `times` (m,) [s] the ways, speeds, accelerations; the jerk between them, (m − 1,)."""

    times: Floats
    ways: Floats
    speeds: Floats
    accelerations: Floats
    jerks: Floats

    @classmethod
    def mean(cls, ramped: Ramped, window: float) -> Self:
        """Return the mean of a speed over a window [s]."""
        times = np.sort(np.concatenate((ramped.times, ramped.times + window)))
        times = times[np.concatenate(([True], np.diff(times) > 1e-9 * window))]
        speeds = (ramped.way(times) - ramped.way(times - window)) / window
        now, then = (np.interp(at, ramped.times, ramped.speeds) for at in (times, times - window))
        accelerations = (now - then) / window
        spans = np.diff(times)
        jerks = np.diff(accelerations) / spans
        gone = spans * (speeds[:-1] + spans * (accelerations[:-1] / 2.0 + spans * jerks / 6.0))
        ways = np.concatenate(([0.0], np.cumsum(gone)))
        return cls(times, ways * (ramped.ways[-1] / ways[-1]), speeds, accelerations, jerks)

    @property
    def duration(self) -> float:
        """Time from rest to rest [s]."""
        return float(self.times[-1])

    def slowed(self, factor: float) -> Smooth:
        """Return the same motion, `factor` times as long."""
        return Smooth(
            self.times * factor,
            self.ways,
            self.speeds / factor,
            self.accelerations / factor**2,
            self.jerks / factor**3,
        )

    def cruises(self) -> Floats:
        """Return the times [s] at which cruises begin, then those at which they end.

        A cruise counts if it lasts a hundredth of the whole duration or more.
        """
        even = np.abs(self.accelerations) <= 1e-6 * np.abs(self.accelerations).max()
        long = even[:-1] & even[1:] & (np.diff(self.times) >= 0.01 * self.duration)
        return np.concatenate((self.times[:-1][long], self.times[1:][long]))

    def interval(self, times: Floats) -> NDArray[np.intp]:
        """Return the indices of the intervals that contain times (n,)."""
        return np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.jerks) - 1)

    def at(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ways, speeds and accelerations at times (n,) between start and end."""
        return self.along(self.interval(times), times)

    def when(self, ways: Floats) -> Floats:
        """Return the times (n,) at which ways (n,) are reached."""
        here = np.clip(np.searchsorted(self.ways, ways, side="right") - 1, 0, len(self.jerks) - 1)
        early, late = self.times[here], self.times[here + 1]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (early + late)
            behind = self.along(here, middle)[0] < ways
            early, late = np.where(behind, middle, early), np.where(behind, late, middle)
        return late

    def along(self, here: NDArray[np.intp], times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ways, speeds and accelerations at times (n,) or (n, k) that lie in the intervals `here` (n,)."""
        here = here.reshape(-1, *[1] * (times.ndim - 1))
        passed, jerk = times - self.times[here], self.jerks[here]
        acceleration = self.accelerations[here]
        speed = self.speeds[here] + passed * (acceleration + 0.5 * passed * jerk)
        way = self.ways[here] + passed * (self.speeds[here] + passed * (acceleration / 2.0 + passed * jerk / 6.0))
        return way, np.maximum(0.0, speed), acceleration + passed * jerk


_PARTS = np.linspace(0.0, 1.0, 5)
_LEAST = 1e-12
_ROUNDING = 1e-9


class ChordLimits(NamedTuple):
    """For every chord (n,): the factor by which a stretch must be slowed to keep all limits, and its greatest speed.

    `pull` (n,) are the greatest ratios of an axis' acceleration to its limit, `strain` is the greatest ratio of jerk to
    limit.
    """

    excess: Floats
    tops: Floats
    pull: Floats
    strain: float


@dataclass(frozen=True, eq=False)
class ChordSpan:
    """Chords `first` to before `last` of a path, from rest to rest, and the limits of their axes.

    `ways` (n + 1,) are the ways to the knots [counts]. Directions and bends are those at the knots (n + 1, 3);
    `forward` (n, 3) is the sign of each axis' motion on the chords, 1 or −1; `most` (n,) the greatest jerk along each
    [counts/s³].
    """

    first: int
    last: int
    limits: Limits
    ways: Floats
    directions: Floats
    bends: Floats
    forward: Floats
    most: Floats

    @classmethod
    def of(cls, knots: Knots, limits: Limits, first: int, last: int) -> ChordSpan:
        """Return the stretch between two knots."""
        here = slice(first, last + 1)
        chords = Chords.of(Knots(knots.counts[here], knots.exact[here], knots.sharp[here], ()))
        bends = chords.bends.T.copy()
        if last - first > 1:  # at rest a bend has no effect; a value of 0 would look like a change
            bends[0], bends[-1] = bends[1], bends[-2]
        half, smooth = 0.5 * chords.lengths[:, np.newaxis], chords.smooth.T
        directions = np.concatenate((smooth[:1], smooth[:-1] + bends[1:-1] * half[:-1], smooth[-1:]))
        ways = np.concatenate(([0.0], np.cumsum(chords.lengths)))
        share = np.maximum(np.maximum(np.abs(directions[1:]), np.abs(directions[:-1])), _LEAST)
        most = np.min(np.array(limits.jerk) / share, axis=1)
        return cls(first, last, limits, ways, directions, bends, np.copysign(1.0, chords.directions.T), most)

    @property
    def part(self) -> slice:
        """Its chords among those of the path."""
        return slice(self.first, self.last)

    def bent_slowly(self) -> Floats:
        """Return the greatest speeds (n,) at which the change of the bend alone, c' v³, keeps the limits."""
        lengths = np.diff(self.ways)[:, np.newaxis]
        change = np.maximum(np.abs(np.diff(self.bends, axis=0)) / lengths, _LEAST**2)
        return np.cbrt(np.min(np.array(self.limits.jerk) / change, axis=1))

    def share(self, ramps: Ramps) -> float:
        """Return the best share of the accelerations.

        It is below 1 if the stretch is too short, or too slow, to accelerate for as long as the window: with the least
        of the greatest jerks J, length L and speed v, accelerations above ∛(L J²/2) or √(v J) are useless.
        """
        fastest, jerk = float(ramps.top[self.part].max()), float(self.most.min())
        useful = min(cbrt(0.5 * float(self.ways[-1]) * jerk * jerk), sqrt(fastest * jerk))
        return min(1.0, useful / max(_LEAST, float(self._steepest(ramps).max())))

    def level(self, ramps: Ramps, width: float) -> float:
        """Return the speed to which the highest peak must be cut to last as long as the window.

        Infinite for a wider window.
        """
        return inf if width > 1.0 else self._ramped(ramps).level(self._window(ramps))

    def mean(self, ramps: Ramps, width: float) -> Smooth:
        """Return the mean of the fastest motion over `width` times the window that its accelerations require."""
        return Smooth.mean(self._ramped(ramps), width * self._window(ramps))

    def _window(self, ramps: Ramps) -> float:
        return max(SHORTEST, float(np.max(self._steepest(ramps) / self.most)))

    def _steepest(self, ramps: Ramps) -> Floats:
        """Return the greatest acceleration along every chord (n,), up or down."""
        rises, falls = ramps.top > ramps.start, ramps.top > ramps.end
        return np.maximum(np.where(rises, ramps.up, 0.0), np.where(falls, ramps.down, 0.0))[self.part]

    def _ramped(self, ramps: Ramps) -> Ramped:
        """Return the speed over time of this stretch."""
        here = self.part
        start, top, end = ramps.start[here], np.maximum(ramps.top[here], _LEAST), ramps.end[here]
        up, down, lengths = ramps.up[here], ramps.down[here], np.diff(self.ways)
        level = lengths - (top**2 - start**2) / (2.0 * up) - (top**2 - end**2) / (2.0 * down)
        level[level < _ROUNDING * lengths] = 0.0
        spans = np.stack(((top - start) / up, level / top, (top - end) / down), axis=1).ravel()
        speeds = np.stack((top, top, end), axis=1).ravel()
        return Ramped.over(spans, np.concatenate((start[:1], speeds)))

    def look(self, smooth: Smooth, within: Floats, at: Floats) -> ChordLimits:
        """Return by how much a motion must be slowed on every chord, and its greatest speed there.

        `within` (n,) and `at` (n + 1,) are the greatest speeds within the chords of the path and at its knots. An
        acceleration may exceed its limit by the share `STEP`: the fastest motion keeps the limit in the middle of every
        chord.
        """
        number = len(self.most)
        passed = smooth.when(self.ways[1:-1])
        grid = np.sort(np.concatenate((smooth.times, passed)))
        spans = np.diff(grid)
        real = spans > _ROUNDING * smooth.duration
        times = grid[:-1][real][:, np.newaxis] + spans[real][:, np.newaxis] * _PARTS
        here = smooth.interval(times[:, 2])
        way, speed, rate = smooth.along(here, times)
        chord = np.clip(np.searchsorted(self.ways, way[:, 2], side="right") - 1, 0, number - 1)
        tops = _per_chord(chord, _greatest(speed), number)
        pull, strain = self._shares(chord, way, speed, rate, smooth.jerks[here])
        pull /= 1.0 + STEP
        much = np.maximum(np.sqrt(pull), np.cbrt(strain))
        excess = np.maximum(tops / within[self.part], _per_chord(chord, much, number))
        at_knots = smooth.at(passed)[1] / at[self.first + 1 : self.last]
        excess[1:], excess[:-1] = np.maximum(excess[1:], at_knots), np.maximum(excess[:-1], at_knots)
        return ChordLimits(excess, tops, _per_chord(chord, pull, number), float(strain.max()))

    def _shares(
        self, chord: NDArray[np.intp], way: Floats, speed: Floats, rate: Floats, jerk: Floats
    ) -> tuple[Floats, Floats]:
        """Return the greatest ratios (m,) of an axis' acceleration and jerk to their limits in intervals.

        Each interval is sampled in five places. To speed up is to accelerate in the axis' direction on the chord.
        """
        length = np.diff(self.ways)[chord][:, np.newaxis]
        share = np.clip((way - self.ways[chord][:, np.newaxis]) / length, 0.0, 1.0)
        pull, strain = np.zeros((2, len(chord)))
        limits = zip(self.limits.acceleration, self.limits.deceleration, self.limits.jerk, strict=True)
        for axis, (up, down, most) in enumerate(limits):
            d, turn = _straight(self.directions[:, axis], chord, share, length)
            c, change = _straight(self.bends[:, axis], chord, share, length)
            found = self.forward[chord, axis][:, np.newaxis] * (d * rate + c * speed**2)
            pull = np.maximum(pull, np.maximum(_greatest(found) / up, _greatest(-found) / down))
            found = d * jerk[:, np.newaxis] + (turn + 2.0 * c) * speed * rate + change * speed**3
            strain = np.maximum(strain, _greatest(np.abs(found)) / most)
        return pull, strain


def _straight(values: Floats, chord: NDArray[np.intp], share: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Return the linear interpolation between values at the knots (n + 1,), and its slope along the way."""
    step = np.diff(values)[chord][:, np.newaxis]
    return values[chord][:, np.newaxis] + share * step, step / length


def _greatest(values: Floats) -> Floats:
    """Return the greatest of five samples of each interval (m, 5), with a bound for the values between them.

    Between samples the value is the parabola through three of them, off by at most 0.065 of the third differences.
    """
    before, here, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    bend, slope = before - 2.0 * here + after, 0.5 * (after - before)
    inside = np.abs(slope) < -bend
    peak = here + np.where(inside, slope * slope, 0.0) / np.where(inside, -2.0 * bend, 1.0)
    doubt = np.abs(np.diff(bend, axis=1)).max(axis=1)
    return np.maximum(values.max(axis=1), peak.max(axis=1)) + 0.065 * doubt


def _per_chord(chord: NDArray[np.intp], values: Floats, number: int) -> Floats:
    """Return the greatest of the values (m,) on every chord."""
    found = np.zeros(number)
    np.maximum.at(found, chord, values)
    return found


Fastest = Callable[[Floats, Floats, Floats], Ramps]
"""The fastest motion by the greatest speeds within chords (n,), at knots (n + 1,), and shares of accelerations (n,)."""

Allowed = Callable[[Floats], Floats]
"""From requested speeds on the chords (n,) to safe ones, infinite if the requested speed is safe."""

_ROUNDS = 12
_GOOD = 1.002
_WIDEST = 2.0
"""A window wider by this factor than an acceleration requires leaves room for a rise and a fall."""

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
    """Return chords and ramps that follow the fastest motion along `knots` within the limits of jerk.

    `within` (n,) and `at` (n + 1,) are the greatest speeds within the chords and at the knots [counts/s]. Chords are
    divided along their line, in whole counts, where the acceleration changes; less often with a greater `coarseness`.
    """
    found = gentle(knots, limits, within, at, fastest, allowed)
    return _driven(knots, [_EvenPieces.of(stretch, smooth, coarseness) for stretch, smooth in found])


def gentle(
    knots: Knots, limits: Limits, within: Floats, at: Floats, fastest: Fastest, allowed: Allowed | None = None
) -> list[tuple[ChordSpan, Smooth]]:
    """Return the stretches of a path, and for each the fastest smooth motion found; parameters as in `smoothed`."""
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

    `tried` (n,) are the greatest speeds within chords of the latest attempt, `share` (n,) the shares of the
    accelerations, `widths` the factors by which the windows are wider than necessary.
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
        """Return the best motion of every stretch."""
        return [smooth for smooth in self._best if smooth is not None]

    def look(self) -> tuple[list[ChordLimits], Floats]:
        """Return the limits of the motion of the latest attempt, and its speeds on the chords (n,)."""
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
        """Store results that are better than the best, choose the next attempt; return whether none is needed.

        `unsafe` (n,) are the ratios of the speeds to the safe ones.
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
        """Return values of whole stretches, repeated for each of their chords (n,)."""
        return np.repeat(values, [stretch.last - stretch.first for stretch in self._stretches])


def _beside(excess: Floats) -> Floats:
    """Return the factor, 1 or more, by which to slow every chord (n,): the greatest of its own and its neighbours'."""
    much = np.pad(np.maximum(1.0, excess), 1, constant_values=1.0)
    return np.maximum(np.maximum(much[:-2], much[2:]), much[1:-1])


@dataclass(frozen=True, eq=False)
class _EvenPieces:
    """Pieces with approximately constant acceleration, (m,) each; no knot lies within one.

    Each has its chord, and at its end the share of the chord, the time [s] and the speed.
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
    """Return places of a grid, `cuts` among them, between which a linear interpolation is off by at most `off`."""
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
    """Return ramps that only rise or only fall; from rest to rest they rise and fall in their time."""
    start = np.concatenate(([0.0], end[:-1]))
    top = np.maximum(start, end)
    hop = top <= 0.0
    top = np.where(hop, 2.0 * lengths / spans, top)
    room = np.where(hop, lengths, 2.0 * lengths)
    up, down = ((top**2 - speed**2) / room for speed in (start, end))
    return Ramps(start, top, end, np.maximum(up, _TINY), np.maximum(down, _TINY))
