"""One gclib connection: the address string of GOpen, its sockets, requests and their replies.

The sockets block, and there is no thread: TCP carries commands, UDP carries unsolicited data. A serial port
carries both.

Switches of the address string:

| switch | meaning |
|---|---|
| `HOST`, `HOST:PORT`, `-a`, `--address` | the controller; `:PORT` is an extension, gclib has `--p1` |
| `/dev/ttyUSB0`, `COM1` | a serial port; `COMn` is the port in $DMC_COMn, else /dev/ttyS(n-1) |
| `-d`, `--direct` | without Galil's server gcaps; always the case here |
| `-s`, `--subscribe` `NONE`, `MG`, `DR`, `EI`, `ALL` | messages, data records, interrupts; may be given several times |
| `-t`, `--timeout` MS | longest wait for an answer, 5000 |
| `--p1`, `--p2` PORT | for commands (23), and for unsolicited data (60007; if `--p1` is not 23, the same as `--p1`) |
| `-c`, `--command` `TCP` | transport of commands |
| `-u`, `--unsolicited` `UDP`, `TCP`, `NONE` | transport of unsolicited data |
| `-b`, `--baud` BAUD | speed of a serial port, 115200 |
| `--handshake` | accepted and ignored: a serial port always has RTS and CTS |
"""

from __future__ import annotations

import re
import select
import shlex
import socket
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias, TypeVar

from dmc41x3.address import BAUD, BAUDS, PORT, ControllerAddress, NetworkAddress, SerialAddress, device
from dmc41x3.errors import CodedError, ConnectFailed, LinkTimeout, MachineError, UnexpectedReply, ended
from dmc41x3.gclib.errors import Code, GclibError, translated
from dmc41x3.i18n import phrase
from dmc41x3.language.numbers import parse_number
from dmc41x3.wire.framing import Message, RecordReply, Reply, ReplyKind, ReplySplitter, Stray
from dmc41x3.wire.serial_port import BlockingPort, Greeting

SECOND_PORT = 60007
TIMEOUT = 5000
"""Default of the longest wait for an answer [ms]."""

SUBSCRIPTIONS = ("MG", "DR", "EI")
_COM = re.compile("COM[0-9]{1,3}")
_WAYS = ("UDP", "TCP", "NONE")


@dataclass(frozen=True, slots=True)
class AddressOptions:
    """The content of an address string. `timeout` is in ms, `second_port` is None if it is not given.

    For a serial port, `host` is its path.
    """

    host: str = ""
    port: int = PORT
    second_port: int | None = None
    subscriptions: frozenset[str] = frozenset()
    unsolicited: str = "UDP"
    timeout: int = TIMEOUT
    serial: bool = False
    baud: int = BAUD

    @property
    def place(self) -> ControllerAddress:
        """The address of the controller; `host` is the path of a serial port."""
        return SerialAddress(self.host, self.baud) if self.serial else NetworkAddress(self.host, self.port)

    @property
    def unsolicited_port(self) -> int:
        """The destination port of datagrams.

        A real controller accepts any port. A controller on a port other than 23 is a twin, whose UDP port is the same.
        """
        if self.second_port is not None:
            return self.second_port
        return SECOND_PORT if self.port == PORT else self.port


_Taker: TypeAlias = Callable[[AddressOptions, str], AddressOptions]


def parse(address: str) -> AddressOptions:
    """Return the options in an address string; raises `GclibError` (-10006) if it is not valid."""
    options = AddressOptions()
    try:
        words = iter(shlex.split(address))
        for word in words:
            options = _take(options, word, words)
    except ValueError as error:
        raise _bad(str(error)) from error
    if not options.host:
        raise _bad("it names no controller")
    return options


def _take(options: AddressOptions, word: str, words: Iterator[str]) -> AddressOptions:
    if word in ("-d", "--direct"):
        return options
    if not word.startswith("-"):
        return _addressed(options, word)
    taker = _SWITCHES.get(word)
    value = next(words, None)
    if taker is None or value is None:
        raise _bad(f"{word} is not known" if taker is None else f"{word} lacks its value")
    return taker(options, value)


def _addressed(options: AddressOptions, word: str) -> AddressOptions:
    if options.host:
        raise _bad(f"{options.host} and {word} are two controllers")
    if word.startswith("/") or _COM.fullmatch(word.upper()):
        return replace(options, host=device(word.upper() if word[0] != "/" else word), serial=True)
    if word.upper().startswith("GALILPCI"):
        raise _bad(f"{word} is no network address and no serial port")
    host, colon, port = word.rpartition(":")
    return replace(options, host=host, port=_number(port, 65535)) if colon else replace(options, host=word)


def _subscribed(options: AddressOptions, value: str) -> AddressOptions:
    name = value.upper()
    if name not in ("ALL", "NONE", *SUBSCRIPTIONS):
        raise _bad(f"{value} cannot be subscribed to")
    added = SUBSCRIPTIONS if name == "ALL" else () if name == "NONE" else (name,)
    return replace(options, subscriptions=options.subscriptions.union(added))


def _unsolicited(options: AddressOptions, value: str) -> AddressOptions:
    if value.upper() not in _WAYS:
        raise _bad(f"nothing comes unasked by {value}")
    return replace(options, unsolicited=value.upper())


def _command(options: AddressOptions, value: str) -> AddressOptions:
    if value.upper() != "TCP":
        raise _bad(f"commands do not go by {value}")
    return options


def _baud(options: AddressOptions, value: str) -> AddressOptions:
    if value not in map(str, BAUDS):
        raise _bad(f"no port has the speed {value}")
    return replace(options, baud=int(value))


def _number(text: str, most: int) -> int:
    if not text.isdecimal() or int(text) > most:
        raise _bad(f"{text!r} is no number up to {most}")
    return int(text)


def _bad(detail: str) -> GclibError:
    return GclibError(Code.ADDRESS, detail)


_LONG: dict[str, _Taker] = {
    "--address": _addressed,
    "--baud": _baud,
    "--command": _command,
    "--handshake": lambda options, _: options,
    "--p1": lambda options, value: replace(options, port=_number(value, 65535)),
    "--p2": lambda options, value: replace(options, second_port=_number(value, 65535)),
    "--subscribe": _subscribed,
    "--timeout": lambda options, value: replace(options, timeout=_number(value, 65535)),
    "--unsolicited": _unsolicited,
}
_SHORT = ("--address", "--baud", "--command", "--subscribe", "--timeout", "--unsolicited")
_SWITCHES: dict[str, _Taker] = {**_LONG, **{name[1:3]: _LONG[name] for name in _SHORT}}


_LETTER = re.compile(rb"IH([A-H])\r\n:")
_SEVEN_BITS = bytes(code & 0x7F for code in range(256))
_LARGEST = 65536
_HELLO = 0.25
"""Longest wait for the controller's first answer by UDP [s]; the request is sent three times."""

_INTERRUPT, _RECORD = 0x01, 0x80
_MOST_RECORDS = 64


class Commands:
    """The command socket. `timeout` [s] applies to each wait for bytes; `said` stores messages of programs."""

    def __init__(self, options: AddressOptions) -> None:
        self._address = str(options.place)
        self._splitter = ReplySplitter()
        self.timeout = options.timeout / 1000.0
        self.said: list[str] = []
        self._heard = False
        self._socket = self._opened(options.place)

    def _opened(self, place: ControllerAddress) -> socket.socket | BlockingPort:
        if isinstance(place, SerialAddress):
            return self._greeted(place)
        try:
            found = socket.create_connection(place, max(self.timeout, _HELLO))
        except (OSError, UnicodeError) as error:
            raise ConnectFailed(address=self._address, reason=str(error)) from error
        found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return found

    def _greeted(self, place: SerialAddress) -> BlockingPort:
        port, greeting = BlockingPort(place, max(self.timeout, _HELLO)), Greeting()
        try:
            port.sendall(greeting.data)
            while not greeting.feed(port.recv(_LARGEST)):
                continue
        except OSError as error:
            port.close()
            raise ConnectFailed(address=self._address, reason=str(error) or "no answer") from error
        return port

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
        """Wait up to `timeout` [s] for a message, unless one is already stored."""
        if not self.said and select.select([self._socket], [], [], timeout)[0]:
            self._sort(self._receive(self.timeout, ""), "")

    def close(self) -> None:
        """End the connection; idempotent."""
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
            raise self._ended(phrase("the controller ended the connection"))
        self._heard = True
        return data

    def _ended(self, reason: str) -> MachineError:
        return ended(self._address, reason, heard=self._heard)

    def _sort(self, data: bytes, command: str) -> Reply | RecordReply | None:
        """Store messages; return the answer. There is at most one, because requests do not overlap."""
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
    """The UDP socket; it sorts text (bit 7 set), data records and interrupts.

    An interrupt's datagram is 0x01, the status bytes, and 0x16 (DMC-40x0 user manual, EI; not seen on a DMC-41x3).
    """

    def __init__(self, host: str, port: int) -> None:
        """Open the socket and learn its handle; raises `OSError` if the controller does not answer by UDP."""
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
        """Sort all received datagrams."""
        while select.select([self._socket], [], [], 0.0)[0]:
            self.listen(0.0)

    def listen(self, timeout: float) -> None:
        """Wait up to `timeout` [s] for one datagram and sort it."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return
        try:
            data = self._socket.recv(_LARGEST)
        except OSError:
            return  # the port is closed at present; the controller may return
        if data[:1] == bytes([_INTERRUPT]):
            self.interrupts.extend(data[1:-1])
        elif data and data[0] & _RECORD and len(data) == int.from_bytes(data[2:4], "little"):
            self.records.append(data)
        elif data:
            self.said.append(data.translate(_SEVEN_BITS).decode("ascii"))

    def close(self) -> None:
        """Close the socket; the controller's handle must be closed by a command."""
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


T = TypeVar("T")

_ILLEGAL = ("DL", "ED", "QD", "QR")
_LISTINGS = ("UL", "QU")
_TRANSFER = 10.0
_LOOK = 0.01


class GclibSession:
    """The sockets that an address string describes, open until `close`. Every method raises `GclibError`.

    Several threads may share a session: each command is sent only after the last one is answered.
    """

    def __init__(self, options: AddressOptions) -> None:
        self.options = options
        self.timeout = -1
        self.second: Unsolicited | None = None
        self._turn = threading.Lock()
        self._commands = guarded(lambda: Commands(options))
        try:
            self._subscribe()
        except GclibError:
            self.close()
            raise

    def close(self) -> None:
        """End the connection and free both handles; idempotent."""
        second, self.second = self.second, None
        try:
            if second is not None:
                second.close()
                # A UDP handle stays in use until a command closes it.
                self._commands.ask(f"IH{second.letter}=>-1\r".encode())
        except CodedError:
            pass  # the link is lost, so the controller cannot receive the command
        finally:
            self._commands.close()

    def text(self, command: str) -> str:
        """Send one command and return its output without surrounding blanks; raises -10000 if it is refused."""
        if command[:2] in _ILLEGAL:
            raise GclibError(Code.ILLEGAL_COMMAND, command)
        return self.listing(command).strip() if command[:2] in _LISTINGS else self._ask(command, ReplyKind.TEXT).strip()

    def listing(self, command: str) -> str:
        """Send UL or QU and return its output."""
        return self._ask(command, ReplyKind.LISTING)

    def number(self, operand: str) -> float:
        """Return the value of an operand or expression."""
        printed = self.text(f"MG {operand}")
        try:
            return parse_number(printed)
        except ValueError as error:
            raise GclibError(Code.LOST_DATA, f"{operand} = {printed!r}") from error

    def record(self) -> bytes:
        """Return the present data record."""
        answer = self._exchange(b"QR\r", ReplyKind.RECORD)
        if not isinstance(answer, RecordReply):
            raise GclibError(Code.QUESTION_MARK, "QR")
        return answer.data

    def transfer(self, data: bytes) -> None:
        """Send a download with its data; raises -10000 if any of it is refused."""
        answer = self._exchange(data, ReplyKind.TRANSFER)
        if isinstance(answer, Reply) and not answer.ok:
            raise GclibError(Code.QUESTION_MARK, answer.text.strip())

    def require(self, subscription: str, missing: Code) -> Unsolicited:
        """Return the second socket; raises -1109 without the subscription, `missing` without the socket."""
        self.require_subscribed(subscription)
        if self.second is None:
            raise GclibError(missing, "the controller does not answer by UDP")
        return self.second

    def require_subscribed(self, subscription: str) -> None:
        """Raise -1109 if the address does not contain the subscription."""
        if subscription not in self.options.subscriptions:
            raise GclibError(Code.UNSUPPORTED_FUNCTION, f"`-s {subscription}` is missing in GOpen")

    def message(self) -> str:
        """Return the messages of programs since the last call; waits as `wait_for`."""
        self.require_subscribed("MG")
        source = self._commands if self.second is None else self.second
        self.wait_for(lambda: bool(source.said), self._listen if self.second is None else self.second.listen)
        text = "".join(source.said)
        source.said.clear()
        return text

    def wait_for(self, come: Callable[[], bool], listen: Callable[[float], None]) -> None:
        """Listen until `come` returns true; raises -1100 after the timeout, or -4 if the timeout is 0."""
        guarded(lambda: listen(0.0))
        for _ in range(round(self._seconds / _LOOK)):
            if come():
                return
            guarded(lambda: listen(_LOOK))
        if not come():
            raise GclibError(Code.TIMEOUT if self.timeout else Code.NON_BLOCKING_READ_EMPTY)

    @property
    def _seconds(self) -> float:
        return (self.options.timeout if self.timeout < 0 else self.timeout) / 1000.0

    def _subscribe(self) -> None:
        """Prepare the connection: no echo; for messages, bit 7 and their destination."""
        options = self.options
        self.text("EO 0")
        if options.subscriptions and options.unsolicited == "UDP" and not options.serial:
            try:
                self.second = Unsolicited(options.host, options.unsolicited_port)
            except OSError:
                self.second = None
        if "MG" in options.subscriptions and options.unsolicited != "NONE":
            self.text("CW 1")
            self.text("CF I" if self.second is None else f"CF {self.second.letter}")

    def _ask(self, command: str, kind: ReplyKind) -> str:
        if not command.isascii():
            raise GclibError(Code.VALUE_RANGE, f"{command!r} is not ASCII")
        answer = self._exchange(f"{command}\r".encode("ascii"), kind)
        if not isinstance(answer, Reply) or not answer.ok:
            raise GclibError(Code.QUESTION_MARK, command)
        return answer.text

    def _listen(self, timeout: float) -> None:
        """Listen for a message on the command socket."""
        with self._turn:
            self._commands.listen(timeout)

    def _exchange(self, data: bytes, kind: ReplyKind) -> Reply | RecordReply:
        with self._turn:
            return self._exchanged(data, kind)

    def _exchanged(self, data: bytes, kind: ReplyKind) -> Reply | RecordReply:
        """Send a request and return its answer; the caller holds the lock."""
        seconds = self._seconds or self.options.timeout / 1000.0
        self._commands.timeout = seconds if kind in (ReplyKind.TEXT, ReplyKind.RECORD) else max(seconds, _TRANSFER)
        try:
            return self._commands.ask(data, kind)
        except CodedError as error:
            if isinstance(error, LinkTimeout):
                self._begin_anew()
            raise translated(error) from error

    def _begin_anew(self) -> None:
        """Replace a socket with an overdue answer, which would be taken for that of the next command."""
        self._commands.close()
        try:
            self._commands = Commands(self.options)
        except CodedError:
            return  # the next command reports the failure


def guarded(work: Callable[[], T]) -> T:
    """Return the result of `work`; raises `GclibError` for an error of this package."""
    try:
        return work()
    except CodedError as error:
        raise translated(error) from error
