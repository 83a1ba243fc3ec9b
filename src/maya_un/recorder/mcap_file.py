"""Recordings as MCAP files: indexed, compressed where the library can, every message JSON with its schema.

To be imported late: a robot that never fails needs no library for it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import cache
from heapq import merge
from pathlib import Path
from typing import IO, Any, NamedTuple, TypeVar

from mcap import writer as library
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from pydantic import TypeAdapter, ValidationError

from dmc41x3.wire.framing import RecordReply
from dmc41x3.wire.transcript import WirePiece
from maya_un.errors import FileUnreadable
from maya_un.events import Event, event_of
from maya_un.recorder import exchanges, schemas
from maya_un.recorder.exchanges import RecordedExchange
from maya_un.recorder.header import Header, plain
from maya_un.recorder.recording import Recording
from maya_un.recorder.schemas import RecordedTopic
from maya_un.values import AXES, State

T = TypeVar("T")

PROFILE = "maya"
METADATA = "maya-recording"
"""Name of the record in the file that holds the header."""


class _McapMessage(NamedTuple):
    """A message before it is written: loop time [s], topic, content."""

    time: float
    topic: RecordedTopic
    data: bytes


def write(recording: Recording, file: IO[bytes]) -> None:
    """Write a recording; messages are in the order of their times."""
    writer = Writer(file, compression=_compression())
    writer.start(profile=PROFILE, library=f"maya-un {recording.header.software.maya_un}")
    writer.add_metadata(METADATA, {"header": recording.header.to_json()})
    channels = {topic.name: _channel(writer, topic) for topic in schemas.TOPICS}
    for number, message in enumerate(merge(*_messages(recording), key=lambda message: message.time)):
        stamp = max(0, recording.header.utc_at(message.time))
        writer.add_message(channels[message.topic.name], stamp, message.data, stamp, number)
    writer.finish()


def read(path: Path) -> Recording:
    """Return the recording in a file; raises `FileUnreadable` for what is none, or damaged."""
    return _reading(path, read_from)


def read_header(path: Path) -> Header:
    """Return the header of the recording in a file, and read no more of it; raises `FileUnreadable`."""
    return _reading(path, _header)


def _compression() -> CompressionType:
    """Return what the library can compress with here, the best first."""
    if getattr(library, "zstandard", None) is not None:
        return CompressionType.ZSTD
    return CompressionType.NONE if getattr(library, "lz4", None) is None else CompressionType.LZ4


def _channel(writer: Writer, topic: RecordedTopic) -> int:
    schema = writer.register_schema(topic.schema_name, "jsonschema", json.dumps(topic.schema).encode())
    return writer.register_channel(topic.name, "json", schema)


def _messages(recording: Recording) -> Iterator[Iterator[_McapMessage]]:
    """Yield the messages of each topic, in order; one after the other, so that nothing large is held or let go at once.

    The writer shares the interpreter with a robot.
    """
    header, states = recording.header, _states()
    homed = (state for state in recording.states if state.joints is not None)
    talk = exchanges.talk(recording.wire)
    yield (_McapMessage(state.time, schemas.STATE, states.dump_json(state)) for state in recording.states)
    yield (_McapMessage(state.time, schemas.JOINTS, _joints(header, state)) for state in homed)
    yield (_McapMessage(event.time, schemas.EVENTS, _event(event)) for event in recording.events)
    yield (_McapMessage(piece.time, schemas.WIRE, _wire(piece)) for piece in recording.wire)
    yield (_McapMessage(exchange.time, schemas.EXCHANGES, _exchange(exchange)) for exchange in talk.exchanges)


def _joints(header: Header, state: State) -> bytes:
    sec, nsec = divmod(max(0, header.utc_at(state.time)), 1_000_000_000)
    joints = [
        {"name": name, "position": position, "velocity": velocity}
        for name, position, velocity in zip(AXES, state.joints or (), state.velocity, strict=True)
    ]
    return json.dumps({"timestamp": {"sec": sec, "nsec": nsec}, "joints": joints}).encode()


def _event(event: Event) -> bytes:
    found = {"seq": event.seq, "time": event.time, "kind": event.kind, "code": event.code}
    return json.dumps({**found, "detail": plain(event.detail)}).encode()


def _wire(piece: WirePiece) -> bytes:
    what = {"event": piece.event} if piece.event else {"data": piece.data.decode("latin-1")}
    return json.dumps({"t": piece.time, "link": piece.link, "from": piece.side, **what}).encode()


def _exchange(exchange: RecordedExchange) -> bytes:
    reply = exchange.reply
    text = "" if reply is None else reply.data.decode("latin-1") if isinstance(reply, RecordReply) else reply.text
    ok = None if reply is None else isinstance(reply, RecordReply) or reply.ok
    took = None if exchange.answered is None else exchange.answered - exchange.time
    found = {"t": exchange.time, "link": exchange.link, "command": exchange.command, "took": took}
    return json.dumps({**found, "ok": ok, "reply": text}).encode()


def _reading(path: Path, reader: Callable[[IO[bytes]], T]) -> T:
    try:
        with path.open("rb") as file:
            return reader(file)
    except OSError as error:
        raise FileUnreadable(path=path, reason=error.strerror or str(error)) from error
    except ValidationError as error:
        reason = error.errors(include_url=False)[0]["msg"]
        raise FileUnreadable(path=path, reason=f"it is no recording: {reason}") from error
    except Exception as error:  # a damaged file makes the library raise whatever its parts raise
        words = str(error) or type(error).__name__
        raise FileUnreadable(path=path, reason=f"it is no recording: {words}") from error


def _header(file: IO[bytes]) -> Header:
    for record in make_reader(file, validate_crcs=True).iter_metadata():
        if record.name == METADATA:
            return Header.from_json(record.metadata["header"])
    raise ValueError(f"it holds no {METADATA}")


def read_from(file: IO[bytes]) -> Recording:
    """Return the recording that an open file holds; what is none raises whatever the library does."""
    header = _header(file)
    file.seek(0)
    states: list[State] = []
    events: list[Event] = []
    wire: list[WirePiece] = []
    topics = [schemas.STATE.name, schemas.EVENTS.name, schemas.WIRE.name]
    reader = make_reader(file, validate_crcs=True)
    for _, channel, message in reader.iter_messages(topics, log_time_order=False):
        if channel.topic == schemas.STATE.name:
            states.append(_states().validate_json(message.data))
        elif channel.topic == schemas.EVENTS.name:
            events.append(_read_event(json.loads(message.data)))
        else:
            wire.append(_read_piece(json.loads(message.data)))
    return Recording(header, tuple(states), tuple(events), tuple(wire))


def _read_event(found: dict[str, Any]) -> Event:
    kind, code, seq, time = str(found["kind"]), int(found["code"]), int(found["seq"]), float(found["time"])
    return event_of(kind, dict(found["detail"]), code, seq=seq, time=time)


def _read_piece(found: dict[str, Any]) -> WirePiece:
    side = found["from"]
    if side not in {"client", "controller"}:
        raise ValueError(f"nobody is called {side!r}")
    event = str(found.get("event", ""))
    data = b"" if event else str(found["data"]).encode("latin-1")
    return WirePiece(float(found["t"]), int(found["link"]), side, data, event)


@cache
def _states() -> TypeAdapter[State]:
    return TypeAdapter(State)
