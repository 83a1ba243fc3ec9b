"""The eight Ethernet handles A to H."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Protocol

from maya_un.galil.framing import LineSplitter
from maya_un.virtual.axis import LETTERS

COUNT = 8
TCP_SLAVE = 2
"""What `_IHx2` and the data record say of a TCP connection that the other side opened; 0 is a free handle."""


class Download(Protocol):
    """Takes what a handle sends after DL or QD, line by line, until the backslash.

    Both methods raise `Refused`; the line then answers `?` and the download goes on.
    """

    def line(self, text: str) -> None:
        """Take one line, without its end."""
        ...

    def end(self) -> None:
        """Take the end."""
        ...


@dataclass(slots=True, eq=False)
class Handle:
    """One connection: its place (0 for A), who is at the other end, and the bytes of a command not yet complete.

    While `download` is set, what comes is its data and no command.
    """

    index: int
    peer: tuple[str, int]
    splitter: LineSplitter = field(default_factory=LineSplitter)
    open: bool = True
    download: Download | None = None

    @property
    def letter(self) -> str:
        """Its name."""
        return LETTERS[self.index]


class Handles:
    """Who is connected."""

    def __init__(self) -> None:
        self._places: list[Handle | None] = [None] * COUNT
        self.last_lost = -1

    def __iter__(self) -> Iterator[Handle | None]:
        return iter(self._places)

    @property
    def free(self) -> int:
        """How many handles are free (`_IA2`)."""
        return self._places.count(None)

    def connect(self, peer: tuple[str, int]) -> Handle | None:
        """Give the first free handle to a new connection, None where there is none."""
        for index, place in enumerate(self._places):
            if place is None:
                handle = Handle(index, peer)
                self._places[index] = handle
                return handle
        return None

    def at(self, letter: str) -> Handle | None:
        """Return the connection on a handle."""
        return self._places[LETTERS.index(letter)]

    def close(self, handle: Handle) -> None:
        """Give a handle back; again is harmless."""
        if handle.open:
            handle.open = False
            self._places[handle.index] = None
            self.last_lost = handle.index

    def states(self) -> tuple[int, ...]:
        """Return the state of every handle as the data record has it."""
        return tuple(0 if place is None else TCP_SLAVE for place in self._places)
