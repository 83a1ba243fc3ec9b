"""The log: JSON lines in a file that is bounded, and lines for people on the error line; times are UTC.

{"time": "2026-11-21T19:30:00.123Z", "level": "info", "logger": "maya.http", "message": "POST /v1/stop 200",
"request": "4f1c22-17", "code": 0, …}
"""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any

from maya_un.config.state import state_folder
from maya_un.events import Event, Kind

ROOT = "maya"
"""The logger above all of ours."""

MOST_BYTES = 5_000_000
"""Where a file is as long as that, a new one is begun."""

MOST_FILES = 4
"""So many older files are kept beside it: maya.log.1 and so on."""

_EVENT_LEVELS = {
    Kind.PHASE: logging.DEBUG,
    Kind.MOVING: logging.DEBUG,
    Kind.IDLE: logging.DEBUG,
    Kind.FAULT: logging.ERROR,
    Kind.ESTOP: logging.ERROR,
    Kind.STORAGE: logging.ERROR,
    Kind.DISCONNECTED: logging.WARNING,
    Kind.LIMIT: logging.WARNING,
}


def log_path() -> Path:
    """Return the log's place: maya.log in the folder of state."""
    return state_folder() / "maya.log"


def note(logger: str, level: int, message: str, **fields: object) -> None:
    """Write a line; `fields` are keys of their own in the file."""
    logging.getLogger(f"{ROOT}.{logger}").log(level, message, extra={"fields": fields})


def level_of(kind: str) -> int:
    """Return how grave an event of a kind is; phases and single motions are for those who want everything."""
    return _EVENT_LEVELS.get(Kind(kind), logging.INFO) if kind in set(Kind) else logging.INFO


def note_event(event: Event) -> None:
    """Write what happened to the robot; phases and single motions only where everything is wanted."""
    level = level_of(event.kind)
    note("events", level, str(event), seq=event.seq, kind=event.kind.value, code=event.code, detail=dict(event.detail))


def note_defect(error: BaseException) -> str:
    """Write a defect with its traceback, also where no log is kept just now; return "", or why it cannot be written."""
    file = next((one for one in logging.getLogger(ROOT).handlers if isinstance(one, LogFile)), None)
    record = logging.LogRecord(f"{ROOT}.defect", logging.ERROR, "", 0, f"{type(error).__name__}: {error}", None, None)
    record.exc_info = (type(error), error, error.__traceback__)
    if file is not None:
        file.handle(record)
        return file.refusal
    with suppress(OSError):
        log_path().parent.mkdir(parents=True, exist_ok=True)
    file = LogFile(log_path())
    file.handle(record)
    file.close()
    return file.refusal


@contextmanager
def kept(*, people: bool = True) -> Iterator[None]:
    """Keep a log while the block runs; with `people` the error line has it too, on a terminal warnings only."""
    logger = logging.getLogger(ROOT)
    with suppress(OSError):
        log_path().parent.mkdir(parents=True, exist_ok=True)
    handlers: list[logging.Handler] = [LogFile(log_path())]
    if people:
        handlers.append(_for_people())
    logger.setLevel(logging.INFO)
    logger.propagate = False
    for handler in handlers:
        logger.addHandler(handler)
    try:
        yield
    finally:
        for handler in handlers:
            logger.removeHandler(handler)
            handler.close()


def hand_over(name: str) -> None:
    """Have what a library's logger complains of written to our log; without a handler it would go to the screen."""
    logger = logging.getLogger(name)
    logger.propagate = False
    if not logger.handlers:
        logger.addHandler(_FromLibraries())


class LogFile(RotatingFileHandler):
    """The file. What cannot be written is no second error: `refusal` says why."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, maxBytes=MOST_BYTES, backupCount=MOST_FILES, encoding="utf-8", errors="backslashreplace", delay=True
        )
        self.setFormatter(_AsJson())
        self.refusal = ""

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line, or remember why not."""
        self.refusal = ""
        super().emit(record)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - the library's name
        """Remember why a line cannot be written."""
        error = sys.exception()
        self.refusal = getattr(error, "strerror", None) or str(error)


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


def _for_people() -> logging.Handler:
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_AsSentence())
    handler.setLevel(logging.WARNING if sys.stderr.isatty() else logging.INFO)
    return handler


def _fields(record: logging.LogRecord) -> Mapping[str, Any]:
    return getattr(record, "fields", {})


def _date(record: logging.LogRecord) -> str:
    date = datetime.fromtimestamp(record.created, UTC)
    return date.isoformat(timespec="milliseconds").replace("+00:00", "Z")
