"""The newest events of all runs, read from the file beside whoever writes it."""

from __future__ import annotations

from pathlib import Path

from maya_un.process.journal import copying, encoding
from maya_un.process.journal.encoding import EVENT
from maya_un.process.journal.rows import EventRow


def newest(path: Path, most: int, *, above: int = 0, since: str = "") -> list[tuple[int, EventRow]]:
    """Return the newest events, at most so many, oldest first, each with its number in the file.

    Only those numbered above `above`, and not dated before `since` (ISO 8601, UTC). Raises `FileUnreadable`,
    `FileNotOurs`, `StorageDamaged`, `StorageTooNew`.
    """
    asked = f"SELECT number, {EVENT} FROM events WHERE number > ? AND date >= ? ORDER BY number DESC LIMIT ?"
    with copying.reading(path) as connection:
        found = connection.execute(asked, (above, since, most)).fetchall()
    return [(int(number), encoding.event_of(tuple(values))) for number, *values in reversed(found)]
