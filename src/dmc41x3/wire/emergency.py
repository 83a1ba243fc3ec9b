"""Stop the axes by a separate plain socket, when the service that owns the robot does not answer.

The module blocks, uses no event loop, and is quick to import, because the time until the axes brake is essential. It
uses one free handle of the controller and frees it.
"""

from __future__ import annotations

import socket
import struct
from typing import NamedTuple

from dmc41x3.errors import ConnectFailed, LinkLost, LinkTimeout, MachineError, UnexpectedReply
from dmc41x3.i18n import phrase
from dmc41x3.language.hardware import LETTERS

_FIRST_AXIS, _AXIS_BYTES = 82, 36
_SHORTEST, _LONGEST = _FIRST_AXIS, _FIRST_AXIS + 8 * _AXIS_BYTES
_MOVING, _COORDINATED = 1 << 15, 1 << 8


class StopOutcome(NamedTuple):
    """The axes that moved at the stop: those of the sequence, which brake on their path, and independent axes."""

    coordinated: str
    independent: str

    @property
    def decelerating(self) -> str:
        """Letters of all axes that began to brake, in order; empty if nothing moved."""
        return "".join(sorted(self.coordinated + self.independent))


def stop(host: str, port: int, timeout: float) -> StopOutcome:
    """Stop the coordinated sequence on its path (`ST S`), then each axis that moves outside of it.

    A bare ST would also end the programs in the controller. `timeout` [s] applies to each wait. Raises
    `ConnectFailed`, `LinkTimeout`, `LinkLost`, `UnexpectedReply`.
    """
    address = f"{host}:{port}"
    try:
        connection = socket.create_connection((host, port), timeout)
    except (OSError, UnicodeError, OverflowError) as error:
        raise ConnectFailed(address=address, reason=str(error)) from error
    with connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return _Conversation(connection, address, timeout).stop()


class _Conversation:
    """The few requests of a stop; the first two are in one packet."""

    def __init__(self, connection: socket.socket, address: str, timeout: float) -> None:
        self._connection = connection
        self._address = address
        self._timeout = timeout
        self._command = ""
        self._heard = False

    def stop(self) -> StopOutcome:
        self._say("ST S", "QR")  # in one packet: a slow motion is at rest a few milliseconds after ST
        self._prompt()
        self._command = "QR"
        moving, coordinated = _motion(self._record())
        outcome = StopOutcome(
            coordinated="".join(axis for axis in moving if axis in coordinated),
            independent="".join(axis for axis in moving if axis not in coordinated),
        )
        if outcome.independent:
            self._say(f"ST {outcome.independent}")
            if not self._prompt():
                raise UnexpectedReply(command=self._command, reply="?")
        return outcome

    def _say(self, *commands: str) -> None:
        self._command = commands[0]
        try:
            self._connection.sendall("".join(f"{command}\r" for command in commands).encode())
        except OSError as error:
            raise self._failure(error) from error

    def _prompt(self) -> bool:
        """Return whether a command without output was accepted; a refused ST S means that no sequence runs."""
        answer = self._reply_byte()
        if answer not in b":?":
            raise UnexpectedReply(command=self._command, reply=repr(answer))
        return answer == b":"

    def _record(self) -> bytes:
        header = self._reply_byte()
        if header[0] & 0x78:
            raise UnexpectedReply(command=self._command, reply=repr(header))
        header += self._exactly(3)
        (length,) = struct.unpack_from("<H", header, 2)
        if not _SHORTEST <= length <= _LONGEST:
            raise UnexpectedReply(command=self._command, reply=header.hex(" "))
        return header + self._exactly(length + 1 - len(header))[:-1]

    def _reply_byte(self) -> bytes:
        """Return the first byte of a reply; messages of programs, marked by bit 7, are skipped."""
        while (byte := self._exactly(1)) > b"\x87":
            pass
        return byte

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            try:
                piece = self._connection.recv(count - len(data))
            except OSError as error:
                raise self._failure(error) from error
            if not piece:
                raise self._ended(phrase("the controller ended the connection"))
            data += piece
            self._heard = True
        return data

    def _failure(self, error: OSError) -> MachineError:
        if isinstance(error, TimeoutError):
            return LinkTimeout(address=self._address, command=self._command, seconds=f"{self._timeout:g}")
        return self._ended(error.strerror or str(error))

    def _ended(self, reason: str) -> LinkLost | ConnectFailed:
        """Return the error of an ended link: `LinkLost`, or `ConnectFailed` if the controller never sent anything."""
        return (LinkLost if self._heard else ConnectFailed)(address=self._address, reason=reason)


def _motion(record: bytes) -> tuple[str, str]:
    """Return the letters of the axes that move, and of those that take part in a sequence."""
    moving = coordinated = ""
    for letter, place in zip(LETTERS, range(_FIRST_AXIS, len(record), _AXIS_BYTES), strict=False):
        (status,) = struct.unpack_from("<H", record, place)
        moving += letter if status & _MOVING else ""
        coordinated += letter if status & _COORDINATED else ""
    return moving, coordinated
