"""The clock for dates; only interfaces read it, and pass dates to the modules below them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta


def now() -> str:
    """Return the current date and time (ISO 8601, UTC), as stored with taught places."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def moment() -> str:
    """Return the current date and time to the millisecond (ISO 8601, UTC)."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def epoch() -> float:
    """Return the seconds since 1970-01-01 00:00 UTC, as in the time stamps of ROS messages."""
    return datetime.now(UTC).timestamp()


def after(seconds: float) -> str:
    """Return the date `seconds` from now, in the form of `now`."""
    return (datetime.now(UTC) + timedelta(seconds=seconds)).isoformat(timespec="seconds")
