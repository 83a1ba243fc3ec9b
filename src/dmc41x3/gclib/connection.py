"""The sockets of one connection: a TCP one for commands, a UDP one for what comes unasked. Blocking, no thread."""

from __future__ import annotations

import re
import select
import socket
from collections import deque

from dmc41x3.errors import ConnectFailed, LinkLost, LinkTimeout, UnexpectedReply
from dmc41x3.gclib.options import AddressOptions
from dmc41x3.wire.framing import Message, RecordReply, Reply, ReplyKind, ReplySplitter, Stray

_LETTER = re.compile(rb"IH([A-H])\r\n:")
_SEVEN_BITS = bytes(code & 0x7F for code in range(256))
_LARGEST = 65536
_HELLO = 0.25
"""Longest wait for the controller's first answer by UDP [s]; it is asked three times."""

_INTERRUPT, _RECORD = 0x01, 0x80
_MOST_RECORDS = 64


class Commands:
    """The command socket. `timeout` [s] is for each single wait for bytes; `said` keeps messages of programs."""

    def __init__(self, options: AddressOptions) -> None:
        self._address = f"{options.host}:{options.port}"
        self._splitter = ReplySplitter()
        self.timeout = options.timeout / 1000.0
        self.said: list[str] = []
        self._heard = False
        try:
            self._socket = socket.create_connection((options.host, options.port), max(self.timeout, _HELLO))
        except (OSError, UnicodeError) as error:
            raise ConnectFailed(address=self._address, reason=str(error)) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def ask(self, data: bytes, kind: ReplyKind = ReplyKind.TEXT) -> Reply | RecordReply:
        """Send one request and return its answer; raises `LinkTimeout`, `LinkLost`, `UnexpectedReply`."""
        self._splitter.expect(kind)
        command = data.partition(b"\r")[0].decode("ascii", "replace")
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._ended(str(error)) from error
        while True:
            answer = self._sort(self._receive(self.timeout, command), command)
            if answer is not None:
                return answer

    def listen(self, timeout: float) -> None:
        """Wait so long [s] for a message, if none is there yet."""
        if not self.said and select.select([self._socket], [], [], timeout)[0]:
            self._sort(self._receive(self.timeout, ""), "")

    def close(self) -> None:
        """End the connection; again is harmless."""
        self._socket.close()

    def _receive(self, timeout: float, command: str) -> bytes:
        self._socket.settimeout(max(timeout, _HELLO))
        try:
            data = self._socket.recv(_LARGEST)
        except TimeoutError as error:
            raise LinkTimeout(address=self._address, command=command, seconds=f"{timeout:g}") from error
        except OSError as error:
            raise self._ended(str(error)) from error
        if not data:
            raise self._ended("the controller ended the connection")
        self._heard = True
        return data

    def _ended(self, reason: str) -> LinkLost | ConnectFailed:
        """Return the loss of a link; of one over which nothing was heard nobody was there."""
        return (LinkLost if self._heard else ConnectFailed)(address=self._address, reason=reason)

    def _sort(self, data: bytes, command: str) -> Reply | RecordReply | None:
        """Keep messages; return the answer, which is one at most, since nothing is asked before the last is in."""
        answer: Reply | RecordReply | None = None
        for received in self._splitter.feed(data):
            if isinstance(received, Message):
                self.said.append(f"{received.text}\r\n")
            elif isinstance(received, Stray):
                raise UnexpectedReply(command=command, reply=received.data[:40].decode("latin-1"))
            else:
                answer = received
        return answer


class Unsolicited:
    """The UDP socket, sorted: text (bit 7 set), data records, interrupts.

    An interrupt's datagram is 0x01, the status bytes, and 0x16 (DMC-40x0 user manual, EI; not seen on a DMC-41x3).
    """

    def __init__(self, host: str, port: int) -> None:
        """Open it and learn its handle; raises `OSError` where the controller does not answer by UDP."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.said: list[str] = []
        self.records: deque[bytes] = deque(maxlen=_MOST_RECORDS)
        self.interrupts: deque[int] = deque()
        try:
            self._socket.connect((host, port))
            self.letter = self._hello()
        except OSError:
            self._socket.close()
            raise

    def drain(self) -> None:
        """Sort whatever has come."""
        while select.select([self._socket], [], [], 0.0)[0]:
            self.listen(0.0)

    def listen(self, timeout: float) -> None:
        """Wait so long [s] for one datagram and sort it."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return
        try:
            data = self._socket.recv(_LARGEST)
        except OSError:
            return  # the port was found closed just now; a controller may come back
        if data[:1] == bytes([_INTERRUPT]):
            self.interrupts.extend(data[1:-1])
        elif data and data[0] & _RECORD and len(data) == int.from_bytes(data[2:4], "little"):
            self.records.append(data)
        elif data:
            self.said.append(data.translate(_SEVEN_BITS).decode("ascii"))

    def close(self) -> None:
        """Close the socket; the handle is the controller's and has to be closed by a command."""
        self._socket.close()

    def _hello(self) -> str:
        self._socket.settimeout(_HELLO)
        for _ in range(3):
            self._socket.send(b"WH\r")
            try:
                found = _LETTER.search(self._socket.recv(_LARGEST))
            except TimeoutError:
                continue
            if found is not None:
                return found[1].decode("ascii")
        self._socket.send(b"IHS=>-1\r")
        raise TimeoutError("no answer by UDP")
