"""Times and durations in messages."""

from __future__ import annotations

from maya_un.graph.protocol import Message

_BILLION = 1_000_000_000


def stamp(seconds: float) -> Message:
    """Return `seconds` since the epoch, or a duration, as ROS writes it: whole seconds, and nanoseconds above them."""
    whole, rest = divmod(round(seconds * _BILLION), _BILLION)
    return {"secs": whole, "nsecs": rest}


def header(seconds: float = 0.0, frame: str = "") -> Message:
    """Return the header of a message; a time of 0 means "whatever is newest" to whoever looks up frames."""
    return {"seq": 0, "stamp": stamp(seconds), "frame_id": frame}
