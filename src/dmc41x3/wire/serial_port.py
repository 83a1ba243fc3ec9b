"""Serial ports with a controller: open one, and greet the controller, which echoes and sends messages unasked.

A controller powers up with EO 1 and CF S: it returns each character, and a program's messages come by this port. The
greeting ends both the echo and every unfinished line or download of an earlier program, and marks messages by bit 7.
Blocks only while a port is opened; imports pyserial when a port is opened.
"""

from __future__ import annotations

import errno
import itertools
import os
import re
import select
import termios
from contextlib import suppress
from typing import TYPE_CHECKING

from dmc41x3.address import SerialAddress, com_port
from dmc41x3.errors import SerialPortUnavailable
from dmc41x3.i18n import phrase

if TYPE_CHECKING:  # pyserial is imported when a port is opened
    from serial import Serial

GROUP = "dialout"
"""Group whose members may use serial ports, if the port does not tell it."""

_BUSY = {errno.EAGAIN, errno.EBUSY}
_MISSING = {errno.ENOENT, errno.ENXIO, errno.ENODEV, errno.EIO}
_MARKED = bytes(range(128, 256))
_count = itertools.count(1)


def open_port(address: SerialAddress, *, exclusive: bool = True) -> Serial:
    """Open a port without waiting: 8 bits, no parity, handshake by RTS and CTS, as a Galil controller needs it.

    An `exclusive` port is refused to programs that lock ports too. Raises `SerialPortUnavailable`.
    """
    from serial import Serial, SerialException  # noqa: PLC0415 - only serial addresses need pyserial

    try:
        return Serial(address.path, address.baud, timeout=0, rtscts=True, exclusive=exclusive or None)
    except SerialException as error:
        raise unavailable(address, error.errno) from error
    except (OSError, ValueError) as error:
        raise unavailable(address, getattr(error, "errno", None)) from error


def close_port(port: Serial) -> None:
    """Close a port; bytes that the kernel has not sent yet are dropped, or it would wait for them."""
    with suppress(OSError, termios.error):
        port.reset_output_buffer()
    port.close()


_EMPTY = 100
"""Number of successive readings without bytes that mean the end of a port; after fewer, another program was faster."""


class BlockingPort:
    """An open port with the methods of a blocking socket. Each wait ends with `TimeoutError` after `timeout` [s]."""

    def __init__(self, address: SerialAddress, timeout: float, *, exclusive: bool = True) -> None:
        """Open a port; raises `SerialPortUnavailable`."""
        self._port = open_port(address, exclusive=exclusive)
        self._file = self._port.fileno()
        self._timeout = timeout

    def fileno(self) -> int:
        """Return the descriptor, for select()."""
        return self._file

    def settimeout(self, timeout: float) -> None:
        """Set the longest wait [s]."""
        self._timeout = timeout

    def sendall(self, data: bytes) -> None:
        """Send bytes; raises `OSError`."""
        while data:
            self._wait((), (self._file,))
            data = data[os.write(self._file, data) :]

    def recv(self, count: int) -> bytes:
        """Return at least one and at most `count` received bytes, b"" after the end; raises `OSError`."""
        for _ in range(_EMPTY):
            self._wait((self._file,), ())
            with suppress(BlockingIOError):
                data = os.read(self._file, count)
                if data:
                    return data
        return b""

    def close(self) -> None:
        """Close the port; idempotent."""
        if self._port.is_open:
            close_port(self._port)

    def _wait(self, reading: tuple[int, ...], writing: tuple[int, ...]) -> None:
        if select.select(reading, writing, (), self._timeout) == ([], [], []):
            raise TimeoutError


def unavailable(address: SerialAddress, number: int | None) -> SerialPortUnavailable:
    """Return the error for the errno with which a port was not opened, None if there was none."""
    if number in {errno.EACCES, errno.EPERM}:
        reason = phrase(
            "this user has no permission. Run `sudo usermod -aG {group} $USER`, then log in again",
            group=_group(address.path),
        )
    elif number in _MISSING:
        reason = _missing(address.path)
    elif number in _BUSY:
        reason = phrase("another program uses it: end that program")
    elif number is None or number == errno.ENOTTY:
        reason = phrase("it is no serial port")
    else:
        reason = os.strerror(number)
    return SerialPortUnavailable(address=str(address), reason=reason)


def _missing(path: str) -> str:
    name = com_port(path)
    if name is None:
        return phrase("there is no such device. Check the cable; `dmc find` lists the ports")
    return phrase(
        "there is no such device. {name} means this port here. Give the path of another port, or set ${variable} to it;"
        " `dmc find` lists the ports",
        name=name,
        variable=f"DMC_{name}",
    )


def _group(path: str) -> str:
    """Return the group that may use a port; `GROUP` if that is root's."""
    from grp import getgrgid  # noqa: PLC0415 - only for this error

    try:
        return getgrgid(number).gr_name if (number := os.stat(path).st_gid) else GROUP  # noqa: PTH116 - no Path here
    except (OSError, KeyError):
        return GROUP


class Greeting:
    """The first exchange with a controller on a serial port; `data` is sent, `feed` recognizes the end of the answer.

    `first` holds commands that are executed before all others.
    """

    def __init__(self, *first: str) -> None:
        number = 1000 * (os.getpid() % 100_000) + next(_count) % 1000
        # The backslash ends a download. The two characters make an unfinished line invalid, which CR would execute.
        commands = ("\\@", *first, "EO 0", "CW 1", "TC 0", f"MG {number - 1}+1{{Z10.0}}")
        self.data = "".join(f"{command}\r" for command in commands).encode("ascii")
        self._end = re.compile(rb"(?<!\d)%d\r\n:" % number)
        self._tail = b""

    def feed(self, data: bytes) -> bool:
        """Return whether `data` completes the answer. Echoes and messages of programs are not taken for the answer."""
        self._tail += data.translate(None, _MARKED)
        done = self._end.search(self._tail) is not None
        self._tail = self._tail[-64:]
        return done
