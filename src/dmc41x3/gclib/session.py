"""One connection as the interface uses it: texts, numbers, listings and transfers, and waits for what comes unasked."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

from dmc41x3.errors import CodedError, LinkTimeout
from dmc41x3.gclib.connection import Commands, Unsolicited
from dmc41x3.gclib.errors import Code, GclibError, translated
from dmc41x3.gclib.options import AddressOptions
from dmc41x3.language.numbers import parse_number
from dmc41x3.wire.framing import RecordReply, Reply, ReplyKind

T = TypeVar("T")

_ILLEGAL = ("DL", "ED", "QD", "QR")
_LISTINGS = ("UL", "QU")
_TRANSFER = 10.0
_LOOK = 0.01


class GclibSession:
    """The sockets that an address string asks for, open until `close`. Every method raises `GclibError`.

    Several threads may share it: nobody sends a command before the last one is answered.
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
        """End the connection and free both handles; again is harmless."""
        second, self.second = self.second, None
        try:
            if second is not None:
                second.close()
                # A UDP handle stays taken until somebody closes it.
                self._commands.ask(f"IH{second.letter}=>-1\r".encode())
        except CodedError:
            pass  # the link is gone, and nobody is there to be told
        finally:
            self._commands.close()

    def text(self, command: str) -> str:
        """Send one command and return what it printed, blanks around it removed; -10000 where it is refused."""
        if command[:2] in _ILLEGAL:
            raise GclibError(Code.ILLEGAL_COMMAND, command)
        return self.listing(command).strip() if command[:2] in _LISTINGS else self._ask(command, ReplyKind.TEXT).strip()

    def listing(self, command: str) -> str:
        """Send UL or QU and return what it printed."""
        return self._ask(command, ReplyKind.LISTING)

    def number(self, operand: str) -> float:
        """Return the value of an operand or expression."""
        printed = self.text(f"MG {operand}")
        try:
            return parse_number(printed)
        except ValueError as error:
            raise GclibError(Code.LOST_DATA, f"{operand} = {printed!r}") from error

    def record(self) -> bytes:
        """Return the data record of now."""
        answer = self._exchange(b"QR\r", ReplyKind.RECORD)
        if not isinstance(answer, RecordReply):
            raise GclibError(Code.QUESTION_MARK, "QR")
        return answer.data

    def transfer(self, data: bytes) -> None:
        """Send a download with its data; -10000 where any of it is refused."""
        answer = self._exchange(data, ReplyKind.TRANSFER)
        if isinstance(answer, Reply) and not answer.ok:
            raise GclibError(Code.QUESTION_MARK, answer.text.strip())

    def require(self, subscription: str, missing: Code) -> Unsolicited:
        """Return the second socket; -1109 where the address did not subscribe, `missing` where there is none."""
        self.require_subscribed(subscription)
        if self.second is None:
            raise GclibError(missing, "the controller does not answer by UDP")
        return self.second

    def require_subscribed(self, subscription: str) -> None:
        """Raise -1109 where the address did not subscribe."""
        if subscription not in self.options.subscriptions:
            raise GclibError(Code.UNSUPPORTED_FUNCTION, f"`-s {subscription}` is missing in GOpen")

    def message(self) -> str:
        """Return what programs have said since the last call; waits as `wait_for`."""
        self.require_subscribed("MG")
        source = self._commands if self.second is None else self.second
        self.wait_for(lambda: bool(source.said), self._listen if self.second is None else self.second.listen)
        text = "".join(source.said)
        source.said.clear()
        return text

    def wait_for(self, come: Callable[[], bool], listen: Callable[[float], None]) -> None:
        """Listen until something has come; -1100 where nothing does in time, -4 where no wait is allowed."""
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
        """Prepare the connection: no echo, and where messages are wanted, bit 7 and the port they go to."""
        options = self.options
        self.text("EO 0")
        if options.subscriptions and options.unsolicited == "UDP":
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
        """Send a request and return its answer, in one's turn."""
        seconds = self._seconds or self.options.timeout / 1000.0
        self._commands.timeout = seconds if kind in (ReplyKind.TEXT, ReplyKind.RECORD) else max(seconds, _TRANSFER)
        try:
            return self._commands.ask(data, kind)
        except CodedError as error:
            if isinstance(error, LinkTimeout):
                self._begin_anew()
            raise translated(error) from error

    def _begin_anew(self) -> None:
        """Replace a socket on which an answer is overdue: it would be taken for that of the next command."""
        self._commands.close()
        try:
            self._commands = Commands(self.options)
        except CodedError:
            return  # the next command says so


def guarded(work: Callable[[], T]) -> T:
    """Do something and raise what goes wrong as gclib would."""
    try:
        return work()
    except CodedError as error:
        raise translated(error) from error
