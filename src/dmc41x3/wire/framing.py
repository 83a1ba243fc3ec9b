"""Bytes of the wire to commands (controller's side) and to replies (host's side).

Both splitters accept bytes in pieces of any size. The result does not depend on where the bytes are cut, with the one
exception that `LineSplitter` names.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from dmc41x3.language.commands import LINE_LIMIT, TOO_LONG

_SEVEN_BITS = bytes(code & 0x7F for code in range(256))
_COMMAND_ENDS = re.compile(r"[\r;]")
_PROGRAM_ENDS = re.compile(r"[\r\\\x04\x11\x1a]")

_RUN = re.compile(rb"[\x00-\x7f]+|[\x80-\xff]+")
_ACCEPTED, _REJECTED = ord(":"), ord("?")
_HEADER = 4
_LONGEST_RECORD = 4 + 52 + 26 + 8 * 36


class LineSplitter:
    """Controller's side: bytes to the texts of commands, each of which gets one prompt.

    CR and `;` end a command, LF is ignored, bit 7 is dropped, a comment (`'`) extends to the CR. A command that
    exceeds 80 characters of its line becomes `TOO_LONG`. A line also ends where the received bytes end in
    `;`: some clients never send CR, and a controller does not wait for it.

    While `program` is True the bytes are the text of a program (DL): only CR ends a line, `;` is part of the line, and
    a backslash is a separate item that ends this mode; so do ^D, ^Q and ^Z, which are read as a backslash. `limit`
    is the longest line until this mode ends: numbers (QD) may come in one line that is longer than any command.
    """

    def __init__(self) -> None:
        self.program = False
        self.limit = LINE_LIMIT
        self._pending = ""
        self._before = 0

    @property
    def between_lines(self) -> bool:
        """Whether the next byte begins a line of commands."""
        return not (self.program or self._pending or self._before) and self.limit == LINE_LIMIT

    def feed(self, data: bytes) -> list[str]:
        """Return the commands that `data` completes."""
        return list(self.split(data))

    def split(self, data: bytes) -> Iterator[str]:
        """Yield the commands that `data` completes; `program` may be changed in between.

        Exhaust the iterator: commands that are not taken are lost.
        """
        text = data.translate(_SEVEN_BITS, b"\n\x8a").decode("ascii")
        place = 0
        while found := (_PROGRAM_ENDS if self.program else _COMMAND_ENDS).search(text, place):
            end = found[0]
            self._pending += text[place : found.start()]
            place = found.end()
            if end == ";" and "'" in self._pending and self._pending.lstrip(" \t").startswith("'"):
                self._pending += ";"
                continue
            command = self._complete(end)
            if end in "\r;":
                yield command if self.program else command.strip(" \t")
                continue
            if command:
                yield command
            self.program, self.limit = False, LINE_LIMIT
            yield "\\"
        # One character past the limit is enough to refuse a line; the rest of it is dropped.
        self._pending = (self._pending + text[place:])[: self.limit + 1]
        if text.endswith(";") and not self._pending:
            self._before = 0

    def _complete(self, end: str) -> str:
        """Return the text before the terminator `end`, `TOO_LONG` if it is too long, and begin a new text."""
        length = self._before + len(self._pending)
        command = TOO_LONG if length > self.limit else self._pending
        self._pending = ""
        self._before = length + 1 if end == ";" else 0
        return command


class ReplyKind(Enum):
    """The kind of answer to a request.

    `LISTING` is the answer to UL and QU: any text, ended by Ctrl-Z and a prompt. `TRANSFER` is that to DL and QD with
    their data and a TC1 after it: any number of prompts, then the output of TC1.
    """

    TEXT = auto()
    RECORD = auto()
    LISTING = auto()
    TRANSFER = auto()


_ENDS = {
    ReplyKind.TEXT: re.compile(rb"(?:\r\n|\x1a):"),
    ReplyKind.LISTING: re.compile(rb"\x1a:"),
    ReplyKind.TRANSFER: re.compile(rb"\r\n:"),
}
_PROMPTS = {ReplyKind.TEXT: b":?", ReplyKind.LISTING: b"?", ReplyKind.TRANSFER: b""}
"""Bytes that are a whole answer at the beginning of a reply."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to one command: whether it was accepted, and its output, without the last line end.

    For a transfer that was refused, in whole or in part, `text` is the output of TC1.
    """

    ok: bool
    text: str = ""


@dataclass(frozen=True, slots=True)
class RecordReply:
    """The answer to QR: a whole data record, without its prompt."""

    data: bytes


@dataclass(frozen=True, slots=True)
class Message:
    """An unsolicited line from a program in the controller (bit 7 set on the wire, CW 1)."""

    text: str


@dataclass(frozen=True, slots=True)
class Stray:
    """Bytes that fit no request. Replies can no longer be assigned to requests: the link is unusable."""

    data: bytes


_DONE = Reply(True)
"""The answer to most commands."""

Received: TypeAlias = Reply | RecordReply | Message | Stray


class ReplySplitter:
    """Host's side: bytes to replies, in the order of the requests announced with `expect`.

    A text ends at a prompt that stands alone or after a line end, since texts may contain colons; it cannot begin
    with `:` or `?` nor lack its line end (`MG "x"{N}`), because such replies are ambiguous. A record is
    framed by the length in its header, since it may contain any bytes. Bytes with bit 7 set outside of records
    are messages and may occur anywhere, also inside a text.
    """

    def __init__(self) -> None:
        self._kinds: deque[ReplyKind] = deque()
        self._text = b""
        self._record = b""
        self._message = b""

    @property
    def pending(self) -> int:
        """Number of requests that wait for their reply."""
        return len(self._kinds)

    def expect(self, kind: ReplyKind = ReplyKind.TEXT, count: int = 1) -> None:
        """Announce `count` more requests and the kind of their replies."""
        self._kinds.extend([kind] * count)

    def feed(self, data: bytes) -> list[Received]:
        """Return the replies and messages that `data` completes, in order."""
        received: list[Received] = []
        place = 0
        while place < len(data):
            if self._kinds and self._kinds[0] is ReplyKind.RECORD and (self._record or not _is_message(data[place])):
                place = self._take_record(data, place, received)
                continue
            if not self._text and self._kinds and data[place] == _ACCEPTED and self._kinds[0] is ReplyKind.TEXT:
                self._kinds.popleft()
                received.append(_DONE)
                place += 1
                continue
            run = _RUN.match(data, place)
            assert run is not None
            if data[place] & 0x80:
                place = self._take_message(data, place, run.end(), received)
            elif self._kinds:
                place = self._take_text(data, place, run.end(), received)
            else:
                received.append(Stray(run[0]))
                place = run.end()
        return received

    def _take_text(self, data: bytes, place: int, end: int, received: list[Received]) -> int:
        kind = self._kinds[0]
        if not self._text and data[place] in _PROMPTS[kind]:
            self._kinds.popleft()
            received.append(Reply(data[place] == _ACCEPTED))
            return place + 1
        known = len(self._text)
        text = self._text + data[place:end]
        prompt = _ENDS[kind].search(text, max(0, known - 2))
        if prompt is None:
            self._text = text
            return end
        self._text = b""
        self._kinds.popleft()
        received.append(_reply(kind, text[: prompt.end() - 1]))
        return place + prompt.end() - known

    def _take_record(self, data: bytes, place: int, received: list[Received]) -> int:
        if not self._record and data[place] == _REJECTED:
            self._kinds.popleft()
            received.append(Reply(False))
            return place + 1
        header = (self._record + data[place : place + _HEADER])[:_HEADER]
        if len(header) < _HEADER:
            self._record = header
            return len(data)
        length = int.from_bytes(header[2:4], "little")
        if header[0] & 0x78 or not _HEADER < length <= _LONGEST_RECORD:
            return self._fail(self._record + data[place:], len(data), received)
        end = place + length + 1 - len(self._record)
        whole = self._record + data[place:end]
        if end > len(data):
            self._record = whole
            return len(data)
        self._record = b""
        if whole[-1] != _ACCEPTED:
            return self._fail(whole, end, received)
        self._kinds.popleft()
        received.append(RecordReply(whole[:-1]))
        return end

    def _fail(self, data: bytes, end: int, received: list[Received]) -> int:
        self._record = b""
        self._kinds.popleft()
        received.append(Stray(data))
        return end

    def _take_message(self, data: bytes, place: int, end: int, received: list[Received]) -> int:
        if self._kinds and self._kinds[0] is ReplyKind.RECORD:
            # The record's own first byte also has bit 7 set; only bytes of text are taken.
            end = next((i for i in range(place, end) if not _is_message(data[i])), end)
        *lines, self._message = (self._message + data[place:end].translate(_SEVEN_BITS)).split(b"\n")
        received.extend(Message(line.removesuffix(b"\r").decode("ascii")) for line in lines)
        return end


def _reply(kind: ReplyKind, data: bytes) -> Reply:
    """Return the reply whose text, without its prompt, is `data`."""
    if kind is ReplyKind.LISTING:
        return Reply(True, data[:-1].decode("ascii"))
    text = data.removesuffix(b"\r\n").decode("ascii")
    if kind is ReplyKind.TEXT:
        return Reply(True, text)
    words = text.lstrip(":?")
    return Reply("?" not in text[: len(text) - len(words)], words)


def _is_message(byte: int) -> bool:
    """Return whether a byte belongs to a message (blank, printable, tab, CR, LF; bit 7 set) and begins no record."""
    return byte > 0x87
