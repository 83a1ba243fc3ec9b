"""Dates: an edge says when something was taught, for nothing below it looks at a clock."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta


def now() -> str:
    """Return date and time as a taught place carries them (ISO 8601, UTC)."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def epoch() -> float:
    """Return the seconds since 1970-01-01 00:00 UTC, as messages of a graph are stamped with."""
    return datetime.now(UTC).timestamp()


def after(seconds: float) -> str:
    """Return the date in so many seconds, in the same form."""
    return (datetime.now(UTC) + timedelta(seconds=seconds)).isoformat(timespec="seconds")
