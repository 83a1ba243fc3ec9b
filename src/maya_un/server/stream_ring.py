"""The newest events of this run as they go over the wire, kept once for all readers."""

from __future__ import annotations

from collections import deque

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
