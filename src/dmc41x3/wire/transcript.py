r"""Recordings of a wire: their lines, the exchanges in them, and how two answers to one command compare.

A recording is text, one JSON object a line. The first names the format:
`{"format": "maya-dmc-capture", "version": 1, "controller": "10.0.0.5:23"}`. Every other is a piece of the wire,
`{"t": 0.0125, "link": 1, "from": "client", "data": "TP\r"}`: seconds since the beginning, the number of the client's
connection, the sender (`client` or `controller`), and the bytes, each as the character of its number (Latin-1).
Instead of `data`, `"event": "open"` and `"event": "end"` mark when a connection began and which side ended it.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, cast

from dmc41x3.errors import UnexpectedReply
from dmc41x3.i18n import phrase
from dmc41x3.language.hardware import LETTERS
from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord, decode
from dmc41x3.wire.framing import LineSplitter, Message, Received, RecordReply, Reply, ReplyKind, ReplySplitter, Stray

FORMAT = "maya-dmc-capture"
VERSION = 1

Side = Literal["client", "controller"]


class WirePiece(NamedTuple):
    """A piece of traffic, or the beginning or end of a connection (`event`); `time` in s."""

    time: float
    link: int
    side: Side
    data: bytes = b""
    event: str = ""

    def line(self) -> str:
        """Return the piece as a line of a recording."""
        what = {"event": self.event} if self.event else {"data": self.data.decode("latin-1")}
        return json.dumps({"t": round(self.time, 6), "link": self.link, "from": self.side, **what})


def header(controller: str) -> str:
    """Return the first line of a recording of the controller at an address."""
    return json.dumps({"format": FORMAT, "version": VERSION, "controller": controller})


def read(lines: Iterable[str]) -> list[WirePiece]:
    """Return the pieces of a recording; raises `ValueError` with the line's number for an invalid line.

    An incomplete last line, as after a crash, is ignored.
    """
    texts = [line for line in lines if line.strip()]
    try:
        head = _object(texts[0]) if texts else {}
    except (ValueError, RecursionError):
        head = {}
    if head.get("format") != FORMAT or head.get("version") != VERSION:
        raise ValueError(phrase("it is no {format} of version {version}", format=FORMAT, version=VERSION))
    pieces: list[WirePiece] = []
    for number, text in enumerate(texts[1:], start=2):
        try:
            pieces.append(_piece(_object(text)))
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            if number == len(texts) and not text.endswith("\n"):
                break
            raise ValueError(phrase("line {number} is no piece of a wire", number=number)) from error
    return pieces


def _object(text: str) -> dict[str, Any]:
    found = json.loads(text)
    return cast("dict[str, Any]", found) if isinstance(found, dict) else {}


def _piece(found: dict[str, Any]) -> WirePiece:
    side = found["from"]
    if side not in {"client", "controller"}:
        raise ValueError("nobody sends")
    event = str(found.get("event", ""))
    data = b"" if event else str(found["data"]).encode("latin-1")
    time = float(found["t"])
    if not 0.0 <= time < math.inf:
        raise ValueError("that is no time")
    return WirePiece(time, int(found["link"]), cast("Side", side), data, event)


@dataclass(slots=True)
class Exchange:
    """A command and its answer, None if there is none yet; `time` is when the command was complete [s]."""

    time: float
    command: str
    reply: Reply | RecordReply | None = None


@dataclass(slots=True)
class ConnectionTranscript:
    """One connection, parsed: every command with its answer, and the messages of programs in between.

    `stray` is set if bytes arrived that answer nothing; later answers cannot be assigned to commands.
    """

    exchanges: list[Exchange] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    stray: bytes = b""
    _lines: LineSplitter = field(default_factory=LineSplitter)
    _replies: ReplySplitter = field(default_factory=ReplySplitter)
    _answered: int = 0

    def said(self, data: bytes, time: float) -> None:
        """Process bytes that the client sent."""
        for command in self._lines.split(data):
            if self._lines.program and command != "\\":
                continue  # the text of a program, or the data of an array: answered when it is complete
            if command.startswith(("DL", "QD")) and "=" not in command and "?" not in command:
                self._lines.program = True
            self._replies.expect(ReplyKind.RECORD if command == "QR" else ReplyKind.TEXT)
            self.exchanges.append(Exchange(time, command))

    def heard(self, data: bytes) -> None:
        """Process bytes that the controller sent."""
        if self.stray:
            self.stray += data
            return
        for received in self._replies.feed(data):
            self._take(received)

    def _take(self, received: Received) -> None:
        if isinstance(received, Message):
            self.messages.append(received.text)
        elif isinstance(received, Stray):
            self.stray += received.data
        elif self._answered < len(self.exchanges):
            self.exchanges[self._answered].reply = received
            self._answered += 1

    @property
    def answered(self) -> int:
        """Number of commands that have their answer, from the first on."""
        return self._answered

    @property
    def complete(self) -> bool:
        """Whether every command has its answer."""
        return self._answered == len(self.exchanges) or bool(self.stray)


def conversations(pieces: Iterable[WirePiece]) -> dict[int, ConnectionTranscript]:
    """Return the connections of a recording by their number, each parsed."""
    found: dict[int, ConnectionTranscript] = {}
    for piece in pieces:
        conversation = found.setdefault(piece.link, ConnectionTranscript())
        if piece.side == "client":
            conversation.said(piece.data, piece.time)
        else:
            conversation.heard(piece.data)
    return found


_DECIMAL = re.compile(r"-?[0-9]+(?:\.[0-9]+)?")
_IDENTITY = re.compile(r"\x12\x16$|(?:ID|TH|WH|IA|IH)(?![a-z])|MG.*_(?:BN|WH|IA|IH|CF)")
_FLEETING = re.compile(r"TIME|_T[VT]|_RD|_UL|_DM|_XQ|_CS|_AV|_LM|_VM|_BT|_ED|_TM\b")
_POSITIONS = re.compile(r"(?:^|_)(?:TP|RP|TE|TD|PA|PR|DE|DP|RL)")
_FLEETING_COMMANDS = ("TV", "TT")


def difference(
    command: str,
    recorded: Reply | RecordReply | None,
    replayed: Reply | RecordReply | None,
    counts: float,
    seconds: float = 0.0,
) -> str:
    """Return how two answers to one command differ, empty if they agree as far as two runs can.

    Identity, clock, velocity and torque may differ in every number; positions by `counts`, in a record also by the
    distance of the axis in `seconds`. Texts, prompts and all other numbers must be equal.
    """
    if isinstance(recorded, Reply) and isinstance(replayed, Reply):
        return _texts(command, recorded, replayed, counts)
    if isinstance(recorded, RecordReply) and isinstance(replayed, RecordReply):
        return _records(recorded, replayed, counts, seconds)
    if recorded is None and replayed is None:
        return ""
    return f"{shown(recorded)} became {shown(replayed)}"


def _texts(command: str, recorded: Reply, replayed: Reply, counts: float) -> str:
    became = f"{shown(recorded)} became {shown(replayed)}"
    if recorded.ok != replayed.ok:
        return became
    if recorded.text == replayed.text or _IDENTITY.match(command):
        return ""
    if _DECIMAL.sub("0", recorded.text).split() != _DECIMAL.sub("0", replayed.text).split():
        return became
    before, after = (list(map(float, _DECIMAL.findall(reply.text))) for reply in (recorded, replayed))
    far = max((abs(a - b) for a, b in zip(before, after, strict=True)), default=0.0)
    return became if far > _allowed(command, counts) else ""


def _allowed(command: str, counts: float) -> float:
    if _FLEETING.search(command) or command.startswith(_FLEETING_COMMANDS):
        return math.inf
    return counts if _POSITIONS.search(command) else 0.0


_COMPARED = AxisStatus.MOVING | AxisStatus.COORDINATED | AxisStatus.MOTOR_OFF


def _records(recorded: RecordReply, replayed: RecordReply, counts: float, seconds: float) -> str:
    try:
        before, after = decode(recorded.data), decode(replayed.data)
    except UnexpectedReply:
        same = len(recorded.data) == len(replayed.data)
        return "" if same else f"{len(recorded.data)} bytes became {len(replayed.data)}"
    return ", ".join(_record_differences(before, after, counts, seconds))


def _record_differences(before: DataRecord, after: DataRecord, counts: float, seconds: float) -> Iterator[str]:
    if len(before.axes) != len(after.axes):
        yield f"{len(before.axes)} axes became {len(after.axes)}"
        return
    for name in ("inputs", "outputs", "error_code", "threads", "amplifier_status"):
        if getattr(before, name) != getattr(after, name):
            yield f"{name} {getattr(before, name)} became {getattr(after, name)}"
    for letter, one, other in zip(LETTERS, before.axes, after.axes, strict=False):
        allowed = counts + seconds * max(abs(one.velocity), abs(other.velocity))
        yield from (f"{letter} {words}" for words in _axis_differences(one, other, allowed))


def _axis_differences(one: AxisRecord, other: AxisRecord, counts: float) -> Iterator[str]:
    for name in ("position", "reference"):
        if abs(getattr(one, name) - getattr(other, name)) > counts:
            yield f"{name} {getattr(one, name)} became {getattr(other, name)}"
    for name in ("switches", "stop_code", "user"):
        if getattr(one, name) != getattr(other, name):
            yield f"{name} {getattr(one, name)} became {getattr(other, name)}"
    if (one.status ^ other.status) & _COMPARED:
        yield f"status {one.status:#06x} became {other.status:#06x}"


def shown(reply: Reply | RecordReply | None) -> str:
    """Return an answer as text for users."""
    if reply is None:
        return "no answer"
    if isinstance(reply, RecordReply):
        return f"a record of {len(reply.data)} bytes"
    return repr(reply.text or ":") if reply.ok else "'?'"
