"""The span of a path between two rests, and the smoothed motion of the axes along it over time.

Let V be a speed that is straight in time between its corners, A its slope and S the way. The mean over a window τ has

    the speed          v(t) = (S(t) − S(t − τ))/τ
    the acceleration   a(t) = (V(t) − V(t − τ))/τ
    the jerk           j(t) = (A(t) − A(t − τ))/τ

and takes τ longer from rest to rest. Both corners of V and the same τ later are corners of a; between them the jerk is
constant. If V rises with A to a cruise not shorter than τ, and falls likewise, and A = Jτ, this is the fastest motion
over a distance under limits of speed, acceleration and the jerk J.

With direction d, bend c = d' and the way s, v = s', a = v', j = a', an axis has the

    acceleration   d a + c v²
    jerk           d j + d' v a + 2 c v a + c' v³

where d and c are taken straight between their values at the knots.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cbrt, inf, sqrt
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.motion.knots import STEP, Knots
from maya_un.motion.limits import Limits
from maya_un.motion.segmentation import Ramps
from maya_un.motion.speeds import Chords

SHORTEST = 1e-3
"""No window is shorter [s]: the controller itself samples no finer (Galil DMC-41x3, command TM)."""

_BISECTIONS = 48


@dataclass(frozen=True, eq=False)
class Ramped:
    """A speed that changes evenly between times (m,) [s]: `speeds` and `ways` at them, (m,) each, from rest to rest."""

    times: Floats
    speeds: Floats
    ways: Floats

    @classmethod
    def over(cls, spans: Floats, speeds: Floats) -> Self:
        """Return what takes `spans` (m − 1,) [s] from each of `speeds` (m,) to the next; spans of 0 are left out."""
        kept = np.concatenate(([True], spans > 0.0))
        times = np.concatenate(([0.0], np.cumsum(spans)))[kept]
        speeds = speeds[kept]
        gone = 0.5 * np.diff(times) * (speeds[1:] + speeds[:-1])
        return cls(times, speeds, np.concatenate(([0.0], np.cumsum(gone))))

    def way(self, times: Floats) -> Floats:
        """Return the ways at any times, those before the start and after the end included."""
        within = np.clip(times, 0.0, self.times[-1])
        here = np.clip(np.searchsorted(self.times, within, side="right") - 1, 0, len(self.times) - 2)
        mean = 0.5 * (self.speeds[here] + np.interp(within, self.times, self.speeds))
        return self.ways[here] + (within - self.times[here]) * mean

    def level(self, window: float) -> float:
        """Return the speed to which the highest peak must be cut to last for `window` [s]; its own if it does."""
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
        """Return the way at which a piece that rises or falls through `level` is there."""
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
        """Return the same in `factor` times the time."""
        return Smooth(
            self.times * factor,
            self.ways,
            self.speeds / factor,
            self.accelerations / factor**2,
            self.jerks / factor**3,
        )

    def cruises(self) -> Floats:
        """Return the times at which cruises begin and end that take a hundredth of all the time or more."""
        even = np.abs(self.accelerations) <= 1e-6 * np.abs(self.accelerations).max()
        long = even[:-1] & even[1:] & (np.diff(self.times) >= 0.01 * self.duration)
        return np.concatenate((self.times[:-1][long], self.times[1:][long]))

    def interval(self, times: Floats) -> NDArray[np.intp]:
        """Return the numbers of the intervals in which times (n,) lie."""
        return np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.jerks) - 1)

    def at(self, times: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ways, speeds and accelerations at times (n,) between start and end."""
        return self.along(self.interval(times), times)

    def when(self, ways: Floats) -> Floats:
        """Return the times (n,) at which ways (n,) have been gone."""
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
_TINY = 1e-12
_ROUNDING = 1e-9


class ChordLimits(NamedTuple):
    """For every chord (n,): by which factor a stretch must be slowed to keep all limits there, and its greatest speed.

    `pull` (n,) are the greatest shares of their acceleration limits that axes have, `strain` that of a jerk limit.
    """

    excess: Floats
    tops: Floats
    pull: Floats
    strain: float


@dataclass(frozen=True, eq=False)
class ChordSpan:
    """Chords `first` to before `last` of a path, from rest to rest, and what their axes can do.

    `ways` (n + 1,) are the ways to the knots [counts]. Directions and bends are those at the knots (n + 1, 3);
    `forward` (n, 3) is which way the axes go on the chords, 1 or −1; `most` (n,) the greatest jerk along each
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
        if last - first > 1:  # at rest a bend does nothing; taken for 0 it would seem to change
            bends[0], bends[-1] = bends[1], bends[-2]
        half, smooth = 0.5 * chords.lengths[:, np.newaxis], chords.smooth.T
        directions = np.concatenate((smooth[:1], smooth[:-1] + bends[1:-1] * half[:-1], smooth[-1:]))
        ways = np.concatenate(([0.0], np.cumsum(chords.lengths)))
        share = np.maximum(np.maximum(np.abs(directions[1:]), np.abs(directions[:-1])), _TINY)
        most = np.min(np.array(limits.jerk) / share, axis=1)
        return cls(first, last, limits, ways, directions, bends, np.copysign(1.0, chords.directions.T), most)

    @property
    def part(self) -> slice:
        """Its chords among those of the path."""
        return slice(self.first, self.last)

    def bent_slowly(self) -> Floats:
        """Return the greatest speeds (n,) at which the change of the bend alone, c' v³, keeps the limits."""
        lengths = np.diff(self.ways)[:, np.newaxis]
        change = np.maximum(np.abs(np.diff(self.bends, axis=0)) / lengths, _TINY**2)
        return np.cbrt(np.min(np.array(self.limits.jerk) / change, axis=1))

    def share(self, ramps: Ramps) -> float:
        """Return which share of the accelerations serves best.

        Less than all of them where the stretch is too short, or too slow, to speed up for as long as the window is:
        with the least of the greatest jerks J, length L and speed v, accelerations above ∛(L J²/2) or √(v J) are of no
        use.
        """
        fastest, jerk = float(ramps.top[self.part].max()), float(self.most.min())
        useful = min(cbrt(0.5 * float(self.ways[-1]) * jerk * jerk), sqrt(fastest * jerk))
        return min(1.0, useful / max(_TINY, float(self._steepest(ramps).max())))

    def level(self, ramps: Ramps, width: float) -> float:
        """Return to which speed the highest peak must be cut to last as long as the window; not if that is wider."""
        return inf if width > 1.0 else self._ramped(ramps).level(self._window(ramps))

    def mean(self, ramps: Ramps, width: float) -> Smooth:
        """Return the mean of the fastest way over the window that its accelerations ask for, `width` times as wide."""
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
        start, top, end = ramps.start[here], np.maximum(ramps.top[here], _TINY), ramps.end[here]
        up, down, lengths = ramps.up[here], ramps.down[here], np.diff(self.ways)
        level = lengths - (top**2 - start**2) / (2.0 * up) - (top**2 - end**2) / (2.0 * down)
        level[level < _ROUNDING * lengths] = 0.0
        spans = np.stack(((top - start) / up, level / top, (top - end) / down), axis=1).ravel()
        speeds = np.stack((top, top, end), axis=1).ravel()
        return Ramped.over(spans, np.concatenate((start[:1], speeds)))

    def look(self, smooth: Smooth, within: Floats, at: Floats) -> ChordLimits:
        """Return by how much a way over time must be slowed on every chord, and how fast it gets there.

        `within` (n,) and `at` (n + 1,) are the greatest speeds within the chords of the path and at its knots. An
        acceleration may be greater than its limit by `STEP`: the fastest way keeps it in the middle of every chord.
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
        """Return which shares (m,) of its limits of acceleration and of jerk an axis has in intervals at most.

        They are looked at in five places. To speed up is to accelerate the way that the axis goes on the chord.
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
    """Return what is straight between values at the knots (n + 1,), and its slope along the way."""
    step = np.diff(values)[chord][:, np.newaxis]
    return values[chord][:, np.newaxis] + share * step, step / length


def _greatest(values: Floats) -> Floats:
    """Return the greatest of what was looked at in five places of intervals (m, 5), and of what may lie between.

    Between them it is the parabola through three places, off by at most 0.065 of the third differences.
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
