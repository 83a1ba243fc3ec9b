"""Progress of a motion: bars on a terminal, lines elsewhere, events as sentences."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.events import Event, PhaseBegun, StepAdvanced

if TYPE_CHECKING:
    from rich.progress import TaskID


class Display:
    """Shows nothing; the others say what they show instead.

    `phase` is what the robot said last that it is about, empty before; it tells more than a motion's own name.
    """

    phase: str = ""

    def __enter__(self) -> Self:
        """Begin to show."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Leave the screen as it should stay."""

    def note(self, text: str) -> None:
        """Show one fact."""

    def wait(self, why: str) -> None:
        """Show what is waited for, also to whoever wants nothing but the result on the output."""
        print(why, file=sys.stderr, flush=True)

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Show how far a motion has come [s]."""

    def rest(self) -> None:
        """Show that nothing moves."""


class FactLines(Display):
    """One line a fact."""

    def note(self, text: str) -> None:
        """Print one fact."""
        output.say(text)

    def wait(self, why: str) -> None:
        """Print what is waited for."""
        self.note(why)


class ProgressBars(Display):
    """Facts as lines, and below them one bar for the motion under way, drawn by a thread of its own."""

    def __init__(self, language: str) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        self._left = "{:>6.1f} s " + translate("left", language)
        clock = TextColumn("{task.fields[clock]}")
        self._progress = Progress(
            TextColumn("{task.description:<12}"), BarColumn(40), clock, transient=True, refresh_per_second=10
        )
        self._timed = self._progress.add_task("", visible=False, clock="")
        self._untimed = self._progress.add_task("", visible=False, clock="", total=None)

    def __enter__(self) -> Self:
        """Begin to draw."""
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Take the bar away."""
        self._progress.stop()

    def note(self, text: str) -> None:
        """Print one fact above the bar."""
        self._progress.console.print(text, markup=False, highlight=False)

    def wait(self, why: str) -> None:
        """Print what is waited for."""
        self.note(why)

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Set the bar; where the duration is not known (0, in a homing) one that pulses and counts the time up."""
        description = self.phase or phase
        if duration > 0.0:
            done = min(elapsed, duration)
            left = self._left.format(duration - done)
            self._only(self._timed, description=description, total=duration, completed=done, clock=left)
        else:
            self._only(self._untimed, description=description, completed=elapsed, clock=f"{elapsed:>6.1f} s")

    def rest(self) -> None:
        """Hide the bars."""
        self._only(None)

    def _only(self, shown: TaskID | None, **fields: Any) -> None:
        for bar in (self._timed, self._untimed):
            self._progress.update(bar, visible=bar == shown)
        if shown is not None:
            self._progress.update(shown, **fields)


def chosen(settings: OutputSettings) -> Display:
    """Return the display that suits the settings and the screen."""
    if settings.json:
        return Display()
    return ProgressBars(settings.language) if sys.stdout.isatty() else FactLines()


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
