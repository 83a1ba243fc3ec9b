"""A speed over time that rises and falls gently: the mean, at every moment, of a steeper one over a window before.

Let V be a speed that is straight in time between its corners, A its slope and S the way. The mean over a window τ has

    the speed          v(t) = (S(t) − S(t − τ))/τ
    the acceleration   a(t) = (V(t) − V(t − τ))/τ
    the jerk           j(t) = (A(t) − A(t − τ))/τ

and takes τ longer from rest to rest. Both corners of V and the same τ later are corners of a; between them the jerk is
constant. If V rises with A to a cruise not shorter than τ, and falls likewise, and A = Jτ, this is the fastest motion
over a distance under limits of speed, acceleration and the jerk J.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics import Floats

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
