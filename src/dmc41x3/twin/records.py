"""Data records that go out by themselves: DR sends one by UDP every few samples."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.handles import Handle, HandleProtocol, Handles
from dmc41x3.twin.outlet import SERIAL, OutputBuffer


class RecordEmitter:
    """The stream of records, an activity of the machine; `source` encodes the record of this instant.

    `period` [samples] is 0 while there is none. Records due while a program or an array is downloaded, or while
    memory is burned, are left out, as on the controller; the others keep their places in time.
    """

    def __init__(self, handles: Handles, outlet: OutputBuffer) -> None:
        self._handles = handles
        self._outlet = outlet
        self.source: Callable[[], bytes] = bytes
        self.period = 0
        self._sample = 0.0
        self._handle: Handle | None = None
        self._due = inf
        self._silent_until = -inf

    @property
    def place(self) -> int:
        """The handle's number that the records go to (`_DR1`), 0 where they go to a serial port."""
        target = self._target()
        return 0 if target is None else target.index

    @property
    def active(self) -> bool:
        """Whether there is a stream."""
        return self.period != 0

    @property
    def watching(self) -> bool:
        """A stream does not care what befalls axes."""
        return False

    def start(self, period: int, sample: float, handle: Handle | None, now: float) -> None:
        """Send a record every `period` samples of length `sample` [s] to a UDP handle, or where CF says (None)."""
        self.period, self._sample, self._handle = period, sample, handle
        self._due = now + period * sample

    def stop(self) -> None:
        """End the stream."""
        self.period, self._handle, self._due = 0, None, inf

    def pause(self, until: float) -> None:
        """Leave out the records due before `until` [s]."""
        self._silent_until = max(self._silent_until, until)

    def next_event(self) -> float:
        """Return when the next record is due [s], infinity without a stream."""
        return self._due

    def look(self, now: float) -> None:
        """Send the record that is due."""
        if self._handle is not None and not self._handle.open:
            self.stop()
        if now < self._due:
            return
        # Counted on from the record before, not from now: the stream does not drift.
        self._due += self.period * self._sample
        target = self._target()
        if target is not None and now >= self._silent_until and not self._downloading():
            self._outlet.put(target, self.source())

    def reset(self) -> None:
        """End the stream, as power-up does."""
        self.stop()
        self._silent_until = -inf

    def _target(self) -> Handle | None:
        if self._handle is not None or not self.period or self._outlet.port in SERIAL:
            return self._handle
        handle = self._handles.at(self._outlet.port) if self._outlet.port in LETTERS else None
        return handle if handle is not None and handle.kind is HandleProtocol.UDP else None

    def _downloading(self) -> bool:
        return any(handle is not None and handle.download is not None for handle in self._handles)
