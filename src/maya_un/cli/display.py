"""Showing motion while it happens: bars on a terminal, lines elsewhere, nothing for --json."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Self

from maya_un.cli import output
from maya_un.cli.settings import Settings
from maya_un.cli.words import word


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

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Show how far a motion has come [s]."""

    def rest(self) -> None:
        """Show that nothing moves."""


class Lines(Display):
    """One line a fact."""

    def note(self, text: str) -> None:
        """Print one fact."""
        output.say(text)


class Bars(Display):
    """Facts as lines, and below them one bar for the motion under way, drawn by a thread of its own."""

    def __init__(self, language: str) -> None:
        from rich.progress import BarColumn, Progress, TextColumn

        left = "{task.fields[left]:>6.1f} s " + word("left", language)
        self._progress = Progress(
            TextColumn("{task.description:<12}"), BarColumn(40), TextColumn(left), transient=True, refresh_per_second=10
        )
        self._bar = self._progress.add_task("", visible=False, left=0.0)

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

    def motion(self, phase: str, elapsed: float, duration: float) -> None:
        """Set the bar."""
        done = min(elapsed, duration)
        self._progress.update(
            self._bar,
            description=self.phase or phase,
            total=duration,
            completed=done,
            left=duration - done,
            visible=True,
        )

    def rest(self) -> None:
        """Hide the bar."""
        self._progress.update(self._bar, visible=False)


def chosen(settings: Settings) -> Display:
    """Return the display that suits the settings and the screen."""
    if settings.json:
        return Display()
    return Bars(settings.language) if sys.stdout.isatty() else Lines()
