"""What nobody foresaw: written down with its traceback, answered as one sentence."""

from __future__ import annotations

import os
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

from maya_un.errors import InternalError

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop


def log_path() -> Path:
    """Return the log's place: $XDG_STATE_HOME/maya/maya.log, else under ~/.local/state."""
    state = os.environ.get("XDG_STATE_HOME")
    return (Path(state) if state else Path.home() / ".local" / "state") / "maya" / "maya.log"


def keep_quiet(loop: AbstractEventLoop) -> None:
    """Have what fails in `loop` with nobody waiting for it written to the log, instead of thrown at the screen."""
    loop.set_exception_handler(lambda _, context: _unawaited(context))


def _unawaited(context: dict[str, Any]) -> None:
    written_down(context.get("exception") or RuntimeError(context["message"]))


def written_down(error: BaseException) -> InternalError:
    """Append `error` with its traceback to the log and return it as an `InternalError` that names the log."""
    summary = f"{type(error).__name__}: {error}"
    place = log_path()
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        with place.open("a", encoding="utf-8", errors="backslashreplace") as log:
            log.write("".join(traceback.format_exception(error)) + "\n")
    except OSError as refusal:
        return InternalError(reason=f"{summary}; the log {place} cannot be written: {refusal.strerror}")
    return InternalError(reason=f"{summary}; log: {place}")
