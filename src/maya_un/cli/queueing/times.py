"""Dates and durations as people read them: the clock of this place, minutes and seconds."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

_DAY = 86_400.0


def clock(date: str) -> str:
    """Return a date (ISO 8601) as the clock here shows it, with the day where that is another; "" for none."""
    return _shown(datetime.fromisoformat(date)) if date else ""


def clock_in(seconds: float) -> str:
    """Return what the clock here will show in so many seconds."""
    return _shown(datetime.now(UTC) + timedelta(seconds=seconds))


def _shown(when: datetime) -> str:
    here = when.astimezone()
    today = datetime.now(UTC).astimezone().date()
    return here.strftime("%H:%M:%S" if here.date() == today else "%Y-%m-%d %H:%M")


def duration(seconds: float | None) -> str:
    """Return a duration like 45 s, 2:05 min, 1:02:05 h; a dash where nobody knows it."""
    if seconds is None:
        return "–"
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(whole, 60)
    if whole < 3600:
        return f"{minutes}:{rest:02d} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d} h"
