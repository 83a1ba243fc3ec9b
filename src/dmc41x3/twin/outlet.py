"""Where bytes go that nobody asked for: messages of programs, by CF and CW, and whatever else a handle is sent."""

from __future__ import annotations

from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.handles import Handle, Handles

SERIAL = "ST"
"""Ports of CF that are no handle: the main serial port and the auxiliary one. Nothing is plugged in there."""

_REMEMBERED = 8


class OutputBuffer:
    """Collects what is to be sent; whoever owns the wire takes it with `take`.

    `mark` is CW: 1 sets bit 7 of each byte. `discarding` is its second number, which concerns a serial port only.
    """

    def __init__(self, handles: Handles) -> None:
        self._handles = handles
        self._waiting: list[tuple[Handle, bytes]] = []
        self._ports = ["S"]
        self.mark = 2
        self.discarding = 1

    @property
    def port(self) -> str:
        """Where CF sends messages: a handle's letter, or a serial port."""
        return self._ports[-1]

    @port.setter
    def port(self, name: str) -> None:
        if name != self._ports[-1]:
            self._ports = [*self._ports[-_REMEMBERED:], name]

    def closed(self, letter: str) -> None:
        """Take notice that a handle was closed: messages to it go where CF sent them before.

        The manual leaves open where; a port before that is a closed handle is passed over, the last resort is S.
        """
        if self.port != letter:
            return
        self._ports = [port for port in self._ports if port in SERIAL or self._handles.at(port) is not None] or ["S"]

    def reset(self) -> None:
        """Set what power-up sets; what was not taken yet is still sent."""
        self._ports, self.mark, self.discarding = ["S"], 2, 1

    def put(self, handle: Handle, data: bytes) -> None:
        """Send bytes to a handle as they are."""
        self._waiting.append((handle, data))

    def say(self, data: bytes, port: str = "") -> bool:
        """Send a message to a port, that of CF unless another is named; tell whether there is such a port open."""
        port = port or self.port
        if port in SERIAL:
            return True
        handle = self._handles.at(port) if port in LETTERS else None
        if handle is None:
            return False
        self.put(handle, bytes(byte | 0x80 for byte in data) if self.mark == 1 else data)
        return True

    def take(self) -> list[tuple[Handle, bytes]]:
        """Return what is to be sent, in order, and forget it."""
        waiting, self._waiting = self._waiting, []
        return waiting
