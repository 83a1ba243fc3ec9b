"""`maya logs`: events and log messages of the service, filtered and followed, oldest first.

It only reads the files of the journal and the log, also while they are written.
"""

from __future__ import annotations

import json
import logging
import re
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from dmc41x3.i18n import one_line, phrase, visible
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.config.state_folder import queue_file, state_folder
from maya_un.errors import FileUnreadable, InvalidValue, MayaError, UnknownName
from maya_un.events import DECLARED, UnknownEvent, event_of
from maya_un.http.log import level_of, log_path
from maya_un.http.log_reader import LogReader, at_least, entry_time
from maya_un.process.journal import history
from maya_un.process.journal.protocol import EventRow
from maya_un.schema.diagnosis import LEVELS, LogEntry

_AGO = re.compile(r"(\d+(?:\.\d+)?)(s|min|m|h|d)")
_SECONDS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86_400.0}


def moment(text: str, now: datetime) -> str:
    """Return the time of 90s, 10m, 2h, 3d (before `now`) or of a date (ISO 8601), in UTC as in the files.

    A date without a time zone is in local time. Raises `InvalidValue`.
    """
    ago = _AGO.fullmatch(text.strip())
    try:
        if ago is not None:
            when = now - timedelta(seconds=float(ago[1]) * _SECONDS[ago[2]])
        else:
            when = datetime.fromisoformat(text.strip())
        return when.astimezone(UTC).isoformat(timespec="seconds").removesuffix("+00:00")
    except (ValueError, OverflowError) as error:
        reason = phrase("it must be an age like 10m or 2h, or a date like 2026-11-21T09:30")
        raise InvalidValue(key="--since", value=repr(text), reason=reason) from error


def of_event(row: EventRow) -> LogEntry:
    """Return the entry for an event of the journal."""
    level = logging.getLevelName(level_of(row.kind)).lower()
    if row.code and level == "info":
        level = "warning"
    words = " ".join(f"{key}={value}" for key, value in row.detail.items() if key != "message")
    message = str(row.detail.get("message", ""))
    text = "  ".join(part for part in (words, message) if part)
    return LogEntry(entry_time(row.date), level, row.kind, text, row.code, row.run, row.seq, row.detail)


MOST = 10_000
"""Maximum number of lines of one request."""

LOOK = 0.3
"""Period of reading the files while they are followed [s]."""

KINDS = (*DECLARED, "defect", "http")
"""Kinds of entries: events, and parts of the program that write to the log; libraries may add others."""

_COLOURS = {"debug": "2", "warning": "33", "error": "31", "critical": "31;1"}


class LogFilter(NamedTuple):
    """Selection of entries: the newest `lines`, not older than `since`, of these `kinds` (empty: all).

    `level` is the lowest level shown.
    """

    lines: int
    since: str
    kinds: tuple[str, ...]
    level: str

    def has(self, entry: LogEntry) -> bool:
        """Return whether the selection includes an entry."""
        grave = entry.level in at_least(self.level) or entry.level not in LEVELS
        alike = not self.kinds or entry.kind in self.kinds
        return alike and grave and entry.time >= self.since


class LogSources:
    """The journal and the log, for repeated reading; `trouble` is the error of an unreadable journal, or None."""

    def __init__(self) -> None:
        self._journal = queue_file()
        self._number = 0
        self.trouble: MayaError | None = None
        events = self._events(1, "")
        self._log = LogReader(log_path(), events=not events)
        self._number = 0

    def read(self, most: int, since: str) -> list[LogEntry]:
        """Return the entries since the previous call, merged, oldest first."""
        return sorted([*self._log.read(), *self._events(most, since)], key=lambda entry: entry.time)

    def _events(self, most: int, since: str) -> list[LogEntry]:
        if not self._journal.exists():
            return []
        try:
            found = history.newest_events(self._journal, most, above=self._number, since=since)
        except MayaError as error:
            self.trouble = error
            return []
        if found:
            self._number = found[-1][0]
        return [of_event(row) for _, row in found]


def show(
    wanted: LogFilter, settings: OutputSettings, *, follow: bool, wait: Callable[[float], object] = time.sleep
) -> int:
    """Print entries, and with `follow` new ones until Ctrl-C; return the exit code.

    Raises `FileUnreadable` if neither a journal nor a log exists, and `UnknownName` for an unknown kind.
    """
    sources = LogSources()
    entries = sources.read(MOST, wanted.since)
    _require_known(wanted.kinds, entries)
    found = [entry for entry in entries if wanted.has(entry)][-wanted.lines :]
    if sources.trouble is not None:
        output.complain(sources.trouble, settings._replace(json=False))
    if not found and not follow and not queue_file().exists() and not log_path().exists():
        raise FileUnreadable(
            path=state_folder(),
            reason="nothing has been stored there yet; `maya up` stores a log and a journal",
        )
    _print(found, settings)
    with suppress(KeyboardInterrupt):
        while follow:
            wait(LOOK)
            _print((entry for entry in sources.read(MOST, "") if wanted.has(entry)), settings)
    return output.DONE


def _require_known(kinds: Iterable[str], entries: Iterable[LogEntry]) -> None:
    """Raise `UnknownName` for a kind that neither Maya declares nor any entry has."""
    known = {*KINDS, *(entry.kind for entry in entries)}
    for kind in kinds:
        if kind not in known:
            raise UnknownName(name=kind, known=", ".join(sorted(known)))


def wanted(lines: int, since: str | None, kinds: Sequence[str], level: str) -> LogFilter:
    """Return the selection of a command line; raises `InvalidValue`."""
    begin = "" if since is None else moment(since, datetime.now(UTC))
    return LogFilter(lines if since is None else MOST, begin, tuple(kinds), level)


def _print(entries: Iterable[LogEntry], settings: OutputSettings) -> None:
    coloured = sys.stdout.isatty()
    for entry in entries:
        text = json.dumps(asdict(entry), ensure_ascii=False) if settings.json else _line(entry, settings.language)
        output.say(_coloured(text, entry.level) if coloured and not settings.json else text)


def _line(entry: LogEntry, language: str) -> str:
    clock = _here(entry.time)
    code = f" ({entry.code})" if entry.code else ""
    text = f"{clock}  {entry.level:<7}  {entry.kind:<14}  {one_line(_said(entry, language))}{code}"
    if "traceback" in entry.detail:
        text += "\n" + "\n".join(f"    {line}" for line in visible(str(entry.detail["traceback"])).splitlines())
    return text


def _said(entry: LogEntry, language: str) -> str:
    """Return the sentence of an event in a language; for an undeclared event or a log message, its text."""
    event = event_of(entry.kind, entry.detail)
    return event.report(language) if entry.seq and not isinstance(event, UnknownEvent) else entry.text


def _coloured(text: str, level: str) -> str:
    colour = _COLOURS.get(level)
    return f"\x1b[{colour}m{text}\x1b[0m" if colour else text


def _here(date: str) -> str:
    try:
        return datetime.fromisoformat(date).astimezone().isoformat(sep=" ", timespec="milliseconds")[:23]
    except ValueError:
        return date
