"""Times on the graph: {"secs", "nsecs"}."""

from __future__ import annotations

from collections.abc import Mapping

Stamp = dict[str, int]
"""A time or a duration as ROS 1 has them."""

_SECOND = 1_000_000_000


def stamp(seconds: float) -> Stamp:
    """Return a time [s] of any clock as a stamp."""
    secs, nsecs = divmod(round(seconds * _SECOND), _SECOND)
    return {"secs": secs, "nsecs": nsecs}


def seconds(when: Mapping[str, int]) -> float:
    """Return a stamp or a duration in seconds."""
    return when["secs"] + when["nsecs"] / _SECOND


def order(when: Mapping[str, int]) -> tuple[int, int]:
    """Return what a stamp is compared by; (0, 0) says no time."""
    return when["secs"], when["nsecs"]
