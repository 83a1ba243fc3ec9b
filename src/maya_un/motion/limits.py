"""What the axes can do, in the controller's own units."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from maya_un.config import Config


@dataclass(frozen=True, slots=True)
class Limits:
    """What the axes a, b, c can do: speeds in counts/s, accelerations in counts/s²; `letters` on the controller.

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
