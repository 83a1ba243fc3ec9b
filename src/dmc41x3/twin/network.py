"""The controller on its network: Ethernet handles, addresses, unsolicited output, and data records sent by DR."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from ipaddress import IPv4Address
from math import inf
from typing import Protocol, TypeAlias

from dmc41x3.language.hardware import LETTERS
from dmc41x3.wire.framing import LineSplitter

COUNT = 8

SERIAL = "ST"
"""Ports of CF that are not handles: the main serial port and the auxiliary one, to which nothing is connected."""

NO_HANDLE = -1
"""Place of the serial port in `_WH` and `_IA3`."""

DEFAULT_PORT = 1000
"""Port if IH names none: handle A uses this one, B the next."""

ALLOWED_BELOW = frozenset({0, 23, 68, 502})
"""Ports below 1000 that IK 1 leaves open."""

FIRST_FREE_PORT = 1000
"""IK 1 blocks ports below this."""


class HandleProtocol(IntEnum):
    """Protocol of a handle; the value is that of `_IHx2` for a handle that the other side opened.

    The serial port is no handle of Ethernet: it occupies none of the eight, and no command closes it.
    """

    SERIAL = 0
    UDP = 1
    TCP = 2


class Attempt(IntEnum):
    """`_IHx4` of a handle that this controller opened: the last answer of the other side."""

    WAITING = 1
    ACCEPTED = 2
    REFUSED = 3
    FAILED = 4


_CONNECTING = {HandleProtocol.UDP: -5, HandleProtocol.TCP: -6}


class Download(Protocol):
    """Receives the data after DL or QD, line by line, until the backslash.

    Both methods raise `Rejection`; the answer is then `?`, and after `line` the download continues.
    """

    def line(self, text: str) -> None:
        """Receive one line, without its end."""
        ...

    def end(self) -> None:
        """End the download."""
        ...


@dataclass(slots=True, eq=False)
class Handle:
    """One connection: its place (0 for A), its peer, and the bytes of an incomplete command.

    `port` is the controller's port. A `master` handle was opened by this controller (IH) and is `connected` once the
    other side answers. While `download` is set, received bytes are its data and not commands.
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
        """Letter of the handle, S for the serial port."""
        return SERIAL[0] if self.kind is HandleProtocol.SERIAL else LETTERS[self.index]

    @property
    def state(self) -> int:
        """Value of `_IHx2` and of the data record (IH: 1, 2 opened by the other side, negative by this one)."""
        if not self.master:
            return int(self.kind)
        return -int(self.kind) if self.connected else _CONNECTING[self.kind]


class Handles:
    """The connections. `blocking` is IK: whether connections to ports below 1000 are refused.

    `serial` is the main serial port while a cable is connected to it; it is not one of the handles.
    """

    def __init__(self) -> None:
        self._places: list[Handle | None] = [None] * COUNT
        self._dialing: list[Handle] = []
        self.last_lost = -1
        self.blocking = True
        self.serial: Handle | None = None
        self.on_close: Callable[[Handle], None] | None = None

    def __iter__(self) -> Iterator[Handle | None]:
        return iter(self._places)

    @property
    def free(self) -> int:
        """Number of free handles (`_IA2`)."""
        return self._places.count(None)

    def connect(
        self, peer: tuple[str, int], kind: HandleProtocol = HandleProtocol.TCP, port: int = 23
    ) -> Handle | None:
        """Assign the first free handle to a new connection to `port`; None if none is free or IK blocks the port."""
        if self.blocking and port < FIRST_FREE_PORT and port not in ALLOWED_BELOW:
            return None
        for index, place in enumerate(self._places):
            if place is None:
                handle = Handle(index, peer, kind, port)
                self._places[index] = handle
                return handle
        return None

    def plug(self) -> Handle:
        """Connect a cable to the main serial port, in place of another one."""
        self.serial = Handle(NO_HANDLE, ("", 0), HandleProtocol.SERIAL, 0)
        return self.serial

    def dial(self, letter: str, peer: tuple[str, int], kind: HandleProtocol) -> Handle:
        """Take the free handle `letter` for a connection that this controller opens; `take_dialing` returns it."""
        index = LETTERS.index(letter)
        assert self._places[index] is None
        handle = Handle(index, peer, kind, DEFAULT_PORT + index, master=True, connected=False)
        self._places[index] = handle
        self._dialing.append(handle)
        return handle

    def take_dialing(self) -> list[Handle]:
        """Return the connections to be opened, and clear their list."""
        dialing, self._dialing = self._dialing, []
        return dialing

    def at(self, letter: str) -> Handle | None:
        """Return the connection on a handle, None if the handle is free."""
        return self._places[LETTERS.index(letter)]

    def swap(self, first: int, second: int) -> None:
        """Exchange the connections of two handles, given by place (HS)."""
        places = self._places
        places[first], places[second] = places[second], places[first]
        for index in (first, second):
            handle = places[index]
            if handle is not None:
                handle.index = index

    def close(self, handle: Handle) -> None:
        """Free a handle; idempotent."""
        if handle.kind is HandleProtocol.SERIAL:
            handle.open = False
            self.serial = None if self.serial is handle else self.serial
        elif handle.open:
            handle.open = False
            self._places[handle.index] = None
            self.last_lost = handle.index
            if self.on_close is not None:
                self.on_close(handle)

    def reset(self) -> None:
        """Close all handles and clear `last_lost`, as power-up does."""
        for handle in list(self._places):
            if handle is not None:
                self.close(handle)
        self._dialing = []
        self.last_lost = -1

    def states(self) -> tuple[int, ...]:
        """Return the state of every handle for the data record."""
        return tuple(0 if place is None else place.state for place in self._places)


_REMEMBERED = 8


class OutputBuffer:
    """Collects the bytes to send; the owner of the connections takes them with `take`.

    `mark` is CW: 1 sets bit 7 of each byte. `discarding` is its second number, which applies to serial ports only.
    """

    def __init__(self, handles: Handles) -> None:
        self._handles = handles
        self._waiting: list[tuple[Handle, bytes]] = []
        self._ports = ["S"]
        self.mark = 2
        self.discarding = 1

    @property
    def port(self) -> str:
        """Target of messages (CF): a handle's letter, or a serial port."""
        return self._ports[-1]

    @port.setter
    def port(self, name: str) -> None:
        if name != self._ports[-1]:
            self._ports = [*self._ports[-_REMEMBERED:], name]

    def closed(self, letter: str) -> None:
        """Handle the end of a handle: messages to it go to the previous port of CF.

        The manual does not specify this. Previous ports that are closed handles are skipped; the last resort is S.
        """
        if self.port != letter:
            return
        self._ports = [port for port in self._ports if port in SERIAL or self._handles.at(port) is not None] or ["S"]

    def reset(self) -> None:
        """Restore the power-up settings; bytes that were not taken yet are still sent."""
        self._ports, self.mark, self.discarding = ["S"], 2, 1

    def put(self, handle: Handle, data: bytes) -> None:
        """Send bytes to a handle as they are."""
        self._waiting.append((handle, data))

    def say(self, data: bytes, port: str = "") -> bool:
        """Send a message to a port, by default that of CF; return whether the port is open."""
        port = port or self.port
        if port in SERIAL and (port != SERIAL[0] or self._handles.serial is None):
            return True
        handle = self._handles.serial if port in SERIAL else self._handles.at(port) if port in LETTERS else None
        if handle is None:
            return False
        self.put(handle, bytes(byte | 0x80 for byte in data) if self.mark == 1 else data)
        return True

    def take(self) -> list[tuple[Handle, bytes]]:
        """Return the bytes to send, in order, and clear them."""
        waiting, self._waiting = self._waiting, []
        return waiting


Quad: TypeAlias = tuple[int, int, int, int]

RETRIES = 5
"""Repetitions of an unanswered TCP packet before the handle is closed (IA)."""


@dataclass(slots=True)
class Network:
    """Registers of IA, DH, MU and SM; `retry` is the time between two attempts [samples]."""

    address: Quad
    retry: int = 250
    dhcp: bool = True
    multicast: Quad = (239, 255, 19, 56)
    mask: Quad = (0, 0, 0, 0)


def number(address: Quad) -> int:
    """Return four bytes as the signed number that operands return."""
    return int.from_bytes(bytes(address), "big", signed=True)


def quad(address: IPv4Address) -> Quad:
    """Return the four bytes of an address."""
    a, b, c, d = address.packed
    return a, b, c, d


class RecordEmitter:
    """The stream of data records, an activity of the machine; `source` encodes the present record.

    `period` [samples] is 0 without a stream. Records due while a program or an array is downloaded, or while
    memory is burned, are left out, as on the controller; the times of the others stay the same.
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
        """Number of the handle that receives the records (`_DR1`), 0 if it is a serial port."""
        target = self._target()
        return 0 if target is None else target.index

    @property
    def active(self) -> bool:
        """Whether a stream is active."""
        return self.period != 0

    @property
    def watching(self) -> bool:
        """False: a stream does not depend on events of axes."""
        return False

    def start(self, period: int, sample: float, handle: Handle | None, now: float) -> None:
        """Send a record every `period` samples of length `sample` [s] to a UDP handle, or to the port of CF (None)."""
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
        # Counted from the previous record, not from now: the stream does not drift.
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
