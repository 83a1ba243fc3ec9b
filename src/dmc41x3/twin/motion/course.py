"""What moves axes by a plan of its own: a vector sequence, a contour, a PVT sequence."""

from __future__ import annotations

from typing import Protocol

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.timeline import TimelinePiece


class SharedMotion(Protocol):
    """A motion that axes take part in, as the motion core runs it. Times are seconds, positions motor counts.

    `letter` is what an axis on it has for `Axis.plane`; `members` are the indices of its axes. `running_code` is their
    stop code while it runs; `stale` tells that its plan must be made anew.
    """

    letter: str
    members: tuple[int, ...]
    running: bool
    stopping: bool
    stale: bool
    running_code: StopCode

    @property
    def end(self) -> float:
        """When the run ends [s]; infinite where it does not."""
        ...

    @property
    def horizon(self) -> float:
        """When more of the plan must be asked for, by `replan` [s]; infinite where all of it is known."""
        ...

    def replan(self, t: float) -> float:
        """Make the plan anew at time `t`; return from when on it differs from the old one, infinity for nowhere."""
        ...

    def pieces(self, place: int) -> tuple[list[TimelinePiece], float]:
        """Return the newest part of the plan for one member (by its place), and its largest speed [counts/s]."""
        ...

    def brake(self, t: float) -> bool:
        """Stop along the way; False where it cannot, so that each axis must brake by itself."""
        ...

    def finish(self, t: float) -> StopCode:
        """End the run at time `t`, forget what is left of it, and return the stop code of the members."""
        ...

    def reset(self) -> None:
        """Forget everything, as power-up does."""
        ...
