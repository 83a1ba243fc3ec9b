"""Times and durations in messages: {"secs", "nsecs"}."""

from __future__ import annotations

from collections.abc import Mapping

from maya_un.graph.protocol import Message

Stamp = dict[str, int]
"""A time or a duration as ROS 1 has them."""

_BILLION = 1_000_000_000


def stamp(seconds: float) -> Stamp:
    """Return `seconds` since the epoch, or a duration, as ROS writes it: whole seconds, and nanoseconds above them."""
    whole, rest = divmod(round(seconds * _BILLION), _BILLION)
    return {"secs": whole, "nsecs": rest}


def header(seconds: float = 0.0, frame: str = "") -> Message:
    """Return the header of a message; a time of 0 means "whatever is newest" to whoever looks up frames."""
    return {"seq": 0, "stamp": stamp(seconds), "frame_id": frame}


def in_seconds(when: Mapping[str, int]) -> float:
    """Return a time or a duration in seconds."""
    return when["secs"] + when["nsecs"] / _BILLION


def order(when: Mapping[str, int]) -> tuple[int, int]:
    """Return what times are compared by; (0, 0) says no time."""
    return when["secs"], when["nsecs"]
