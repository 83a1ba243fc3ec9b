"""The last minutes in memory: states, events and pieces of the wire, bounded by bytes and by time.

Values are kept as they came, by reference; nothing is copied or encoded before somebody saves them. The cost of an
entry is the number of bytes that it holds, and a fixed share for the objects around them.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from dmc41x3.wire.transcript import Side, WirePiece
from maya_un.events import Event
from maya_un.values import State

WIRE_COST = 192
"""Bytes of memory counted for a piece of the wire beside its data: the entry, the time, the bytes object."""

STATE_COST = 1_536
"""Bytes of memory counted for a state with its tuples."""

EVENT_COST = 1_024
"""Bytes of memory counted for an event with its details."""

_SHARE = 64
"""A full ring drops a 64th part of its bounds at once, so that dropping costs next to nothing for each entry."""


class WireDirection(NamedTuple):
    """The place of a piece of the wire: the connection and the side it comes from; or its begin or end (`event`)."""

    link: int
    side: Side
    event: str = ""


_Wire: TypeAlias = tuple[float, bytes, WireDirection]
_Other: TypeAlias = tuple[float, int, State | Event]
Entry: TypeAlias = _Wire | _Other
"""An entry as it is held: when, what it costs, and what it is; `RecorderRing.contents` sorts them out."""


@dataclass(frozen=True, slots=True)
class RingContents:
    """The content of a ring, oldest first; `dropped` tells whether more came before it, `whole` from when on [s]."""

    states: tuple[State, ...]
    events: tuple[Event, ...]
    wire: tuple[WirePiece, ...]
    dropped: bool
    whole: float


class RecorderRing:
    """Keeps the newest entries: at most so many `seconds` of the loop's time and so many bytes, both above 0.

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
        """Bytes counted for everything in it."""
        return self._bytes

    def piece(self, way: WireDirection, data: bytes = b"") -> None:
        """Keep what passes now."""
        self._entries.append((self._time(), data, way))
        self._bytes += len(data) + WIRE_COST
        if self._bytes > self._most:
            self._drop(self._time())

    def state(self, state: State) -> None:
        """Keep a state."""
        self._keep(state.time, STATE_COST, state)

    def event(self, event: Event) -> None:
        """Keep an event."""
        self._keep(event.time, EVENT_COST, event)

    def entries(self) -> list[Entry]:
        """Return what it holds now, for `contents` to sort out when there is time."""
        return list(self._entries)

    def contents(self, entries: Iterable[Entry] | None = None) -> RingContents:
        """Return what it holds, or `entries` that it held before, by kind; may be called in another thread."""
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
        """Let go of what is too old or too much, and a little more.

        Every entry goes this way, at half of what it costs at all: nothing is looked up or called for each.
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
