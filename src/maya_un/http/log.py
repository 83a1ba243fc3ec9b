"""The log: bounded files of JSON lines, lines for people, and the handler of unexpected errors.

{"time": "2026-11-21T19:30:00.123Z", "level": "info", "logger": "maya.http", "message": "POST /v1/stop 200",
"request": "4f1c22-17", "code": 0, …}
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
from maya_un.config.state_folder import own_state_folder, state_folder
from maya_un.errors import InternalError, MayaError
from maya_un.events import DECLARED, Event

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop

ROOT = "maya"
"""The logger above all of ours."""

MOST_BYTES = 5_000_000
"""A file of this length is closed, and a new one is begun."""

MOST_FILES = 4
"""So many older files are kept beside it: maya.log.1 and so on."""

MOST_LINES = 10_000
"""So many lines wait to be written at most."""

LAST_WORDS = 2.0
"""How long the end waits for what is still to be written [s]."""


def log_path() -> Path:
    """Return the log's place: maya.log in the folder of state."""
    return state_folder() / "maya.log"


def note(logger: str, level: int, message: str, **fields: object) -> None:
    """Write a line; `fields` are keys of their own in the file."""
    logging.getLogger(f"{ROOT}.{logger}").log(level, message, extra={"fields": fields})


def level_of(kind: str) -> int:
    """Return how grave an event of a kind is; phases and single motions are for those who want everything."""
    return DECLARED.get(kind, Event).level


def note_event(event: Event) -> None:
    """Write what happened to the robot; phases and single motions only where everything is wanted."""
    facts = {"seq": event.seq, "kind": event.kind, "code": event.code, "detail": dict(event.detail)}
    note("events", event.level, str(event), **facts)


def note_defect(error: BaseException) -> str:
    """Write a defect with its traceback, also where no log is kept just now; return "", or why it cannot be written."""
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
    """Keep a log while the block runs; with `people` the error line has warnings too, under systemd everything."""
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
    """Have what a library's logger complains of written to our log; without a handler it would go to the screen."""
    logger = logging.getLogger(name)
    logger.propagate = False
    if not logger.handlers:
        logger.addHandler(_FromLibraries())


class LogFile(RotatingFileHandler):
    """The file. A failed write is no second error: `refusal` says why."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, maxBytes=MOST_BYTES, backupCount=MOST_FILES, encoding="utf-8", errors="backslashreplace", delay=True
        )
        self.setFormatter(_AsJson())
        self.refusal = ""

    @classmethod
    def opened(cls) -> LogFile:
        """Return the log at its place, in a folder that is made where it is not there."""
        with suppress(MayaError):
            own_state_folder()
        return cls(log_path())

    def _open(self) -> TextIOWrapper:
        """Open the file for its owner alone; no link is followed."""
        descriptor = private_opener(self.baseFilename, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        return os.fdopen(descriptor, "a", encoding=self.encoding, errors=self.errors)

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line, or remember why not."""
        self.refusal = ""
        super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the library's name
        """Remember why a line cannot be written."""
        error = sys.exception()
        self.refusal = getattr(error, "strerror", None) or str(error)


class _LogWriter(logging.Handler):
    """Takes lines and has a thread write them: whoever has something to say never waits for a disk or a terminal.

    If there are more messages than can be written, the rest is lost.
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
        """Take a line."""
        with suppress(queue.Full):
            self._lines.put_nowait(record)

    def close(self) -> None:
        """Write what was said; a terminal that takes nothing is not waited for."""
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
        """Return a line for people."""
        code = _fields(record).get("code")
        told = f"{_date(record)} {record.levelname.lower()} {record.name}: {record.getMessage()}"
        return f"{told} ({code})" if code else told


class _FromLibraries(logging.Handler):
    """Writes a library's defects down; a request that was cut short at the end is none."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a defect down."""
        defect = record.exc_info[1] if record.exc_info else None
        if isinstance(defect, Exception):
            note_defect(defect)


class _Screen(logging.StreamHandler[TextIO]):
    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the library's name
        """Do nothing: then nobody is there to be told."""


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
    """Have what fails in `loop` with nobody waiting for it written to the log, instead of thrown at the screen."""
    loop.set_exception_handler(lambda _, context: _unawaited(context))


def _unawaited(context: dict[str, Any]) -> None:
    written_down(context.get("exception") or RuntimeError(context["message"]))


def written_down(error: BaseException) -> InternalError:
    """Write `error` with its traceback to the log and return it as an `InternalError` that names the log."""
    summary = f"{type(error).__name__}: {error}"
    refusal = note_defect(error)
    if refusal:
        return InternalError(reason=f"{summary}; the log {log_path()} cannot be written: {refusal}")
    return InternalError(reason=f"{summary}; log: {log_path()}")
