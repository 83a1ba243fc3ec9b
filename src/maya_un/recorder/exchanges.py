"""Commands of a recording with their answers, also if the recording begins in the middle of a conversation.

An answer is identified by its place in the order, so pairing needs a start at which no answer was outstanding. Without
such a start (the oldest pieces were dropped, or bytes came that answer no command), pairing starts again at the next
command before which the wire was quiet.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from dmc41x3.wire.framing import RecordReply, Reply
from dmc41x3.wire.transcript import ConnectionTranscript, WirePiece

QUIET = 0.02
"""After this time without a byte no answer is outstanding [s]."""


class RecordedExchange(NamedTuple):
    """A command and its answer, None without one yet; the times at which each was complete [s], and the connection."""

    time: float
    link: int
    command: str
    reply: Reply | RecordReply | None
    answered: float | None


class Unpaired(NamedTuple):
    """Bytes of the controller that answer no command: a command is missing before them, or they were inserted."""

    time: float
    link: int
    data: bytes


class RecordedTalk(NamedTuple):
    """The traffic of all connections: exchanges by the time of their command, stray bytes, programs' messages."""

    exchanges: list[RecordedExchange]
    unpaired: list[Unpaired]
    messages: list[tuple[float, str]]


def talk(pieces: Iterable[WirePiece]) -> RecordedTalk:
    """Return the exchanges of the wire."""
    links: dict[int, list[WirePiece]] = {}
    for piece in pieces:
        links.setdefault(piece.link, []).append(piece)
    found = RecordedTalk([], [], [])
    for link in links.values():
        _take_apart(link, found)
    found.exchanges.sort(key=lambda exchange: exchange.time)
    found.unpaired.sort(key=lambda unpaired: unpaired.time)
    found.messages.sort(key=lambda message: message[0])
    return found


def _take_apart(pieces: Sequence[WirePiece], found: RecordedTalk) -> None:
    place = 0 if pieces[0].event == "open" else next(_beginnings(pieces, 0), len(pieces))
    while place < len(pieces):
        place = _stretch(pieces, place, found)


def _beginnings(pieces: Sequence[WirePiece], start: int) -> Iterator[int]:
    """Yield the index of every opening, and of every command that seems to follow the replies to all earlier ones."""
    heard: WirePiece | None = pieces[start - 1] if start else None
    for place in range(start, len(pieces)):
        piece = pieces[place]
        if piece.event == "open":
            yield place
        if piece.data and piece.side == "client":
            silent = heard is None or (heard.side == "controller" and piece.time - heard.time >= QUIET)
            if place == 0 or silent:
                yield place
        if piece.data:
            heard = piece


def _stretch(pieces: Sequence[WirePiece], start: int, found: RecordedTalk) -> int:
    """Pair a conversation up to its end, or to the first bytes that answer no command; return where to continue."""
    conversation = ConnectionTranscript()
    answered: list[float] = []
    told = 0
    for place in range(start, len(pieces)):
        piece = pieces[place]
        if piece.side == "client":
            conversation.said(piece.data, piece.time)
            continue
        conversation.heard(piece.data)
        answered += [piece.time] * (conversation.answered - len(answered))
        found.messages.extend((piece.time, text) for text in conversation.messages[told:])
        told = len(conversation.messages)
        if conversation.stray:
            found.unpaired.append(Unpaired(piece.time, piece.link, conversation.stray))
            _add(conversation, answered, piece.link, found)
            return next(_beginnings(pieces, place + 1), len(pieces))
    _add(conversation, answered, pieces[start].link, found)
    return len(pieces)


def _add(conversation: ConnectionTranscript, answered: list[float], link: int, found: RecordedTalk) -> None:
    for number, one in enumerate(conversation.exchanges):
        when = answered[number] if number < len(answered) else None
        found.exchanges.append(RecordedExchange(one.time, link, one.command, one.reply, when))
