"""Reads the lines of the log, also while they are written: the newest ones, or all new ones."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

from dmc41x3.files import unreadable
from maya_un.http.log import MOST_BYTES, MOST_FILES
from maya_un.schema.choices import LogLevel
from maya_un.schema.diagnosis import LEVELS, LogEntry

EVENTS = "maya.events"
"""The logger of events, which the journal also contains."""

MOST_ENTRIES = 1000
"""Maximum number of entries of one answer."""

_BLOCK = 1 << 16
"""Length of a part that is read at once, from the end of a file [bytes]."""

_MOST_LOOKED_AT = (MOST_FILES + 2) * MOST_BYTES
"""Length of the end of the log in which the newest entries are searched [bytes]; the log is not longer by itself."""


def utc(date: str) -> str:
    """Return a date (ISO 8601) in the form of all entries; without a zone it is in local time.

    Raises `ValueError` or `OverflowError`.
    """
    return datetime.fromisoformat(date).astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def of_line(line: Mapping[str, Any]) -> LogEntry:
    """Return the entry for a line of the log; raises `KeyError`, `TypeError` or `ValueError` for an invalid line."""
    known = {"time", "level", "logger", "message", "code"}
    kind = str(line["logger"]).rpartition(".")[2]
    detail = {key: value for key, value in line.items() if key not in known}
    time, level, text = str(line["time"]), str(line["level"]), str(line["message"])
    return LogEntry(entry_time(time), level, kind, text, int(line.get("code", 0)), 0, 0, detail)


def entry_time(date: str) -> str:
    """Return a date in the form of all entries; an invalid date is unchanged."""
    try:
        return utc(date)
    except (ValueError, OverflowError):
        return date


def at_least(level: str) -> tuple[LogLevel, ...]:
    """Return a level and those above it."""
    return LEVELS[LEVELS.index(cast("LogLevel", level)) :]


def newest(path: Path, limit: int, since: str = "", level: str = "debug") -> list[LogEntry]:
    """Return the newest entries of the log at `path`, at most `limit`, oldest first; none without a file.

    None is older than `since`, a date in the form of `utc`, or below `level`. Entries of events are included. It reads
    files, so call it in a worker thread. Raises `FileUnreadable`.
    """
    levels = at_least(level)
    marks = [json.dumps(one).encode() for one in levels]
    found: list[LogEntry] = []
    for line in _lines_backward(path):
        if not any(mark in line for mark in marks):
            continue  # parsing costs more than looking
        entry = _entry(line, events=True)
        if entry is None or entry.level not in levels:
            continue
        if entry.time < since or len(found) == limit:
            break
        found.append(entry)
    return found[::-1]


def _lines_backward(path: Path) -> Iterator[bytes]:
    """Yield the complete lines of the log and its older files, newest first."""
    looked_at, files = 0, set[int]()
    for file in (path, *reversed(_older(path))):
        rest: bytes | None = None
        for block in _blocks_backward(file, files):
            looked_at += len(block)
            lines = block.split(b"\n")
            if rest is None:
                lines.pop()  # a line that is still being written, or nothing
                rest = b""
            if lines:
                lines[-1] += rest
                rest = lines[0]
                yield from reversed(lines[1:])
            if looked_at > _MOST_LOOKED_AT or len(rest) > MOST_BYTES:
                return
        if rest:
            yield rest


def _blocks_backward(path: Path, known: set[int]) -> Iterator[bytes]:
    """Yield the parts of a file, the last one first; none of a file whose inode is known, as it was renamed since."""
    try:
        with path.open("rb") as file:
            identity = os.fstat(file.fileno()).st_ino
            if identity in known:
                return
            known.add(identity)
            place = file.seek(0, os.SEEK_END)
            while place > 0:
                begin = max(0, place - _BLOCK)
                file.seek(begin)
                yield file.read(place - begin)
                place = begin
    except FileNotFoundError:
        return
    except OSError as error:
        raise unreadable(path, error) from error


def _older(path: Path) -> list[Path]:
    """Return the older files of the log, oldest first."""
    numbered = [older for older in path.parent.glob(f"{path.name}.*") if older.suffix[1:].isdigit()]
    return sorted(numbered, key=lambda older: -int(older.suffix[1:]))


def _entry(line: bytes, *, events: bool) -> LogEntry | None:
    """Return a line as an entry; skip a line of another program, or one cut off by a power cut."""
    try:
        found: Any = json.loads(line)
        if not events and found["logger"] == EVENTS:
            return None
        return of_line(cast("dict[str, Any]", found))
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


class LogReader:
    """The lines of the log at `path`; each `read` continues after the previous one, also over a change of files."""

    def __init__(self, path: Path, *, events: bool = False) -> None:
        self._path = path
        self._events = events
        self._place = 0
        self._file = 0
        self._rest = b""

    def read(self) -> list[LogEntry]:
        """Return the entries since the previous call, at first all; raises `FileUnreadable`."""
        first = self._file == 0
        data = b"".join(_content(older, 0)[0] for older in _older(self._path)) if first else b""
        data += self._newer()
        lines = (self._rest + data).split(b"\n")
        self._rest = lines.pop()
        return [entry for line in lines if (entry := _entry(line, events=self._events)) is not None]

    def _newer(self) -> bytes:
        if not self._path.exists():
            return b""
        data, file = _content(self._path, self._place)
        if self._file not in {0, file}:  # a new file was started: read the rest of the old one, then the new one
            rotated = self._path.with_name(f"{self._path.name}.1")
            rest, same = _content(rotated, self._place) if rotated.exists() else (b"", 0)
            begun, file = _content(self._path, 0)
            data = (rest if same == self._file else b"") + begun
            self._place = len(begun)
        else:
            self._place += len(data)
        self._file = file
        return data


def _content(path: Path, place: int) -> tuple[bytes, int]:
    """Return the content of a file from `place` on, and the inode of the file."""
    try:
        with path.open("rb") as file:
            identity = path.stat().st_ino
            file.seek(place)
            return file.read(), identity
    except OSError as error:
        raise unreadable(path, error) from error
