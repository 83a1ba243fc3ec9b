"""Unexpected errors: logged with their traceback, answered as one sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from maya_un.errors import InternalError
from maya_un.server.log import log_path, note_defect

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop


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
