"""The recorder of RA, RD and RC: what happens at chosen samples, written into arrays while everything else goes on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor, inf
from typing import TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.language.arrays import Arrays
from dmc41x3.twin.refusal import Rejection

_SAME = 1e-6
"""A time this much of a sample before one counts as that sample."""

MOST = 8
"""Arrays, and sources, that can be recorded at once."""

Source: TypeAlias = Callable[[], int]
"""What is recorded: raw fixed point, of the present instant."""


class ArrayRecorder:
    """An activity that looks at its sources at the samples of the servo.

    `recording` is `_RC`, `next_index` is `_RD`: the element that is written next.
    """

    watching = False

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays
        self.reset()

    @property
    def active(self) -> bool:
        """Whether it records."""
        return self.recording

    def reset(self) -> None:
        """Forget arrays and sources, as a power-up does."""
        self._names: tuple[str, ...] = ()
        self._sources: tuple[Source, ...] = ()
        self.recording = False
        self.next_index = 0

    def choose_arrays(self, names: Sequence[str]) -> None:
        """Say where to record to (RA); raises `Rejection`: 80 while recording, 82 for an unknown array."""
        self._stopped()
        for name in names:
            self._arrays.row(name)
        self._names = tuple(names)

    def choose_sources(self, sources: Sequence[Source]) -> None:
        """Say what to record (RD), in the order of the arrays; raises `Rejection` (80) while recording."""
        self._stopped()
        self._sources = tuple(sources)

    def begin(self, now: float, started: float, period: float, every: int, count: int) -> None:
        """Record every so many samples (RC), from the next sample after `now` [s].

        Samples are a `period` apart [s] and count from `started` [s]. It ends after `count` records, 0 for as many as
        the shortest array holds; with a negative one it begins again at the first element for ever. Raises `Rejection`:
        80 while recording, 81 without an array for each source and a source for each array, 84 for more records than
        an array holds.
        """
        self._stopped()
        if not self._names or len(self._names) != len(self._sources):
            raise Rejection(ErrorCode.NO_RECORDING_SOURCE)
        room = min(len(self._arrays.row(name)) for name in self._names)
        if abs(count) > room:
            raise Rejection(ErrorCode.TOO_MANY_ELEMENTS)
        self._count, self._circular = abs(count) or room, count < 0
        self._started, self._period, self._every = started, period, every
        self._tick = floor((now - started) / period + _SAME) + 1
        self.next_index = 0
        self.recording = True

    def stop(self) -> None:
        """End recording (RC 0); again is harmless."""
        self.recording = False

    def uses(self, name: str) -> bool:
        """Tell whether an array is being recorded to."""
        return self.recording and name in self._names

    def next_event(self) -> float:
        """Return the time of the next record [s], infinity while nothing is recorded."""
        return self._started + self._tick * self._period if self.recording else inf

    def look(self, now: float) -> None:
        """Record what is due."""
        while self.recording and self.next_event() <= now:
            for name, source in zip(self._names, self._sources, strict=True):
                self._arrays.assign(name, self.next_index, source())
            self._tick += self._every
            self.next_index += 1
            if self.next_index == self._count:
                self.recording = self._circular
                self.next_index = 0 if self._circular else self.next_index

    def _stopped(self) -> None:
        if self.recording:
            raise Rejection(ErrorCode.RECORDING)
