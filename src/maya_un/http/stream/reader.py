"""Output to one reader: every event in order from a shared ring, and the latest of everything else."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

MOST_EVENTS = 20_000
"""A reader may be so many events behind, and no further."""

MOST_BYTES = 16_000_000
"""The newest events that are kept for readers are bounded by this, too [bytes]."""


class EventRing:
    """Frames of events numbered `first` to `last` without a gap; the oldest go where `most` or `most_bytes` is passed.

    It begins empty behind the event numbered `last`.
    """

    def __init__(self, last: int, most: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self._frames: deque[bytes] = deque()
        self._most = most
        self._most_bytes = most_bytes
        self._bytes = 0
        self._shared: tuple[int, int, bytes] = (last, last, b"")
        self.first = last + 1
        self.last = last

    def add(self, frame: bytes) -> None:
        """Keep the frame of the next event."""
        self._frames.append(frame)
        self._bytes += len(frame)
        self.last += 1
        while len(self._frames) > self._most or self._bytes > self._most_bytes:
            self._bytes -= len(self._frames.popleft())
            self.first += 1

    def reaches(self, seq: int) -> bool:
        """Tell whether every event numbered above `seq` is here."""
        return seq >= self.first - 1

    def after(self, seq: int, most: int) -> tuple[int, bytes]:
        """Return frames of the events above `seq`, about `most` bytes of them, and the number of the last one.

        Readers that are equally far get the same bytes. Only for a `seq` that the ring reaches.
        """
        began, upto, frames = self._shared
        if began != seq or (upto < self.last and len(frames) < most):
            upto, frames = self._joined(seq, most)
            self._shared = (seq, upto, frames)
        return upto, frames

    def _joined(self, seq: int, most: int) -> tuple[int, bytes]:
        taken: list[bytes] = []
        size = 0
        while seq < self.last and size < most:
            taken.append(self._frames[seq + 1 - self.first])
            size += len(taken[-1])
            seq += 1
        return seq, b"".join(taken)


CHUNK = 65_536
"""About so much of the events is written at once [bytes]."""


class ReaderWire(Protocol):
    """The connection of a reader: `full` while the other side is behind; `on_room` is called when it catches up."""

    on_room: Callable[[], None] | None

    @property
    def full(self) -> bool:
        """Whether nothing more should be written now."""
        ...

    def write(self, frames: bytes) -> None:
        """Send whole frames without waiting."""
        ...


class StreamReader:
    """One reader of the stream.

    Values (a state, the queue) replace an older one that has not gone out yet. Events are sent out of the `ring` that
    all share, so a reader that is behind costs nothing but its place in it; one that is farther behind than the ring
    goes is lost, and `on_lost` is called. `seen` is the number of the last event that went out, None where it wants
    none; with `catching` somebody else sends it the many that it lacks.
    """

    def __init__(self, outlet: ReaderWire, ring: EventRing, on_lost: Callable[[], None]) -> None:
        self._outlet = outlet
        self._ring = ring
        self.on_lost = on_lost
        self._latest: dict[str, bytes] = {}
        self.seen: int | None = None
        self.catching = False
        outlet.on_room = self.go_on

    @property
    def lost(self) -> bool:
        """Whether it is so far behind that events which it lacks have left the ring."""
        return self.seen is not None and not self.catching and not self._ring.reaches(self.seen)

    def show(self, kind: str, frame: bytes) -> None:
        """Send the latest value of a kind, now or as soon as the reader takes it, if it is the latest then."""
        if self._outlet.full:
            self._latest[kind] = frame
        else:
            self._outlet.write(frame)

    def forget(self, kind: str) -> None:
        """Send nothing of a kind that waits."""
        self._latest.pop(kind, None)

    def go_on(self) -> None:
        """Send what waits, as far as the reader takes it."""
        while self._latest and not self._outlet.full:
            self._outlet.write(self._latest.pop(next(iter(self._latest))))
        self.pump()

    def pump(self) -> None:
        """Send the events that it lacks, as far as the reader takes them and the ring has them."""
        while self.seen is not None and not self.catching and self.seen < self._ring.last:
            if self._outlet.full or not self._ring.reaches(self.seen):
                return
            self.seen, frames = self._ring.after(self.seen, CHUNK)
            self._outlet.write(frames)

    def send_past(self, upto: int, frames: bytes) -> None:
        """Send the events from the next that it lacks to the one numbered `upto`, wherever they are from."""
        self._outlet.write(frames)
        self.seen = upto
