"""Stop the axes by a separate plain connection, when the service that owns the robot does not answer.

The module blocks, uses no event loop, and is quick to import, because the time until the axes brake is essential. By
TCP it uses one free handle of the controller and frees it. A serial port is used even if another program has locked it.
"""

from __future__ import annotations

import socket
import struct
from typing import NamedTuple, Protocol

from dmc41x3.address import ControllerAddress, NetworkAddress, SerialAddress
from dmc41x3.errors import ConnectFailed, LinkTimeout, MachineError, UnexpectedReply, ended
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

    def joined(self, other: StopOutcome) -> StopOutcome:
        """Return the axes of either outcome."""
        pairs = zip(self, other, strict=True)
        return StopOutcome(*("".join(sorted({*one, *another})) for one, another in pairs))


def stop(address: ControllerAddress, timeout: float) -> StopOutcome:
    """Stop the coordinated sequence on its path (`ST S`), then each axis that moves outside of it.

    A bare ST would also end the programs in the controller. `timeout` [s] applies to each wait, on a serial port to
    all of its attempts. Raises `ConnectFailed`, `LinkTimeout`, `LinkLost`, `UnexpectedReply`.
    """
    if isinstance(address, SerialAddress):
        return _stop_by_serial(address, timeout)
    return _stop_by_tcp(address, timeout)


class _Channel(Protocol):
    """A connection: a socket, or a serial port. Both methods raise `OSError`."""

    def sendall(self, data: bytes, /) -> None:
        """Send bytes."""
        ...

    def recv(self, count: int, /) -> bytes:
        """Return at most so many bytes, b"" at the end."""
        ...


def _stop_by_tcp(address: NetworkAddress, timeout: float) -> StopOutcome:
    try:
        connection = socket.create_connection(address, timeout)
    except (OSError, UnicodeError, OverflowError) as error:
        raise ConnectFailed(address=str(address), reason=str(error)) from error
    with connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return _Conversation(connection, str(address), timeout).stop()


_ATTEMPTS = (0.125, 0.25, 0.625)
"""Parts of the time of a stop by a serial port. After each, the stop is sent again.

Another program that uses the port may have taken the answer. It then finds its own link garbled and ends it. The last
part is the longest, because a slow port needs more time for an answer."""

_MOST_UNASKED = 4096
"""Most bytes in a serial port before the answer to the greeting."""


def _stop_by_serial(address: SerialAddress, timeout: float) -> StopOutcome:
    """Send the stop until an attempt is answered."""
    from dmc41x3.wire.serial_port import BlockingPort  # noqa: PLC0415 - only serial addresses need it

    port = BlockingPort(address, timeout, exclusive=False)
    failure: MachineError | None = None
    before = StopOutcome("", "")
    try:
        for part in _ATTEMPTS:
            port.settimeout(part * timeout)
            conversation = _Conversation(port, str(address), timeout)
            try:
                return before.joined(conversation.stop_after_greeting())
            except (LinkTimeout, UnexpectedReply) as error:
                failure, before = error, before.joined(conversation.outcome)
        assert failure is not None
        raise failure
    finally:
        port.close()


class _Conversation:
    """The few requests of a stop; the first two are in one packet. `outcome` holds the axes once they are known."""

    def __init__(self, channel: _Channel, address: str, timeout: float) -> None:
        self._channel = channel
        self._address = address
        self._timeout = timeout
        self._command = ""
        self._heard = False
        self.outcome = StopOutcome("", "")

    def stop(self) -> StopOutcome:
        self._say("ST S", "QR")  # in one packet: a slow motion is at rest a few milliseconds after ST
        self._prompt()
        return self._stop_others()

    def stop_after_greeting(self) -> StopOutcome:
        """Stop by a serial port, whose controller may echo and be within a line of another program."""
        from dmc41x3.wire.serial_port import Greeting  # noqa: PLC0415 - only serial addresses need it

        greeting = Greeting("ST S")
        self._command = "ST S"
        self._send(greeting.data + b"QR\r")
        for _ in range(_MOST_UNASKED):
            if greeting.feed(self._exactly(1)):
                return self._stop_others()
        raise UnexpectedReply(command=self._command, reply="…")

    def _stop_others(self) -> StopOutcome:
        """Read the record, and stop the axes that move outside of a sequence."""
        self._command = "QR"
        moving, coordinated = _motion(self._record())
        self.outcome = StopOutcome(
            coordinated="".join(axis for axis in moving if axis in coordinated),
            independent="".join(axis for axis in moving if axis not in coordinated),
        )
        if self.outcome.independent:
            self._say(f"ST {self.outcome.independent}")
            if not self._prompt():
                raise UnexpectedReply(command=self._command, reply="?")
        return self.outcome

    def _say(self, *commands: str) -> None:
        self._command = commands[0]
        self._send("".join(f"{command}\r" for command in commands).encode())

    def _send(self, data: bytes) -> None:
        try:
            self._channel.sendall(data)
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
                piece = self._channel.recv(count - len(data))
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

    def _ended(self, reason: str) -> MachineError:
        return ended(self._address, reason, heard=self._heard)


def _motion(record: bytes) -> tuple[str, str]:
    """Return the letters of the axes that move, and of those that take part in a sequence."""
    moving = coordinated = ""
    for letter, place in zip(LETTERS, range(_FIRST_AXIS, len(record), _AXIS_BYTES), strict=False):
        (status,) = struct.unpack_from("<H", record, place)
        moving += letter if status & _MOVING else ""
        coordinated += letter if status & _COORDINATED else ""
    return moving, coordinated
