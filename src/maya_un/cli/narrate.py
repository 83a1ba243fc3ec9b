"""Events as lines for people."""

from __future__ import annotations

from maya_un.cli.display import Display
from maya_un.events import Event, PhaseBegun, StepAdvanced

_INDENT = " " * 7


def line(event: Event, language: str) -> str | None:
    """Return an event as a line, indented below the line of its step; None where it is not worth one."""
    text = event.narration(language)
    return text if text is None or isinstance(event, StepAdvanced) else _INDENT + text


def tell(event: Event, display: Display, language: str) -> None:
    """Show an event, where it is worth a line, and remember the phase it begins."""
    if isinstance(event, PhaseBegun):
        display.phase = event.name
    text = line(event, language)
    if text is not None:
        display.note(text)
