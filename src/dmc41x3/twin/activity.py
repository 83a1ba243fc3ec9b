"""What a controller does by itself beside motion: runs programs, records arrays, sends data records."""

from __future__ import annotations

from typing import Protocol


class Activity(Protocol):
    """Something with a time of its own; the machine never runs past its next event.

    Times are seconds of the machine's clock.
    """

    @property
    def active(self) -> bool:
        """Whether it has anything to do, now or later; while not, nobody looks at it. Only a command changes that."""
        ...

    @property
    def watching(self) -> bool:
        """Whether it wants to see what happens to axes at once, though it has nothing to do until then."""
        ...

    def next_event(self) -> float:
        """Return when it wants to be looked at next [s], infinity for never."""
        ...

    def look(self, now: float) -> None:
        """Do what is due at `now` [s]. Called after every event, its own or another's, and after every command.

        What befell axes stands in the motion core's `happened` during this call and is forgotten behind it.
        """
        ...

    def reset(self) -> None:
        """Do what a power-up does to it."""
        ...
