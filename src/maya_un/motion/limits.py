"""Limits of the axes, in the controller's units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from maya_un.config import Config
from maya_un.kinematics import Floats


@dataclass(frozen=True)
class Limits:
    """Limits of the axes a, b, c: speeds in counts/s, accelerations in counts/s²; `letters` on the controller.

    `jerk` is how fast their accelerations may change [counts/s³], infinite for as fast as they like.
    """

    letters: tuple[str, str, str]
    speed: tuple[int, int, int]
    acceleration: tuple[int, int, int]
    deceleration: tuple[int, int, int]
    stop_deceleration: tuple[int, int, int]
    jerk: tuple[float, float, float] = (inf, inf, inf)

    @classmethod
    def of(cls, config: Config) -> Limits:
        """Return the limits of a configuration."""
        a, b, c = config.axes.a, config.axes.b, config.axes.c
        return cls(
            (a.letter, b.letter, c.letter),
            (a.speed_counts, b.speed_counts, c.speed_counts),
            (a.acceleration_counts, b.acceleration_counts, c.acceleration_counts),
            (a.deceleration_counts, b.deceleration_counts, c.deceleration_counts),
            (a.stop_deceleration_counts, b.stop_deceleration_counts, c.stop_deceleration_counts),
            (a.jerk_counts or inf, b.jerk_counts or inf, c.jerk_counts or inf),
        )

    @cached_property
    def slew(self) -> Floats:
        """The speeds as a column (3, 1), to be compared with arrays (3, n)."""
        return _column(self.speed)

    @cached_property
    def rise(self) -> Floats:
        """The accelerations as a column."""
        return _column(self.acceleration)

    @cached_property
    def fall(self) -> Floats:
        """The decelerations as a column."""
        return _column(self.deceleration)

    @cached_property
    def stop(self) -> Floats:
        """The decelerations of a stop as a column."""
        return _column(self.stop_deceleration)


def _column(values: tuple[int, int, int]) -> Floats:
    return np.array(values, dtype=np.float64)[:, np.newaxis]
