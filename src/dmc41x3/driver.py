"""A client of the controller in an asyncio loop: requests and their replies in order, over one link.

The driver writes every request at once, so any number may be under way; it does not queue requests. One watchdog
guards the link: if the oldest request gets no answer within its timeout, the link is lost. The driver declares a
loss once; every later call raises it. A new link needs a new `Driver` on a new transport.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any, Generic, NamedTuple, TypeVar, cast

from dmc41x3.errors import (
    CodedError,
    CommandRejected,
    InternalError,
    InvalidValue,
    LinkLost,
    LinkTimeout,
    MachineError,
    NotConnected,
    UnexpectedReply,
    ended,
)
from dmc41x3.i18n import phrase
from dmc41x3.language import transfer
from dmc41x3.language.codes import ERROR_TEXTS, Burned
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.language.numbers import parse_number
from dmc41x3.language.record import DataRecord, decode
from dmc41x3.wire.framing import Message, Received, RecordReply, Reply, ReplyKind, ReplySplitter, Stray
from dmc41x3.wire.stream import RecordStream
from dmc41x3.wire.transport import DatagramFactory, Transport

T = TypeVar("T")

Answer = str | bytes

_ASK = "TC1"

TRANSFER_TIMEOUT = 10.0
"""Longest wait for the end of a download or upload [s]; a program of 4000 lines is 320 kB."""


class _CommandRequest(Generic[T]):
    """One or several commands whose answers form one result."""

    __slots__ = ("answers", "error", "future", "left", "result")

    def __init__(self, future: asyncio.Future[T], count: int, result: Callable[[list[Answer]], T]) -> None:
        self.future = future
        self.left = count
        self.answers: list[Answer] = []
        self.error: CodedError | None = None
        self.result = result

    def answer(self, answer: Answer) -> None:
        self.answers.append(answer)
        self._one_less()

    def reject(self, error: CodedError) -> None:
        self.error = self.error or error
        self._one_less()

    def fail(self, error: CodedError) -> None:
        if not self.future.done():
            self.future.set_exception(error)

    def _one_less(self) -> None:
        self.left -= 1
        if self.left or self.future.done():
            return
        if self.error is not None:
            self.future.set_exception(self.error)
        else:
            self.future.set_result(self.result(self.answers))


class _SentCommand(NamedTuple):
    """A command on the wire; `request` is None for the driver's own TC1 after a rejection. `patience` is in s."""

    command: str
    request: _CommandRequest[object] | None
    patience: float


class Driver:
    """One link to a controller; created by `open`, ended by `close`, which is also necessary after a loss.

    `tap` receives every piece of the wire as ("tx" or "rx", bytes). `on_message` and the functions passed to `listen`
    receive the lines that a program in the controller sends by itself (see `subscribe`). A subscription ends with the
    link (see `lost`): lines sent in between are lost, and a new link must subscribe again.
    """

    def __init__(self, transport: Transport, timeout: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._transport = transport
        self._timeout = timeout
        self._splitter = ReplySplitter()
        self._sent: deque[_SentCommand] = deque()
        self._rejected: list[_SentCommand] = []
        self._since = 0.0
        self._watchdog: asyncio.TimerHandle | None = None
        self._closing = False
        self._heard = False
        self._reader: asyncio.Task[None] | None = None
        self.lost: asyncio.Future[MachineError] = self._loop.create_future()
        self.tap: Callable[[str, bytes], None] | None = None
        self.on_message: Callable[[str], None] | None = None
        self._listeners: list[Callable[[str], None]] = []

    @classmethod
    async def open(cls, transport: Transport, *, timeout: float) -> Driver:
        """Take over a connected transport; `timeout` [s] is the longest wait for a reply. Sends nothing."""
        driver = cls(transport, timeout)
        driver._reader = driver._loop.create_task(driver._read(), name=f"read {transport.peer}")
        return driver

    @property
    def address(self) -> str:
        """The address of the controller."""
        return self._transport.peer

    async def send(self, command: str, *, timeout: float | None = None) -> str:
        """Send one command and return its output without surrounding blanks.

        `timeout` [s] replaces that of the link for slow commands (BN, BP, BV). Raises `CommandRejected`, `InvalidValue`
        for a text that is not one command, and the loss of the link.
        """
        return await self._submit((command,), ReplyKind.TEXT, _first_text, timeout)

    async def exact(self, command: str, *, timeout: float | None = None) -> str:
        """Send one command and return its output unchanged, blanks included; otherwise as `send`."""
        return await self._submit((command,), ReplyKind.TEXT, _first_as_it_is, timeout)

    def urgent(self, command: str) -> asyncio.Future[str]:
        """Write one command before returning, for a stop; the future holds its reply and need not be awaited."""
        future = self._submit((command,), ReplyKind.TEXT, _first_text)
        future.add_done_callback(_look)
        return future

    async def batch(self, commands: Sequence[str]) -> list[str]:
        """Send commands together, packed into lines, and return the output of each.

        The controller also executes the commands after a rejected one. Once all have answered, raises `CommandRejected`
        for the first rejection; if there were several, its code is that of the last one.
        """
        return await self._submit(tuple(commands), ReplyKind.TEXT, _all_texts) if commands else []

    def begin_batch(self, commands: Sequence[str]) -> asyncio.Future[list[str]]:
        """Write commands as `batch` does, before returning; the future holds their outputs and need not be awaited."""
        future = self._submit(tuple(commands), ReplyKind.TEXT, _all_texts)
        future.add_done_callback(_look)
        return future

    async def value(self, operand: str) -> float:
        """Return the value of an operand, variable or expression (`_TPA`, `TIME`, `speed`).

        Raises `UnexpectedReply` if the answer is not one number, and as `send`.
        """
        command = f"MG {operand}"
        reply = await self.send(command)
        try:
            return parse_number(reply)
        except ValueError as error:
            raise UnexpectedReply(command=command, reply=reply) from error

    async def record(self) -> DataRecord:
        """Return the controller's present data record; raises as `send`."""
        return decode(await self.raw_record())

    async def raw_record(self) -> bytes:
        """Return the bytes of the present data record, without prompt; raises as `send`."""
        return await self._submit(("QR",), ReplyKind.RECORD, _first_bytes)

    async def subscribe(self) -> None:
        """Direct the messages of the controller's programs to this link, marked by bit 7 (CW 1; CF I)."""
        await self.batch(["CW 1", "CF I"])

    def listen(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Pass every message also to `listener`, until the returned function is called."""
        self._listeners.append(listener)

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return leave

    async def download(self, text: str, *, keep: int = 0) -> None:
        """Replace the controller's program by `text` (DL) and read it back to verify it (UL).

        The first `keep` lines are those that the controller already holds; they stay in its memory throughout, so that
        a broken link cannot lose them. Raises `InvalidValue` for a text that no controller accepts, before anything is
        sent; `CommandRejected` with code 17 while a program runs, which then stays unchanged, and with the code of a
        refused line; `ProgramDiffers`. After the last two errors the memory holds the part that the controller
        accepted.
        """
        lines = transfer.program_lines(text)
        transfer.require_loadable(lines)
        await self._transfer("DL", transfer.download_probe(keep))
        await self._transfer("DL", transfer.program_download(lines, keep))
        transfer.require_same_lines(lines, transfer.uploaded_lines(await self._listing("UL")))

    async def upload(self) -> str:
        """Return the controller's program (UL), with a line feed after each line; raises as `send`."""
        return "".join(f"{line}\n" for line in transfer.uploaded_lines(await self._listing("UL")))

    async def download_array(self, name: str, values: Sequence[float], first: int = 0) -> None:
        """Write `values` into an existing array, from element `first` on (QD).

        Numbers are truncated to multiples of 1/65536. Raises `InvalidValue` for a number out of its range or values
        that do not fit, and `CommandRejected` (82 or 57) if the array does not exist.
        """
        transfer.require_array_fit(name, first, len(values), await self.value(transfer.array_length(name)))
        if values:
            await self._transfer("QD", transfer.array_download(name, values, first))

    async def upload_array(self, name: str) -> list[float]:
        """Return the elements of an array (QU); raises `CommandRejected` if the array does not exist."""
        command = transfer.array_upload(name)
        return transfer.parse_array(command, await self._listing(command))

    async def stream(self, rate: float, datagrams: DatagramFactory | None = None) -> RecordStream:
        """Return a stream of `rate` data records a second; the caller must close it.

        The controller sends the records by UDP (DR) if `datagrams` opens a UDP transport. Otherwise, or if UDP falls
        silent, the stream polls them (QR). Raises `InvalidValue` for a rate that the controller does not offer, and as
        `send`.
        """
        return await RecordStream.open(self, rate, datagrams)

    async def burned(self) -> Burned:
        """Return which of the controller's burned memories passed their checksum at the last power-up (_RS)."""
        return Burned.of(int(await self.value("_RS")))

    async def close(self) -> None:
        """Wait for the replies under way, then end the link, which is not a loss; idempotent."""
        if not self._closing:
            barrier = None if self.lost.done() or not self._sent else self._submit(("",), ReplyKind.TEXT, _first_text)
            self._closing = True
            if barrier is not None:
                with suppress(CodedError):  # `lost` reports a loss, a request its own rejection
                    await barrier
        if self._watchdog is not None:
            self._watchdog.cancel()
        if self._reader is not None:
            self._reader.cancel()
            await asyncio.wait({self._reader})
        self._fail_all(NotConnected())
        await self._transport.close()

    def _submit(
        self,
        commands: tuple[str, ...],
        kind: ReplyKind,
        result: Callable[[list[Answer]], T],
        timeout: float | None = None,
    ) -> asyncio.Future[T]:
        self._require_open()
        return self._begin(_lines(commands), commands, kind, result, timeout)

    async def _transfer(self, command: str, data: bytes) -> None:
        """Send a download with its data in one piece, so that no other command can come between them."""
        self._require_open()
        await self._begin(data, (command,), ReplyKind.TRANSFER, _first_text, max(self._timeout, TRANSFER_TIMEOUT))

    async def _listing(self, command: str) -> str:
        patience = max(self._timeout, TRANSFER_TIMEOUT)
        return await self._submit((command,), ReplyKind.LISTING, _first_as_it_is, patience)

    def _require_open(self) -> None:
        if self.lost.done():
            raise _again(self.lost.result())
        if self._closing:
            raise NotConnected

    def _begin(
        self,
        data: bytes,
        commands: tuple[str, ...],
        kind: ReplyKind,
        result: Callable[[list[Answer]], T],
        timeout: float | None,
    ) -> asyncio.Future[T]:
        request = _CommandRequest(self._loop.create_future(), len(commands), result)
        patience = self._timeout if timeout is None else timeout
        self._expect(commands, cast("_CommandRequest[object]", request), patience, kind)
        self._write(data)
        return request.future

    def _expect(
        self, commands: Sequence[str], request: _CommandRequest[object] | None, patience: float, kind: ReplyKind
    ) -> None:
        if not self._sent:
            self._since = self._loop.time()
        self._sent.extend(_SentCommand(command, request, patience) for command in commands)
        self._splitter.expect(kind, len(commands))
        if self._watchdog is None:
            self._watchdog = self._loop.call_at(self._since + patience, self._look_at_oldest)

    def _write(self, data: bytes) -> None:
        if self.tap is not None:
            self.tap("tx", data)
        try:
            self._transport.write(data)
        except LinkLost as error:
            self._lose(error)

    async def _read(self) -> None:
        try:
            while data := await self._transport.read():
                self._heard = True
                if self.tap is not None:
                    self.tap("rx", data)
                for received in self._splitter.feed(data):
                    self._take(received)
            self._lose(LinkLost(address=self.address, reason="the other side ended it"))
        except MachineError as error:
            self._lose(error)
        except Exception as error:
            self._lose(InternalError(reason=repr(error)))
            raise

    def _take(self, received: Received) -> None:
        if isinstance(received, Message):
            self._hand_out(received.text)
            return
        if isinstance(received, Stray):
            command = self._sent[0].command if self._sent else ""
            raise UnexpectedReply(command=command, reply=received.data[:40].decode("latin-1"))
        sent = self._sent.popleft()
        self._since = self._loop.time()
        if sent.request is None:
            self._explain(received)
        elif isinstance(received, RecordReply):
            sent.request.answer(received.data)
        elif received.ok:
            sent.request.answer(received.text)
        elif received.text:
            sent.request.reject(_rejection(sent.command, received.text))
        else:
            self._ask_why(sent)

    def _hand_out(self, message: str) -> None:
        if self.on_message is not None:
            self.on_message(message)
        for listener in tuple(self._listeners):
            listener(message)

    def _ask_why(self, sent: _SentCommand) -> None:
        """Send TC1 before any other request; one TC1 serves all rejections until its answer.

        A rejection that arrives before that answer belongs to a command executed before TC1, so TC1 covers it.
        """
        self._rejected.append(sent)
        if len(self._rejected) == 1:
            self._expect((_ASK,), None, self._timeout, ReplyKind.TEXT)
            self._write(f"{_ASK}\r".encode())

    def _explain(self, received: Reply | RecordReply) -> None:
        text = received.text if isinstance(received, Reply) else ""
        rejected, self._rejected = self._rejected, []
        for sent in rejected:
            if sent.request is not None:
                sent.request.reject(_rejection(sent.command, text))

    def _look_at_oldest(self) -> None:
        self._watchdog = None
        if not self._sent:
            return
        due = self._since + self._sent[0].patience
        if self._loop.time() < due:
            self._watchdog = self._loop.call_at(due, self._look_at_oldest)
        else:
            # If this process was delayed, the reply has already arrived, and its reader runs next.
            self._loop.call_soon(self._give_up, self._sent[0])

    def _give_up(self, oldest: _SentCommand) -> None:
        if self._sent and self._sent[0] is oldest:
            seconds = f"{oldest.patience:g}"
            self._lose(LinkTimeout(address=self.address, command=oldest.command, seconds=seconds))
        elif self._sent and self._watchdog is None:
            self._look_at_oldest()

    def _lose(self, reason: MachineError) -> None:
        if self.lost.done() or (self._closing and not self._sent):
            return
        if isinstance(reason, LinkLost):
            reason = ended(reason.address, reason.reason, heard=self._heard)
        self.lost.set_result(reason)
        if self._reader is not None and self._reader is not asyncio.current_task(self._loop):
            self._reader.cancel()
        self._fail_all(reason)

    def _fail_all(self, reason: CodedError) -> None:
        requests = {id(sent.request): sent.request for sent in (*self._sent, *self._rejected)}
        self._sent.clear()
        self._rejected.clear()
        for request in requests.values():
            if request is not None:
                request.fail(_again(reason))


def _lines(commands: Iterable[str]) -> bytes:
    """Return the bytes of commands packed into as few lines as the controller's limit allows."""
    lines: list[str] = []
    line: str | None = None
    for command in commands:
        _require_one(command)
        if line is not None and len(line) + 1 + len(command) <= LINE_LIMIT:
            line = f"{line};{command}"
            continue
        if line is not None:
            lines.append(line)
        line = command
    return "".join(f"{text}\r" for text in [*lines, line or ""]).encode("ascii")


def _require_one(command: str) -> None:
    if not command.isascii() or "\r" in command or "\n" in command or ";" in command:
        raise InvalidValue(key="command", value=repr(command), reason="it must be one command, in ASCII, without `;`")
    if len(command) > LINE_LIMIT:
        raise InvalidValue(
            key="command", value=repr(command), reason=phrase("a line holds {most} characters", most=LINE_LIMIT)
        )


def _rejection(command: str, told: str) -> CommandRejected:
    """Return the error of a rejected command; `told` is the answer to TC1."""
    number, _, words = told.strip().partition(" ")
    code = int(number) if number.isdecimal() else 0
    reason = ERROR_TEXTS.get(code) or words.strip() or phrase("no reason given")  # the first two are the controller's
    return CommandRejected(command=command, tc=code, reason=reason)


def _again(error: CodedError) -> CodedError:
    """Return a fresh copy: one instance raised in several tasks would collect all their tracebacks."""
    return error.copy()


def _look(future: asyncio.Future[Any]) -> None:
    """Retrieve the outcome, so that asyncio does not report a future that is never awaited."""
    if not future.cancelled():
        future.exception()


def _first_text(answers: list[Answer]) -> str:
    return cast("str", answers[0]).strip()


def _first_as_it_is(answers: list[Answer]) -> str:
    return cast("str", answers[0])


def _first_bytes(answers: list[Answer]) -> bytes:
    return cast("bytes", answers[0])


def _all_texts(answers: list[Answer]) -> list[str]:
    return [cast("str", answer).strip() for answer in answers]
