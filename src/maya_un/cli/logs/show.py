"""`maya logs`: what has happened, newest last; works from the files alone, and only reads them."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from typing import NamedTuple

from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.logs.entries import LEVELS, LogEntry, LogReader, moment, of_event
from maya_un.cli.settings import OutputSettings
from maya_un.config.state_folder import state_folder
from maya_un.errors import FileUnreadable, MayaError, UnknownName
from maya_un.events import DECLARED, UnknownEvent, event_of
from maya_un.http.log import log_path
from maya_un.process.journal import history
from maya_un.process.journal.file import FILE_NAME

MOST = 10_000
"""Lines that can be asked for."""

LOOK = 0.3
"""How often the files are looked at while they are followed [s]."""

KINDS = (*DECLARED, "defect", "http")
"""What entries can be: events, and parts of the program that write lines of the log; libraries may be others."""

_COLOURS = {"debug": "2", "warning": "33", "error": "31", "critical": "31;1"}


class LogFilter(NamedTuple):
    """Which entries: the newest `lines`, not older than `since`, of these `kinds` (all where there are none).

    `level` is the least grave that is shown.
    """

    lines: int
    since: str
    kinds: tuple[str, ...]
    level: str

    def has(self, entry: LogEntry) -> bool:
        """Tell whether an entry is wanted."""
        grave = LEVELS.index(entry.level) if entry.level in LEVELS else len(LEVELS)
        alike = not self.kinds or entry.kind in self.kinds
        return alike and grave >= LEVELS.index(self.level) and entry.time >= self.since


class LogSources:
    """The journal and the log, read again and again; `trouble` says why one of them cannot be read, "" where it can."""

    def __init__(self) -> None:
        self._journal = state_folder() / FILE_NAME
        self._number = 0
        self.trouble: MayaError | None = None
        events = self._events(1, "")
        self._log = LogReader(log_path(), events=not events)
        self._number = 0

    def read(self, most: int, since: str) -> list[LogEntry]:
        """Return what came since the last time, oldest first, as if it stood in one file."""
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
    """Print entries, and with `follow` more as they come, until Ctrl-C; return the exit code.

    Raises `FileUnreadable` where there is neither a journal nor a log, and `UnknownName` for a kind that there is not.
    """
    sources = LogSources()
    entries = sources.read(MOST, wanted.since)
    _require_known(wanted.kinds, entries)
    found = [entry for entry in entries if wanted.has(entry)][-wanted.lines :]
    if sources.trouble is not None:
        output.complain(sources.trouble, settings._replace(json=False))
    if not found and not follow and not (state_folder() / FILE_NAME).exists() and not log_path().exists():
        raise FileUnreadable(
            path=state_folder(),
            reason=translate(
                "nothing has been stored there yet; `maya up` stores a log and a journal", settings.language
            ),
        )
    _print(found, settings)
    with suppress(KeyboardInterrupt):
        while follow:
            wait(LOOK)
            _print((entry for entry in sources.read(MOST, "") if wanted.has(entry)), settings)
    return output.DONE


def _require_known(kinds: Iterable[str], entries: Iterable[LogEntry]) -> None:
    """Raise `UnknownName` for a kind that is none of ours, and that nothing has."""
    known = {*KINDS, *(entry.kind for entry in entries)}
    for kind in kinds:
        if kind not in known:
            raise UnknownName(name=kind, known=", ".join(sorted(known)))


def wanted(lines: int, since: str | None, kinds: Sequence[str], level: str) -> LogFilter:
    """Return what a command line asks for; raises `InvalidValue`."""
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
    text = f"{clock}  {entry.level:<7}  {entry.kind:<14}  {_said(entry, language)}{code}"
    if "traceback" in entry.detail:
        text += "\n" + "\n".join(f"    {line}" for line in str(entry.detail["traceback"]).splitlines())
    return text


def _said(entry: LogEntry, language: str) -> str:
    """Return what an event says in a language; of what is not declared here, and of the log, the text."""
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
