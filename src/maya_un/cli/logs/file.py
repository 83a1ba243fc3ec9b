"""The log's file and the older ones beside it, read while somebody writes them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from maya_un.cli.logs.entry import LogEntry, of_line
from maya_un.errors import FileUnreadable

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
