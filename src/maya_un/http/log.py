"""The log: bounded files of JSON lines, readable lines on the screen, and the handler of unexpected errors.

{"time": "2026-11-21T19:30:00.123Z", "level": "info", "logger": "maya.http", "message": "POST /v1/stop 200", "request":
"4f1c22-17", "code": 0, …}
"""

from __future__ import annotations

import json
import logging
import os
import queue
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from io import TextIOWrapper
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from dmc41x3.files import private_opener
from dmc41x3.i18n import one_line, phrase
from maya_un.config.state_folder import own_state_folder, state_folder
from maya_un.errors import InternalError, MayaError
from maya_un.events import DECLARED, Event

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop

ROOT = "maya"
"""The parent of all loggers of Maya."""

MOST_BYTES = 5_000_000
"""Length of a file at which a new one is started [bytes]."""

MOST_FILES = 4
"""Number of older files that are stored beside it: maya.log.1 and so on."""

MOST_LINES = 10_000
"""Maximum number of lines that wait to be written."""

LAST_WORDS = 2.0
"""Longest wait for unwritten lines at the end of the log [s]."""


def log_path() -> Path:
    """Return the path of the log: maya.log in the state folder."""
    return state_folder() / "maya.log"


def note(logger: str, level: int, message: str, **fields: object) -> None:
    """Write a line; `fields` are additional keys in the file."""
    logging.getLogger(f"{ROOT}.{logger}").log(level, message, extra={"fields": fields})


def level_of(kind: str) -> int:
    """Return the log level of a kind of event; phases and single motions have a level below the default."""
    return DECLARED.get(kind, Event).level


def note_event(event: Event) -> None:
    """Write an event of the robot at its level; phases and single motions are written only at a lower log level."""
    facts = {"seq": event.seq, "kind": event.kind, "code": event.code, "detail": dict(event.detail)}
    note("events", event.level, str(event), **facts)


def note_defect(error: BaseException) -> str:
    """Write a defect with its traceback, even while no log is open; return "", or the reason why that failed."""
    record = logging.LogRecord(f"{ROOT}.defect", logging.ERROR, "", 0, f"{type(error).__name__}: {error}", None, None)
    record.exc_info = (type(error), error, error.__traceback__)
    for handler in logging.getLogger(ROOT).handlers:
        if isinstance(handler, _LogWriter):
            handler.file.handle(record)
            return handler.file.refusal
    file = LogFile.opened()
    file.handle(record)
    file.close()
    return file.refusal


@contextmanager
def kept(*, people: bool = True) -> Iterator[None]:
    """Keep a log while the block runs; with `people`, also write warnings to stderr, under systemd all messages."""
    logger = logging.getLogger(ROOT)
    slot = _LogWriter(LogFile.opened(), _for_people() if people else None)
    logger.setLevel(logging.INFO)
    logger.propagate = False
    logger.addHandler(slot)
    try:
        yield
    finally:
        logger.removeHandler(slot)
        slot.close()


def hand_over(name: str) -> None:
    """Redirect the errors of a library's logger to this log; without a handler they would appear on the screen."""
    logger = logging.getLogger(name)
    logger.propagate = False
    if not logger.handlers:
        logger.addHandler(_FromLibraries())


class LogFile(RotatingFileHandler):
    """The log file. A failed write raises no error: `refusal` is its reason."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, maxBytes=MOST_BYTES, backupCount=MOST_FILES, encoding="utf-8", errors="backslashreplace", delay=True
        )
        self.setFormatter(_AsJson())
        self.refusal = ""

    @classmethod
    def opened(cls) -> LogFile:
        """Return the log at its path; its folder is created if it does not exist."""
        with suppress(MayaError):
            own_state_folder()
        return cls(log_path())

    def _open(self) -> TextIOWrapper:
        """Open the file with access for its owner alone, without following links."""
        descriptor = private_opener(self.baseFilename, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        return os.fdopen(descriptor, "a", encoding=self.encoding, errors=self.errors)

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line, or store the reason why it failed in `refusal`."""
        self.refusal = ""
        super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the library's name
        """Store the reason why a line cannot be written."""
        error = sys.exception()
        self.refusal = getattr(error, "strerror", None) or str(error)


class _LogWriter(logging.Handler):
    """Queues lines for a writing thread, so that no caller waits for a disk or a terminal.

    If the queue is full, further lines are lost.
    """

    def __init__(self, file: LogFile, people: logging.Handler | None) -> None:
        super().__init__()
        self.file = file
        self._handlers = (file,) if people is None else (file, people)
        self._lines: queue.Queue[logging.LogRecord | None] = queue.Queue(MOST_LINES)
        self._over = False
        self._writer = threading.Thread(target=self._write, name="maya-log", daemon=True)
        self._writer.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a line."""
        with suppress(queue.Full):
            self._lines.put_nowait(record)

    def close(self) -> None:
        """Write the queued lines; wait at most `LAST_WORDS` for a blocked terminal."""
        with suppress(queue.Full):
            self._lines.put(None, timeout=LAST_WORDS)
        self._writer.join(LAST_WORDS)
        self._over = True
        for handler in (self.file,) if self._writer.is_alive() else self._handlers:
            handler.close()
        super().close()

    def _write(self) -> None:
        while (record := self._lines.get()) is not None and not self._over:
            for handler in self._handlers:
                if record.levelno >= handler.level:
                    handler.handle(record)


class _AsJson(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        """Return a line as JSON."""
        line: dict[str, Any] = {
            "time": _date(record),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **_fields(record),
        }
        if record.exc_info:
            line["traceback"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False, default=str)


class _AsSentence(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        """Return a line as readable text."""
        code = _fields(record).get("code")
        told = f"{_date(record)} {record.levelname.lower()} {record.name}: {one_line(record.getMessage())}"
        return f"{told} ({code})" if code else told


class _FromLibraries(logging.Handler):
    """Writes defects of a library to the log; a request cut short at the end is not a defect."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a defect to the log."""
        defect = record.exc_info[1] if record.exc_info else None
        if isinstance(defect, Exception):
            note_defect(defect)


class _Screen(logging.StreamHandler[TextIO]):
    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the library's name
        """Do nothing: stderr is closed, so the error cannot be shown."""


def _for_people() -> logging.Handler:
    handler = _Screen(sys.stderr)
    handler.setFormatter(_AsSentence())
    handler.setLevel(logging.INFO if "JOURNAL_STREAM" in os.environ else logging.WARNING)
    return handler


def _fields(record: logging.LogRecord) -> Mapping[str, Any]:
    return getattr(record, "fields", {})


def _date(record: logging.LogRecord) -> str:
    date = datetime.fromtimestamp(record.created, UTC)
    return date.isoformat(timespec="milliseconds").replace("+00:00", "Z")


def keep_quiet(loop: AbstractEventLoop) -> None:
    """Write errors in `loop` that no code awaits to the log, instead of to the screen."""
    loop.set_exception_handler(lambda _, context: _unawaited(context))


def _unawaited(context: dict[str, Any]) -> None:
    written_down(context.get("exception") or RuntimeError(context["message"]))


def written_down(error: BaseException) -> InternalError:
    """Write `error` with its traceback to the log and return it as an `InternalError` that names the log."""
    summary = f"{type(error).__name__}: {error}"
    refusal = note_defect(error)
    if refusal:
        return InternalError(
            reason=phrase(
                "{summary}; the log {path} cannot be written: {refusal}",
                summary=summary,
                path=log_path(),
                refusal=refusal,
            )
        )
    return InternalError(reason=phrase("{summary}; log: {path}", summary=summary, path=log_path()))
