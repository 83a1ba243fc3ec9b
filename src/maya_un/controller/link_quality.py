"""The quality of the link to the controller: reply times, the rate of records, losses."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from maya_un.schema.robot import LinkView

REPLIES = 128
"""Number of the newest replies that are summarized."""

SPAN = 2.0
"""The rate of records is that of this time [s, real time]."""


class _Reply(NamedTuple):
    """The reply to a request for a record: when it arrived, and how long it took [s, loop time]."""

    arrived: float
    took: float


class LinkQuality:
    """Collects the replies to requests for the data record (Galil QR), and counts losses of the link."""

    def __init__(self) -> None:
        self._replies: deque[_Reply] = deque(maxlen=REPLIES)
        self.losses = 0

    def replied(self, asked: float, now: float) -> None:
        """Note a reply that was asked for at loop time `asked` and arrived `now` [s]."""
        self._replies.append(_Reply(now, now - asked))

    def lost(self) -> None:
        """Note a loss of the link."""
        self.losses += 1
        self._replies.clear()

    def view(self, now: float, speed: float, *, up: bool) -> LinkView:
        """Return a summary at loop time `now` [s], in real time; the loop's clock runs at `speed` times real time."""
        if not self._replies:
            return LinkView(up, None, None, 0.0, None, self.losses)
        times = sorted(reply.took / speed for reply in self._replies)
        recent = sum(now - reply.arrived <= SPAN * speed for reply in self._replies)
        age = (now - self._replies[-1].arrived) / speed
        late = times[min(len(times) - 1, int(0.95 * len(times)))]
        return LinkView(up, times[len(times) // 2], late, recent / SPAN, age, self.losses)
