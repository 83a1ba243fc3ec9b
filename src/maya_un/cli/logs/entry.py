"""One thing that happened, whether it stands in the journal or in the log."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from maya_un.process.journal.rows import EventRow
from maya_un.server.log import level_of

LEVELS = ("debug", "info", "warning", "error", "critical")
"""How grave something is, from the least."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """What happened at `time` (ISO 8601, UTC, with milliseconds).

    `kind` is an event's, or the part of the program that wrote a line of the log: http, defect. `code` is 0, or an
    error's; `run` and `seq` are an event's numbers, 0 for others.
    """

    time: str
    level: str
    kind: str
    text: str
    code: int = 0
    run: int = 0
    seq: int = 0
    detail: Mapping[str, Any] = field(default_factory=dict[str, Any])


def of_event(row: EventRow) -> LogEntry:
    """Return an event of the journal."""
    level = logging.getLevelName(level_of(row.kind)).lower()
    if row.code and level == "info":
        level = "warning"
    words = " ".join(f"{key}={value}" for key, value in row.detail.items() if key != "message")
    message = str(row.detail.get("message", ""))
    text = "  ".join(part for part in (words, message) if part)
    return LogEntry(_utc(row.date), level, row.kind, text, row.code, row.run, row.seq, row.detail)


def of_line(line: Mapping[str, Any]) -> LogEntry:
    """Return a line of the log; raises `KeyError`, `TypeError` or `ValueError` for what is none."""
    known = {"time", "level", "logger", "message", "code"}
    kind = str(line["logger"]).rpartition(".")[2]
    detail = {key: value for key, value in line.items() if key not in known}
    return LogEntry(
        _utc(str(line["time"])), str(line["level"]), kind, str(line["message"]), int(line.get("code", 0)), 0, 0, detail
    )


def _utc(date: str) -> str:
    """Return a date in the form of all entries, or as it is where it is none."""
    try:
        return datetime.fromisoformat(date).astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    except (ValueError, OverflowError):
        return date
