"""Log and findings, by which users find out what is wrong, as messages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

LogLevel = Literal["debug", "info", "warning", "error", "critical"]

LEVELS: tuple[LogLevel, ...] = get_args(LogLevel)
"""Log levels, in ascending order."""


@dataclass(frozen=True, slots=True)
class LogEntry:
    """An entry with `time` (ISO 8601, UTC, with milliseconds).

    `kind` is that of an event, or the part of the program that wrote a line of the log: http, events, defect. `code` is
    0 or that of an error; `run` and `seq` are the numbers of an event, 0 for other entries.
    """

    time: str
    level: str
    kind: str
    text: str
    code: int = 0
    run: int = 0
    seq: int = 0
    detail: Mapping[str, Any] = field(default_factory=dict[str, Any])
