"""The commands, by what they concern; every module has a `TABLE` of two-letter names and handlers."""

from __future__ import annotations

from functools import partial

from dmc41x3.twin.commands import (
    array,
    contouring,
    coordinated,
    ethernet,
    gearing,
    hardware,
    inquiry,
    message,
    motion,
    peripherals,
    program,
    setting,
    system,
    vector,
)
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.coverage import COVERAGE, CoverageClass

_HANDLERS: dict[str, Handler] = {
    **setting.TABLE,
    **motion.TABLE,
    **coordinated.TABLE,
    **vector.TABLE,
    **contouring.TABLE,
    **gearing.TABLE,
    **hardware.TABLE,
    **inquiry.TABLE,
    **system.TABLE,
    **ethernet.TABLE,
    **message.TABLE,
    **peripherals.TABLE,
    **array.TABLE,
    **program.TABLE,
}


def _noted(name: str, handler: Handler, reason: str, context: CallerContext, text: str) -> Answer:
    """Execute a command that has no effect, and have that noted."""
    answer = handler(context, text)
    if answer is None:
        context.unit.note(f"{name} has no effect on this twin: {reason}")
    return answer


def _with_notes(name: str, handler: Handler) -> Handler:
    coverage = COVERAGE.get(name)
    if coverage is None or coverage.kind is not CoverageClass.ACCEPTED:
        return handler
    return partial(_noted, name, handler, coverage.reason)


TABLE: dict[str, Handler] = {name: _with_notes(name, handler) for name, handler in _HANDLERS.items()}
"""Every command that this controller knows."""
