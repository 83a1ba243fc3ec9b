"""Progress of a motion or a computation: bars on a terminal, lines elsewhere, events as sentences."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from dmc41x3.i18n import translate
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.events import Event, PhaseBegun, StepAdvanced
from maya_un.vocabulary import PHASES, worded

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class Display:
    """Display that shows nothing; subclasses override its methods.

    `phase` is the current phase reported by the robot, "" at first; it is more specific than the name of a motion.
    """

    phase: str = ""

    def __enter__(self) -> Self:
        """Start the display."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End the display."""

    def note(self, text: str) -> None:
        """Show a message."""

    def wait(self, why: str) -> None:
        """Show the reason for waiting on the error stream, so that the output contains only the result."""
        print(why, file=sys.stderr, flush=True)

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Show the progress of a motion [s]."""

    def rest(self) -> None:
        """Show that nothing moves."""

    def reached(self, part: float) -> None:
        """Show which part of a computation is done, 0 to 1."""


class FactLines(Display):
    """Display with one line per message."""

    def note(self, text: str) -> None:
        """Print a message."""
        output.say(text)

    def wait(self, why: str) -> None:
        """Print the reason for waiting."""
        self.note(why)


class DrawnDisplay(Display):
    """Display that a separate thread draws until it ends; its subclasses fill `_progress`."""

    _progress: Progress

    def __enter__(self) -> Self:
        """Start drawing."""
        self._progress.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Remove what is drawn."""
        self._progress.stop()


class ProgressBars(DrawnDisplay):
    """Messages as lines, and below them a bar for the running motion."""

    def __init__(self, language: str) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        self._language = language
        self._left = "{:>6.1f} s " + translate("left", language)
        clock = TextColumn("{task.fields[clock]}")
        self._progress = Progress(
            TextColumn("{task.description:<12}"), BarColumn(40), clock, transient=True, refresh_per_second=10
        )
        self._timed = self._progress.add_task("", visible=False, clock="")
        self._untimed = self._progress.add_task("", visible=False, clock="", total=None)

    def note(self, text: str) -> None:
        """Print a message above the bar."""
        self._progress.console.print(text, markup=False, highlight=False)

    def wait(self, why: str) -> None:
        """Print the reason for waiting."""
        self.note(why)

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Set the bar; for an unknown duration (0, in a homing), show a pulsing bar with the elapsed time."""
        description = worded(PHASES, self.phase or phase, self._language)
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


class ComputationLine(DrawnDisplay):
    """One line on the error stream for a computation: what it does, and how far it is if that is known."""

    def __init__(self, what: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        self._what = what
        self._progress = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(20),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        self._task = self._progress.add_task(what, total=None)

    def note(self, text: str) -> None:
        """Show the message as the current part of the computation."""
        self._progress.update(self._task, description=f"{self._what}: {text.strip()}")

    def reached(self, part: float) -> None:
        """Show the part in the bar."""
        self._progress.update(self._task, completed=part, total=1.0)


def computing(what: str, settings: OutputSettings) -> Display:
    """Return the display of a computation that takes longer than a second; it shows nothing without a terminal."""
    if settings.json or not sys.stderr.isatty():
        return Display()
    return ComputationLine(translate(what, settings.language))


def chosen(settings: OutputSettings) -> Display:
    """Return the display for the settings and the terminal."""
    if settings.json:
        return Display()
    return ProgressBars(settings.language) if sys.stdout.isatty() else FactLines()


_INDENT = " " * 7


def line(event: Event, language: str) -> str | None:
    """Return an event as a line, indented below the line of its step; None if it is not shown."""
    text = event.narration(language)
    return text if text is None or isinstance(event, StepAdvanced) else _INDENT + text


def tell(event: Event, display: Display, language: str) -> None:
    """Show an event if it has a line, and store the phase that it starts."""
    if isinstance(event, PhaseBegun):
        display.phase = event.name
    text = line(event, language)
    if text is not None:
        display.note(text)
