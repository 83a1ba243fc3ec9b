"""Recordings as MCAP files: indexed, compressed, with JSON schemas that viewers read.

Import this module only where a file is written or read: a robot that saves no recording does not need its library.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from heapq import merge
from pathlib import Path
from typing import IO, Any, NamedTuple, TypeVar

from mcap import writer as library
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from pydantic import TypeAdapter, ValidationError

from dmc41x3.files import unreadable
from dmc41x3.i18n import phrase
from dmc41x3.wire.framing import RecordReply
from dmc41x3.wire.transcript import WirePiece
from maya_un.axes import AXES
from maya_un.errors import FileUnreadable
from maya_un.events import Event, event_of
from maya_un.recorder import exchanges
from maya_un.recorder.exchanges import RecordedExchange
from maya_un.recorder.recording import Header, Recording, TimeSpan, plain
from maya_un.validation import reason_of
from maya_un.values import Mode, State

_NUMBER: dict[str, Any] = {"type": "number"}
_TEXT: dict[str, Any] = {"type": "string"}
_WHOLE: dict[str, Any] = {"type": "integer"}
_TRUTH: dict[str, Any] = {"type": "boolean"}


class RecordedTopic(NamedTuple):
    """A topic: its name, the name of its schema, and the schema."""

    name: str
    schema_name: str
    schema: dict[str, Any]


def _described(kind: dict[str, Any], description: str) -> dict[str, Any]:
    return {**kind, "description": description}


def _three(kind: dict[str, Any], description: str, *, optional: bool = False) -> dict[str, Any]:
    types = ["array", "null"] if optional else "array"
    return {"type": types, "items": kind, "minItems": 3, "maxItems": 3, "description": description}


def _maybe(properties: dict[str, Any], description: str) -> dict[str, Any]:
    return {"type": ["object", "null"], "properties": properties, "description": description}


def _object(title: str, properties: dict[str, Any]) -> dict[str, Any]:
    required = list(properties)
    return {"title": title, "type": "object", "properties": properties, "required": required}


_TIME = _described(_NUMBER, "clock of the program's event loop [s]")

STATE = RecordedTopic(
    "/state",
    "maya.State",
    _object(
        "Latest known state of the machine, at every sample",
        {
            "time": _TIME,
            "mode": {"type": "string", "enum": [mode.value for mode in Mode]},
            "homed": _TRUTH,
            "counts": _three(_WHOLE, "encoder positions of axes a, b, c [counts]"),
            "joints": _three(_NUMBER, "a [rad], b, c [m]; null before homing", optional=True),
            "point": _three(_NUMBER, "x, y, z of the gripper [m]; null where not known", optional=True),
            "velocity": _three(_NUMBER, "of a [rad/s], b, c [m/s]"),
            "moving": _TRUTH,
            "motors_on": _three(_TRUTH, "of a, b, c"),
            "forward_limit": _three(_TRUTH, "switches of a, b, c, true where active"),
            "reverse_limit": _three(_TRUTH, "switches of a, b, c, true where active"),
            "stop_code": _three(_WHOLE, "why a, b, c stopped last (Galil SC)"),
            "gripper_closed": _TRUTH,
            "progress": _maybe(
                {"phase": _TEXT, "elapsed": _NUMBER, "duration": _NUMBER}, "of the motion under way [s]"
            ),
            "fault": _maybe({"code": _WHOLE, "message": _TEXT}, "what waits for a person to recover"),
            "override": _described(_NUMBER, "factor on the speed of all motion"),
        },
    ),
)

EVENTS = RecordedTopic(
    "/events",
    "maya.Event",
    _object(
        "A fact, in order",
        {
            "seq": _described(_WHOLE, "number, from 1 without gaps"),
            "time": _TIME,
            "kind": _TEXT,
            "code": _described(_WHOLE, "0, or an error's"),
            "detail": {"type": "object"},
        },
    ),
)

WIRE = RecordedTopic(
    "/wire",
    "maya.Wire",
    {
        **_object(
            "Bytes between this program and the controller, as sent and received",
            {
                "t": _TIME,
                "link": _described(_WHOLE, "number of the connection"),
                "from": {"type": "string", "enum": ["client", "controller"], "description": "the client is Maya"},
                "data": _described(_TEXT, "each byte as the character of its number (Latin-1)"),
                "event": {"type": "string", "enum": ["open", "end"], "description": "instead of data"},
            },
        ),
        "required": ["t", "link", "from"],
    },
)

EXCHANGES = RecordedTopic(
    "/exchanges",
    "maya.Exchange",
    _object(
        "A command with what answered it, where that is known; at the time of the command",
        {
            "t": _TIME,
            "link": _WHOLE,
            "command": _TEXT,
            "took": _described({"type": ["number", "null"]}, "time to the answer [s], null without one"),
            "ok": {"type": ["boolean", "null"], "description": "whether it was accepted, null without an answer"},
            "reply": _described(_TEXT, "what it printed; of a data record its bytes (Latin-1)"),
        },
    ),
)

_JOINT = {
    "type": "object",
    "properties": {
        "name": {"type": "string", "enum": list(AXES)},
        "position": _described(_NUMBER, "[rad], [m]"),
        "velocity": _described(_NUMBER, "[rad/s], [m/s]"),
    },
}

JOINTS = RecordedTopic(
    "/joint_states",
    "foxglove.JointStates",
    _object(
        "Joints of the robot, once homed",
        {
            "timestamp": {"type": "object", "properties": {"sec": _WHOLE, "nsec": _WHOLE}},
            "joints": {"type": "array", "items": _JOINT},
        },
    ),
)

TOPICS = (STATE, EVENTS, WIRE, EXCHANGES, JOINTS)
"""All topics. `/exchanges` and `/joint_states` follow from the others and are for viewers alone."""


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
    channels = {topic.name: _channel(writer, topic) for topic in TOPICS}
    for number, message in enumerate(merge(*_messages(recording), key=lambda message: message.time)):
        stamp = max(0, recording.header.utc_at(message.time))
        writer.add_message(channels[message.topic.name], stamp, message.data, stamp, number)
    writer.finish()


def read(path: Path) -> Recording:
    """Return the recording in a file; raises `FileUnreadable` for an invalid or damaged file."""
    return _reading(path, read_from)


def read_header(path: Path) -> Header:
    """Return the header of the recording in a file, without reading the rest; raises `FileUnreadable`."""
    return _reading(path, _header)


def _compression() -> CompressionType:
    """Return the best available compression of the library."""
    if getattr(library, "zstandard", None) is not None:
        return CompressionType.ZSTD
    return CompressionType.NONE if getattr(library, "lz4", None) is None else CompressionType.LZ4


def _channel(writer: Writer, topic: RecordedTopic) -> int:
    schema = writer.register_schema(topic.schema_name, "jsonschema", json.dumps(topic.schema).encode())
    return writer.register_channel(topic.name, "json", schema)


def _messages(recording: Recording) -> Iterator[Iterator[_McapMessage]]:
    """Yield the messages of each topic, in order.

    They are created one at a time, so that no large data is held at once. The writer shares the interpreter with a
    robot.
    """
    header, states = recording.header, _states()
    homed = (state for state in recording.states if state.joints is not None)
    talk = exchanges.talk(recording.wire)
    yield (_McapMessage(state.time, STATE, states.dump_json(state)) for state in recording.states)
    yield (_McapMessage(state.time, JOINTS, _joints(header, state)) for state in homed)
    yield (_McapMessage(event.time, EVENTS, _event(event)) for event in recording.events)
    yield (_McapMessage(piece.time, WIRE, _wire(piece)) for piece in recording.wire)
    yield (_McapMessage(exchange.time, EXCHANGES, _exchange(exchange)) for exchange in talk.exchanges)


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
    with readable(path) as file:
        return reader(file)


@contextmanager
def readable(path: Path) -> Iterator[IO[bytes]]:
    """Open the file of a recording; an error of the block, which reads it, becomes `FileUnreadable`."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise unreadable(path, error) from error
    except ValidationError as error:
        reason = reason_of(error.errors(include_url=False)[0])
        raise FileUnreadable(path=path, reason=phrase("it is no recording: {reason}", reason=reason)) from error
    except Exception as error:  # a damaged file makes the library raise any error of its parts
        words = str(error) or type(error).__name__
        raise FileUnreadable(path=path, reason=phrase("it is no recording: {reason}", reason=words)) from error


def _header(file: IO[bytes]) -> Header:
    for record in make_reader(file, validate_crcs=True).iter_metadata():
        if record.name == METADATA:
            return Header.from_json(record.metadata["header"])
    raise ValueError(phrase("it holds no {name}", name=METADATA))


def read_from(file: IO[bytes]) -> Recording:
    """Return the recording in an open file; an invalid file raises any error of the library."""
    header = _header(file)
    file.seek(0)
    states: list[State] = []
    events: list[Event] = []
    wire: list[WirePiece] = []
    topics = [STATE.name, EVENTS.name, WIRE.name]
    reader = make_reader(file, validate_crcs=True)
    for _, channel, message in reader.iter_messages(topics, log_time_order=False):
        if channel.topic == STATE.name:
            states.append(_states().validate_json(message.data))
        elif channel.topic == EVENTS.name:
            events.append(_read_event(json.loads(message.data)))
        else:
            wire.append(_read_piece(json.loads(message.data)))
    return Recording(header, tuple(states), tuple(events), tuple(wire))


def read_some(path: Path, span: TimeSpan | None, *topics: RecordedTopic) -> Iterator[tuple[str, Any]]:
    """Yield the content of the messages of `topics`, in the order of time, each with the name of its topic.

    States are `State`, events are `Event`, others plain data. Reads only the parts of the file that contain the `span`,
    None for all of it. Raises `FileUnreadable`.
    """
    with readable(path) as file:
        begin, end = (None, None) if span is None else span.of(_header(file))
        file.seek(0)
        messages = make_reader(file, validate_crcs=True).iter_messages(
            [topic.name for topic in topics], starting_at=begin, ending_before=end
        )
        for _, channel, message in messages:
            yield channel.topic, _content(channel.topic, message.data)


def _content(topic: str, data: bytes) -> Any:
    if topic == STATE.name:
        return _states().validate_json(data)
    found = json.loads(data)
    return _read_event(found) if topic == EVENTS.name else found


def _read_event(found: dict[str, Any]) -> Event:
    kind, code, seq, time = str(found["kind"]), int(found["code"]), int(found["seq"]), float(found["time"])
    return event_of(kind, dict(found["detail"]), code, seq=seq, time=time)


def _read_piece(found: dict[str, Any]) -> WirePiece:
    side = found["from"]
    if side not in {"client", "controller"}:
        raise ValueError(phrase("unknown sender {side!r}", side=side))
    event = str(found.get("event", ""))
    data = b"" if event else str(found["data"]).encode("latin-1")
    return WirePiece(float(found["t"]), int(found["link"]), side, data, event)


@cache
def _states() -> TypeAdapter[State]:
    return TypeAdapter(State)
