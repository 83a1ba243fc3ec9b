"""Entries of the journal and the log, read while they are written."""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

from maya_un.errors import FileUnreadable, InvalidValue
from maya_un.http.log import level_of
from maya_un.process.journal.protocol import EventRow

_AGO = re.compile(r"(\d+(?:\.\d+)?)(s|min|m|h|d)")
_SECONDS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}


def moment(text: str, now: datetime) -> str:
    """Return the moment meant by 90s, 10m, 2h, 3d (so long before `now`) or a date (ISO 8601), in UTC as files have it.

    A date without a zone is this place's. Raises `InvalidValue`.
    """
    ago = _AGO.fullmatch(text.strip())
    try:
        if ago is not None:
            when = now - timedelta(seconds=float(ago[1]) * _SECONDS[ago[2]])
        else:
            when = datetime.fromisoformat(text.strip())
        return when.astimezone(UTC).isoformat(timespec="seconds").removesuffix("+00:00")
    except (ValueError, OverflowError) as error:
        reason = "it is so long ago, like 10m or 2h, or a date, like 2026-11-21T09:30"
        raise InvalidValue(key="--since", value=repr(text), reason=reason) from error


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


EVENTS = "maya.events"
"""The logger of what the journal has as well."""


class LogReader:
    """The lines of the log at `path`; `read` goes on where it was before, over the change to a new file too."""

    def __init__(self, path: Path, *, events: bool = False) -> None:
        self._path = path
        self._events = events
        self._place = 0
        self._file = 0
        self._rest = b""

    def read(self) -> list[LogEntry]:
        """Return what came since the last time, at first everything; raises `FileUnreadable`."""
        first = self._file == 0
        data = b"".join(self._older()) if first else b""
        data += self._newer()
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        return [entry for line in lines if (entry := self._entry(line)) is not None]

    def _older(self) -> Iterator[bytes]:
        """Return the files that were begun anew since, oldest first."""
        numbered = [path for path in self._path.parent.glob(f"{self._path.name}.*") if path.suffix[1:].isdigit()]
        for path in sorted(numbered, key=lambda path: -int(path.suffix[1:])):
            yield _content(path, 0)[0]

    def _newer(self) -> bytes:
        if not self._path.exists():
            return b""
        data, file = _content(self._path, self._place)
        if self._file not in {0, file}:  # a new one was begun: what the old one got after the last look, then all of it
            rotated = self._path.with_name(f"{self._path.name}.1")
            rest, same = _content(rotated, self._place) if rotated.exists() else (b"", 0)
            begun, file = _content(self._path, 0)
            data = (rest if same == self._file else b"") + begun
            self._place = len(begun)
        else:
            self._place += len(data)
        self._file = file
        return data

    def _entry(self, line: bytes) -> LogEntry | None:
        """Return a line; one that is not ours, as of another program or cut off by a power cut, is left out."""
        try:
            found: Any = json.loads(line)
            if not self._events and found["logger"] == EVENTS:
                return None
            return of_line(cast("dict[str, Any]", found))
        except (ValueError, KeyError, TypeError, RecursionError):
            return None


def _content(path: Path, place: int) -> tuple[bytes, int]:
    """Return what stands in a file from `place` on, and which file that is."""
    try:
        with path.open("rb") as file:
            identity = path.stat().st_ino
            file.seek(place)
            return file.read(), identity
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
