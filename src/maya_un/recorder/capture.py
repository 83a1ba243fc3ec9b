"""Capture: transports that record their traffic, and the ring that holds the last minutes.

Values are stored by reference; nothing is copied or encoded before a recording is saved. The cost of an entry is the
number of its bytes, and a fixed share for the objects around them.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeAlias

from dmc41x3.wire.transcript import Side, WirePiece
from dmc41x3.wire.transport import Transport
from maya_un.errors import MachineError
from maya_un.events import Event
from maya_un.values import State

WIRE_COST = 192
"""Bytes of memory counted for a piece of the wire besides its data: the entry, the time, the bytes object."""

STATE_COST = 1_536
"""Bytes of memory counted for a state with its tuples."""

EVENT_COST = 1_024
"""Bytes of memory counted for an event with its details."""

_SHARE = 64
"""A full ring drops a 64th part of its bounds at once, so that dropping costs next to nothing for each entry."""


class WireDirection(NamedTuple):
    """The origin of a piece of the wire: the connection and the sending side; or its begin or end (`event`)."""

    link: int
    side: Side
    event: str = ""


_Wire: TypeAlias = tuple[float, bytes, WireDirection]
_Other: TypeAlias = tuple[float, int, State | Event]
Entry: TypeAlias = _Wire | _Other
"""A stored entry: its time, its cost (or bytes), and its content; `RecorderRing.contents` sorts entries by kind."""


@dataclass(frozen=True, slots=True)
class RingContents:
    """The content of a ring, oldest first; `dropped` is whether older entries were dropped, `whole` its start [s]."""

    states: tuple[State, ...]
    events: tuple[Event, ...]
    wire: tuple[WirePiece, ...]
    dropped: bool
    whole: float


class RecorderRing:
    """Holds the newest entries: at most `seconds` of the loop's time and `most_bytes` bytes, both above 0.

    Old entries are removed when a state or an event comes: a piece of the wire must cost next to nothing.
    """

    __slots__ = ("_began", "_bytes", "_dropped", "_entries", "_most", "_oldest", "_overdue", "_seconds", "_time")

    def __init__(self, seconds: float, most_bytes: int) -> None:
        self._time = asyncio.get_running_loop().time
        self._began = self._time()
        self._seconds = seconds
        self._most = most_bytes
        self._entries: deque[Entry] = deque()
        self._bytes = 0
        self._oldest = self._began
        self._overdue = seconds + seconds / _SHARE
        self._dropped = False

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def size(self) -> int:
        """Bytes counted for all entries."""
        return self._bytes

    def piece(self, way: WireDirection, data: bytes = b"") -> None:
        """Store a piece of the wire at the present time."""
        self._entries.append((self._time(), data, way))
        self._bytes += len(data) + WIRE_COST
        if self._bytes > self._most:
            self._drop(self._time())

    def state(self, state: State) -> None:
        """Store a state."""
        self._keep(state.time, STATE_COST, state)

    def event(self, event: Event) -> None:
        """Store an event."""
        self._keep(event.time, EVENT_COST, event)

    def states_since(self, begin: float) -> list[State]:
        """Return the states from the loop time `begin` on [s], oldest first."""
        found: list[State] = []
        for time, _, thing in reversed(self._entries):
            if time < begin:
                break
            if isinstance(thing, State):
                found.append(thing)
        return found[::-1]

    @property
    def oldest(self) -> float:
        """The loop time from which on nothing is missing [s]."""
        return self._entries[0][0] if self._dropped and self._entries else self._began

    def entries(self) -> list[Entry]:
        """Return the present entries, for `contents` to sort later."""
        return list(self._entries)

    def contents(self, entries: Iterable[Entry] | None = None) -> RingContents:
        """Return the present entries, or earlier `entries` of this ring, by kind; may be called in another thread."""
        held = self.entries() if entries is None else list(entries)
        states: list[State] = []
        events: list[Event] = []
        wire: list[WirePiece] = []
        for entry in held:
            time, _, thing = entry
            if isinstance(thing, WireDirection):
                wire.append(WirePiece(time, thing.link, thing.side, _data(entry), thing.event))
            elif isinstance(thing, State):
                states.append(thing)
            else:
                events.append(thing)
        whole = held[0][0] if self._dropped and held else self._began
        return RingContents(tuple(states), tuple(events), tuple(wire), self._dropped, whole)

    def _keep(self, time: float, cost: int, value: State | Event) -> None:
        self._entries.append((time, cost, value))
        self._bytes += cost
        if self._bytes > self._most or time - self._oldest > self._overdue:
            self._drop(time)

    def _drop(self, now: float) -> None:
        """Drop entries that are too old or too many, and a few more.

        Every entry is dropped here, at half of its whole cost. So the loop does no lookups or calls per entry.
        """
        entries, held, before = self._entries, self._bytes, len(self._entries)
        enough = self._most - self._most // _SHARE if held > self._most else self._most
        oldest = now - self._seconds
        while held > enough or (entries and entries[0][0] < oldest):
            cost = entries.popleft()[1]
            held -= cost if isinstance(cost, int) else len(cost) + WIRE_COST
        self._bytes = held
        self._dropped = self._dropped or len(entries) < before
        self._oldest = entries[0][0] if entries else now


def _data(entry: Entry) -> bytes:
    held = entry[1]
    return held if isinstance(held, bytes) else b""


class PieceSink(Protocol):
    """A consumer of pieces of the wire."""

    def __call__(self, way: WireDirection, data: bytes = b"") -> None:
        """Store a piece at the present time; without data, that the connection begins or ends."""
        ...


class RecordedTransport:
    """A transport whose bytes, begin and end go to `note` as connection number `link`."""

    __slots__ = ("_ended", "_inner", "_link", "_note", "_received", "_sent")

    def __init__(self, inner: Transport, note: PieceSink, link: int) -> None:
        self._inner = inner
        self._note = note
        self._link = link
        self._sent, self._received = WireDirection(link, "client"), WireDirection(link, "controller")
        self._ended = False
        note(WireDirection(link, "client", "open"))

    @property
    def peer(self) -> str:
        """The peer of this transport, for display."""
        return self._inner.peer

    async def read(self) -> bytes:
        """Return received data, or `b""` at the end; raises as the transport itself."""
        try:
            data = await self._inner.read()
        except MachineError:
            self._end("controller")
            raise
        if data:
            self._note(self._received, data)
        else:
            self._end("controller")
        return data

    def write(self, data: bytes) -> None:
        """Send bytes at once; raises as the transport itself."""
        self._note(self._sent, data)
        self._inner.write(data)

    async def close(self) -> None:
        """Close the connection; closing it again is harmless."""
        self._end("client")
        await self._inner.close()

    def _end(self, side: Side) -> None:
        if not self._ended:
            self._ended = True
            self._note(WireDirection(self._link, side, "end"))
