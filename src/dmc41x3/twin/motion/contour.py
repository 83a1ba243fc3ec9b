"""Contour mode (CM, CD, DT): axes go given distances in equal times, at constant speed within each.

Where the manual is silent: a contour begins with its first CD, or with DT where that paused it before; CD with =t sets
DT from there on, but does not end a pause; data that come too late (42) find the axes stopped dead on the last count,
out of the contour but still in the mode, so that the next CD begins anew; ST, a limit or a fault ends the mode.
"""

from __future__ import annotations

from collections.abc import Callable

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion.feed import Feed, FeedRecord, PlacedRecord
from dmc41x3.twin.timeline import TimelinePiece

NAME = "CM"
"""What an axis in a contour has for its plane."""

PAUSED = -1
"""DT that lets records wait."""


class Contour(Feed):
    """The contour; `interval` is DT as a power of two of samples, 0 for none, and `starved` is called at error 42."""

    capacity = 511
    running_code = StopCode.CONTOUR_RUNNING
    done_code = starved_code = StopCode.CONTOUR_STOPPED

    def __init__(self) -> None:
        super().__init__(NAME)
        self.interval = 0
        self.starved: Callable[[], None] = lambda: None
        self._usual = 0.0

    def select(self, members: tuple[int, ...], t: float) -> None:
        """Choose the axes (CM) at time `t` and forget what waits."""
        self.members = members
        self.clear(t)

    def set_interval(self, interval: int, sample: float) -> None:
        """Set DT, with the sample time [s]; -1 pauses, any other goes on."""
        self.interval = interval
        self.paused = interval == PAUSED
        self._usual = 0.0 if interval <= 0 else 2**interval * sample
        self.stale = True

    def set_time(self, interval: int, sample: float) -> None:
        """Set the time of the records to come (CD with =t); a pause remains one."""
        if not self.paused:
            self.interval = interval
        self._usual = 2**interval * sample

    @property
    def usual(self) -> float | None:
        """How long a record takes that is given now [s], 0 where nobody said; None where DT is to tell later."""
        return None if self.paused and not self._usual else self._usual

    def finish(self, t: float) -> StopCode:
        """End the contour at time `t`; where its data ran out, report that and stay in the mode."""
        starved = self.running and not self._closed and not self.stopping
        if not starved:
            self.members = ()
        result = super().finish(t)
        if starved:
            self.starved()
        return result

    def reset(self) -> None:
        """Forget everything, as power-up does."""
        self.stopping = True
        super().reset()
        self.paused, self.interval, self._usual = False, 0, 0.0

    def _duration(self, record: FeedRecord) -> float:
        return self._usual if record.duration is None else record.duration

    def _shape(self, laid: PlacedRecord, place: int) -> list[TimelinePiece]:
        speed = laid.record.deltas[place] / (laid.end - laid.start)
        return [TimelinePiece(laid.start, laid.places[place], speed, 0.0)]
