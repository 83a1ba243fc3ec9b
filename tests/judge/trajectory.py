"""The mechanics' record of a motion, measured: speeds, accelerations, and distances from every limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from tests.judge.mechanism import Floats, Frame, margins, places
from tests.judge.zones import Solid, clearances

PARTS = 8
"""The speeds that make a mean acceleration are means of such a part of its window."""

_SHORTEST = 1e-3
"""Samples closer in time than this [s] tell no speed: their places are rounded."""

_COARSE = 5e-3
"""Zones are first looked at so far apart [rad, m]."""

_STILL = 1e-10
"""Places that differ by less [rad, m] are the same."""


class Samples(Protocol):
    """Samples in order of time, each (n,): time [s], angle [rad], lengths of the lines [m]."""

    @property
    def t(self) -> Floats: ...
    @property
    def a(self) -> Floats: ...
    @property
    def b(self) -> Floats: ...
    @property
    def c(self) -> Floats: ...


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Times t (n,) [s] and true joints (n, 3) [rad, m, m].

    Between two samples the joints go straight: the mechanics look wherever the law of their motion changes.
    """

    t: Floats
    joints: Floats

    @classmethod
    def of(cls, samples: Samples, since: float = 0.0) -> Self:
        """Return what was sampled from time `since` [s] on."""
        keep = samples.t >= since
        return cls(samples.t[keep], np.column_stack((samples.a, samples.b, samples.c))[keep])

    @property
    def start(self) -> Floats:
        """The first joints (3,)."""
        return self.joints[0]

    @property
    def end(self) -> Floats:
        """The last joints (3,)."""
        return self.joints[-1]

    def moving(self) -> tuple[float, float]:
        """Return when the motion begins and when it has ended [s]; twice the last time where nothing moves."""
        moved = np.flatnonzero(np.abs(np.diff(self.joints, axis=0)).max(axis=1) > _STILL)
        if not moved.size:
            return float(self.t[-1]), float(self.t[-1])
        return float(self.t[moved[0]]), float(self.t[moved[-1] + 1])

    def at(self, times: Floats) -> Floats:
        """Return the joints (m, 3) at `times`, straight between samples."""
        return np.column_stack([np.interp(times, self.t, column) for column in self.joints.T])

    def finer(self, step: float) -> Floats:
        """Return joints (m, 3) along the way, no two neighbours more than `step` [rad, m] apart."""
        parts = np.ceil(np.abs(np.diff(self.joints, axis=0)).max(axis=1) / step)
        marks = np.concatenate(([0.0], np.cumsum(np.maximum(parts, 1.0))))
        wanted = np.arange(marks[-1] + 1.0)
        return np.column_stack([np.interp(wanted, marks, column) for column in self.joints.T])

    def least(self, frame: Frame, zones: Sequence[Solid] = (), step: float = 1e-3) -> dict[str, float]:
        """Return the least margin to every limit and zone [m], negative beyond it; `step` as in `finer`."""
        found = {name: float(values.min()) for name, values in margins(frame, self.finer(step)).items()}
        coarse = self.finer(_COARSE)
        return found | {zone.name: _least_clearance(frame, zone, coarse) for zone in zones}

    def speeds(self) -> Floats:
        """Return the greatest speed of every axis (3,) [rad/s, m/s, m/s]."""
        _, speeds = self._speeds()
        return np.abs(speeds).max(axis=0, initial=0.0)

    def mean_accelerations(self, window: float) -> Floats:
        """Return every axis' greatest change of speed within `window` [s], divided by it (3,) [rad/s², m/s²].

        A speed is the mean of an eighth of the window: the effect of whole counts on a short piece is no acceleration.
        """
        begun, ended = self.moving()
        if ended <= begun:
            return np.zeros(3)
        part = window / PARTS
        grid = np.arange(begun - window - part, ended + window + part, part)
        speeds = np.diff(self.at(grid), axis=0) / part
        return np.abs(speeds[PARTS:] - speeds[:-PARTS]).max(axis=0) / window

    def _speeds(self) -> tuple[Floats, Floats]:
        """Return times (m,) and the mean speeds (m, 3) between samples that are far enough apart."""
        kept = [0]
        for index, t in enumerate(self.t):
            if t - self.t[kept[-1]] >= _SHORTEST:
                kept.append(index)
        t, joints = self.t[kept], self.joints[kept]
        return 0.5 * (t[1:] + t[:-1]), np.diff(joints, axis=0) / np.diff(t)[:, None]


def _least_clearance(frame: Frame, zone: Solid, joints: Floats) -> float:
    """Return the least clearance along joints (n, 3), looking closely where it may be negative between two of them."""
    found = clearances(frame, zone, joints)
    ways = np.linalg.norm(np.diff(places(frame, joints), axis=0), axis=1)
    ways = np.maximum(ways, frame.length * np.abs(np.diff(joints[:, 0])))
    near = np.flatnonzero(0.5 * (found[1:] + found[:-1]) - 0.5 * ways < 0.0)
    if not near.size:
        return float(found.min())
    shares = np.linspace(0.0, 1.0, 33)[:, None, None]
    closely = joints[near] + shares * (joints[near + 1] - joints[near])
    return min(float(found.min()), float(clearances(frame, zone, closely.reshape(-1, 3)).min()))
