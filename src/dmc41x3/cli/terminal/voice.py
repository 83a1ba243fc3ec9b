"""What a session has to say, and who hears it: a screen or a pipe."""

from __future__ import annotations

from typing import Protocol


class SessionOutput(Protocol):
    """Where the words of a session go. None of it waits."""

    def answer(self, text: str) -> None:
        """Show what the controller printed, a colon for nothing."""
        ...

    def refused(self, text: str) -> None:
        """Show that the controller refused a command, with code and words."""
        ...

    def message(self, text: str) -> None:
        """Show a line that a program in the controller sent by itself."""
        ...

    def note(self, text: str) -> None:
        """Show what the terminal itself has to say."""
        ...

    def trouble(self, text: str) -> None:
        """Show what went wrong on this side, or with the link."""
        ...
