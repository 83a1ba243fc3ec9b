"""A recording in memory: its header, and everything in it in order."""

from __future__ import annotations

from dataclasses import dataclass

from dmc41x3.wire.transcript import WirePiece
from maya_un.events import Event
from maya_un.recorder.header import Header
from maya_un.values import State


@dataclass(frozen=True, slots=True)
class Recording:
    """States, events and pieces of the wire, each in order; times are of the loop's clock [s].

    Of a piece, the client is this program; connections are numbered from 1, ways for datagrams with negative numbers.
    """

    header: Header
    states: tuple[State, ...] = ()
    events: tuple[Event, ...] = ()
    wire: tuple[WirePiece, ...] = ()

    @property
    def span(self) -> tuple[float, float]:
        """Loop times of the first and the last thing from where it is whole on [s]; `saved` where it is empty."""
        whole = self.header.whole
        times = [
            thing.time for things in (self.states, self.events, self.wire) for thing in things if thing.time >= whole
        ]
        return (min(times), max(times)) if times else (self.header.saved, self.header.saved)
