"""Messages of the stream, and the websocket connection that carries them.

Messages are JSON objects with a `type`. Frames shared by clients go directly to the transport. uvicorn handles the
handshake, reading, pings and closing. Only messages to many readers bypass it, since every layer above the transport
would cost as much again for each of a hundred readers.
"""

from __future__ import annotations

import json
import logging
import socket
import struct
from asyncio.transports import BaseTransport
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import inf, isfinite
from operator import attrgetter
from typing import Any

from uvicorn.config import Config
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.frames import Frame
from websockets.http11 import Request
from websockets.server import ServerProtocol

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest, MayaError
from maya_un.http.stream.topics import TOPICS, StreamTopic
from maya_un.process.spec.json_object import decode_object
from maya_un.schema.encoding import to_json
from maya_un.schema.robot import EventMessage
from maya_un.values import State

TEXT, BINARY = 0x81, 0x82


def framed(content: bytes, kind: int = TEXT) -> bytes:
    """Return `content` (a text in UTF-8) as one frame."""
    length = len(content)
    if length < 126:
        return bytes((kind, length)) + content
    if length < 65_536:
        return struct.pack("!BBH", kind, 126, length) + content
    return struct.pack("!BBQ", kind, 127, length) + content


WIRE = "maya.wire"
"""The key of a connection's wire among the extensions of its ASGI scope."""

LONGEST_MESSAGE = 65_536
"""Longest message that a client may send [bytes]."""

HIGH_WATER, LOW_WATER = 65_536, 16_384
"""Upper and lower limit of a write buffer [bytes]: above the first, writing pauses until it falls below the second."""

KERNEL_BUFFER = 262_144
"""Bytes that the kernel may buffer for a slow reader; without a limit it stores megabytes of old states."""

PING_INTERVAL, PING_TIMEOUT = 10.0, 20.0
"""Interval of pings, and time limit for their answer [s]."""

LINGER = 2.0
"""Time limit for the closing handshake; then the connection is cut [s]."""


SILENT = logging.getLogger("maya_un.http.silent")
"""Disabled logger for the library, which at debug level logs whole handshakes and messages, including tokens."""
SILENT.disabled = True


class StreamWire(WebSocketsSansIOProtocol):
    """One websocket connection. `on_room` is called when a slow reader accepts data again."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, object],
    ) -> None:
        super().__init__(config, server_state, app_state)
        self.conn = ServerProtocol(max_size=LONGEST_MESSAGE, logger=SILENT)
        self.ping_interval, self.ping_timeout = PING_INTERVAL, PING_TIMEOUT
        self.on_room: Callable[[], None] | None = None
        self.full = False

    def connection_made(self, transport: BaseTransport) -> None:
        """Limit the data buffered for a slow reader."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(HIGH_WATER, LOW_WATER)
        connection = transport.get_extra_info("socket")
        if connection is not None:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER)

    def handle_connect(self, event: Request) -> None:
        """Pass this wire to the application."""
        super().handle_connect(event)
        if not self.close_sent:
            self.scope["extensions"][WIRE] = self  # type: ignore[typeddict-unknown-key]

    def pause_writing(self) -> None:
        """Set `full`: the reader is too slow."""
        super().pause_writing()
        self.full = True

    def resume_writing(self) -> None:
        """Clear `full`, and call `on_room`."""
        super().resume_writing()
        self.full = False
        if self.on_room is not None:
            self.on_room()

    @property
    def over(self) -> bool:
        """Whether nothing more can be sent."""
        return self.close_sent or self.disconnected or self.transport.is_closing()

    def write(self, frames: bytes) -> None:
        """Send whole frames without waiting; drop them if the connection is over."""
        if not self.over:
            self.transport.write(frames)

    def end(self, code: int, reason: str) -> None:
        """Close with `code` and `reason` (at most 123 bytes); cut the connection of a client that does not respond."""
        if self.over:
            return
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
        self.conn.send_close(code, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        if self.read_paused:
            self.read_paused = False
            self.transport.resume_reading()
        self._linger()

    def handle_close(self, event: Frame) -> None:
        """Answer a client that closes; cut the connection if it does not take the answer."""
        super().handle_close(event)
        self._linger()

    def keepalive_timeout(self) -> None:
        """Cut the connection of a client that does not answer pings; its buffered data would never be read."""
        super().keepalive_timeout()
        self.transport.abort()

    def shutdown(self) -> None:
        """Close because the server ends; cut the connections of slow readers."""
        super().shutdown()
        if self.full:
            self.transport.abort()

    def _linger(self) -> None:
        if self.close_timer is None and not self.disconnected:
            self.close_timer = self.loop.call_later(LINGER, self.transport.abort)


PROTOCOL = 1
"""Version of this protocol; it changes if a client of the older version would misread messages."""

SLOWEST, FASTEST = 0.1, 100.0
"""Range of rates of states [Hz]."""

_KEYS: dict[str, frozenset[str]] = {
    "hello": frozenset({"token", "protocol", "language"}),
    "subscribe": frozenset({"state", "events", *TOPICS}),
    "ping": frozenset(),
    "renew": frozenset({"lease", "bound"}),
    "request": frozenset({"method", "path", "body", "lease", "language", "sent", "key"}),
}
"""Messages of a client, with their keys besides `type` and `id`."""


@dataclass(frozen=True, slots=True)
class ReplayStart:
    """First event of a replay: above number `since` (None: from now on) of `run` (None: the current run)."""

    since: int | None = None
    run: int | None = None


@dataclass(frozen=True, slots=True)
class StreamSubscription:
    """One `subscribe`: a missing key changes nothing (`named` lists the rest).

    `rate` [Hz] is None without states, `past` is None without events. `topics` are the wanted ones.
    """

    named: frozenset[str]
    rate: float | None = None
    past: ReplayStart | None = None
    topics: frozenset[StreamTopic] = frozenset()


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object that a client sent; raises `InvalidRequest`."""
    return decode_object(text.encode() if isinstance(text, str) else text)


def kind_of(message: Mapping[str, Any]) -> str:
    """Return the type of a client's message; raises `InvalidRequest` for an unknown type or key."""
    kind = message.get("type")
    if not isinstance(kind, str) or kind not in _KEYS:
        raise InvalidRequest(key="type", reason=phrase("it must be one of {choices}", choices=", ".join(_KEYS)))
    for key in message:
        if key not in _KEYS[kind] | {"type", "id"}:
            raise InvalidRequest(key=key, reason=phrase("a message of type {kind} has no such key", kind=kind))
    return kind


def subscription(message: Mapping[str, Any]) -> StreamSubscription:
    """Return the content of a `subscribe`; raises `InvalidRequest`."""
    named = frozenset(message) & _KEYS["subscribe"]
    for name in named & TOPICS.keys():
        if not isinstance(message[name], bool):
            raise InvalidRequest(key=name, reason="it must be true or false")
    topics = frozenset(topic for name, topic in TOPICS.items() if message.get(name))
    return StreamSubscription(named, _rate(message.get("state")), _past(message.get("events")), topics)


def _rate(wanted: object) -> float | None:
    if wanted is None:
        return None
    rate = _part(wanted, "state", frozenset({"rate"})).get("rate", 10.0)
    if not isinstance(rate, int | float) or isinstance(rate, bool) or not abs(rate) < inf:
        raise InvalidRequest(key="state.rate", reason="it must be a number [Hz]")
    if not SLOWEST <= rate <= FASTEST:
        raise InvalidRequest(
            key="state.rate", reason=phrase("it must be {least:g} to {most:g} Hz", least=SLOWEST, most=FASTEST)
        )
    return float(rate)


def _past(wanted: object) -> ReplayStart | None:
    if wanted is None:
        return None
    part = _part(wanted, "events", frozenset({"since", "run"}))
    return ReplayStart(_number(part, "since", 0), _number(part, "run", 1))


def _part(wanted: object, name: str, keys: frozenset[str]) -> dict[str, Any]:
    if not isinstance(wanted, dict):
        raise InvalidRequest(key=name, reason="it must be an object, or null")
    for key in wanted:
        if key not in keys:
            raise InvalidRequest(key=f"{name}.{key}", reason=phrase("there are {names}", names=", ".join(sorted(keys))))
    return wanted


def _number(part: Mapping[str, Any], key: str, least: int) -> int | None:
    value = part.get(key)
    if value is None:
        return None
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidRequest(
            key=f"events.{key}", reason=phrase("it must be a whole number, {least} or more", least=least)
        )
    return value


_CONTENT = attrgetter(*(field.name for field in fields(State) if field.name != "time"))


def content(state: State) -> object:
    """Return the content of a state without its time; equal contents mean that nothing has changed."""
    return _CONTENT(state)


def state_frame(run: int, state: State) -> bytes:
    """Return the frame of a state."""
    return framed(b'{"type":"state","run":%d,"state":%b}' % (run, to_json(state)))


def event_frame(run: int, event: EventMessage) -> bytes:
    """Return the frame of an event."""
    return framed(b'{"type":"event","run":%d,"event":%b}' % (run, to_json(event)))


def topic_frame(name: str, value: object) -> bytes:
    """Return the frame of a topic."""
    return framed(b'{"type":"%b","%b":%b}' % (name.encode(), name.encode(), to_json(value)))


def response_frame(status: int, content: bytes, about: Mapping[str, Any]) -> bytes:
    """Return the frame of the answer to the request `about`; `content` is JSON, b"" for none."""
    id_ = b'"id":%b,' % json.dumps(about["id"]).encode() if "id" in about else b""
    return framed(b'{"type":"response",%b"status":%d,"body":%b}' % (id_, status, content or b"null"))


def plain_frame(kind: str, about: Mapping[str, Any] | None = None, **content: object) -> bytes:
    """Return the frame of any other message; it carries the `id` of the message it is `about`, if that had one."""
    message: dict[str, object] = {"type": kind}
    if about is not None and "id" in about:
        message["id"] = about["id"]
    return framed(json.dumps(message | content, default=str, ensure_ascii=False).encode("utf-8", "replace"))


def error_frame(error: MayaError, language: str, about: Mapping[str, Any] | None = None) -> bytes:
    """Return the frame of an error of Maya: code, message, details."""
    details = {key: _plain(value) for key, value in error.details.items()}
    return plain_frame("error", about, code=error.code, message=error.text(language), details=details)


def _plain(value: object) -> object:
    finite = not isinstance(value, float) or isfinite(value)
    return value if finite and isinstance(value, str | int | float | None) else str(value)
