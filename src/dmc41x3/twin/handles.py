"""The eight Ethernet handles A to H: who is connected, by which protocol, and who opened it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol

from dmc41x3.language.hardware import LETTERS
from dmc41x3.wire.framing import LineSplitter

COUNT = 8

DEFAULT_PORT = 1000
"""Where IH names no port: handle A dials this one, B the next."""

ALLOWED_BELOW = frozenset({0, 23, 68, 502})
"""Ports below 1000 that IK 1 leaves open."""

FIRST_FREE_PORT = 1000
"""IK 1 blocks ports below this."""


class HandleProtocol(IntEnum):
    """Protocol of a handle; the value is what `_IHx2` says of one that the other side opened."""

    UDP = 1
    TCP = 2


class Attempt(IntEnum):
    """What `_IHx4` says of a handle that this controller opened: what the other side last answered."""

    WAITING = 1
    ACCEPTED = 2
    REFUSED = 3
    FAILED = 4


TCP_SLAVE = int(HandleProtocol.TCP)
"""What `_IHx2` and the data record say of a TCP connection that the other side opened; 0 is a free handle."""

_CONNECTING = {HandleProtocol.UDP: -5, HandleProtocol.TCP: -6}


class Download(Protocol):
    """Takes what a handle sends after DL or QD, line by line, until the backslash.

    Both methods raise `Rejection`; the line then answers `?` and the download goes on.
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

    `port` is the controller's own. A `master` handle was opened by this controller (IH) and is `connected` once the
    other side answers. While `download` is set, what comes is its data and no command.
    """

    index: int
    peer: tuple[str, int]
    kind: HandleProtocol = HandleProtocol.TCP
    port: int = 23
    master: bool = False
    connected: bool = True
    attempt: Attempt = Attempt.WAITING
    splitter: LineSplitter = field(default_factory=LineSplitter)
    open: bool = True
    download: Download | None = None

    @property
    def letter(self) -> str:
        """Its name."""
        return LETTERS[self.index]

    @property
    def state(self) -> int:
        """What `_IHx2` and the data record say of it (IH: 1, 2 opened by the other side, negative by this one)."""
        if not self.master:
            return int(self.kind)
        return -int(self.kind) if self.connected else _CONNECTING[self.kind]


class Handles:
    """Who is connected. `blocking` is IK: whether connections to ports below 1000 are refused."""

    def __init__(self) -> None:
        self._places: list[Handle | None] = [None] * COUNT
        self._dialing: list[Handle] = []
        self.last_lost = -1
        self.blocking = True
        self.on_close: Callable[[Handle], None] | None = None

    def __iter__(self) -> Iterator[Handle | None]:
        return iter(self._places)

    @property
    def free(self) -> int:
        """How many handles are free (`_IA2`)."""
        return self._places.count(None)

    def connect(
        self, peer: tuple[str, int], kind: HandleProtocol = HandleProtocol.TCP, port: int = 23
    ) -> Handle | None:
        """Give the first free handle to a new connection to `port`; None where there is none or IK blocks the port."""
        if self.blocking and port < FIRST_FREE_PORT and port not in ALLOWED_BELOW:
            return None
        for index, place in enumerate(self._places):
            if place is None:
                handle = Handle(index, peer, kind, port)
                self._places[index] = handle
                return handle
        return None

    def dial(self, letter: str, peer: tuple[str, int], kind: HandleProtocol) -> Handle:
        """Take a free handle for a connection that this controller opens; whoever owns the wire makes it."""
        index = LETTERS.index(letter)
        assert self._places[index] is None
        handle = Handle(index, peer, kind, DEFAULT_PORT + index, master=True, connected=False)
        self._places[index] = handle
        self._dialing.append(handle)
        return handle

    def take_dialing(self) -> list[Handle]:
        """Return the connections to be opened, and forget them."""
        dialing, self._dialing = self._dialing, []
        return dialing

    def at(self, letter: str) -> Handle | None:
        """Return the connection on a handle."""
        return self._places[LETTERS.index(letter)]

    def swap(self, first: int, second: int) -> None:
        """Let two handles, by place, change their connections (HS)."""
        places = self._places
        places[first], places[second] = places[second], places[first]
        for index in (first, second):
            handle = places[index]
            if handle is not None:
                handle.index = index

    def close(self, handle: Handle) -> None:
        """Give a handle back; again is harmless."""
        if handle.open:
            handle.open = False
            self._places[handle.index] = None
            self.last_lost = handle.index
            if self.on_close is not None:
                self.on_close(handle)

    def reset(self) -> None:
        """Close all handles and forget the last one lost, as power-up does."""
        for handle in list(self._places):
            if handle is not None:
                self.close(handle)
        self._dialing = []
        self.last_lost = -1

    def states(self) -> tuple[int, ...]:
        """Return the state of every handle as the data record has it."""
        return tuple(0 if place is None else place.state for place in self._places)
