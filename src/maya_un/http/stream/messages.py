"""The messages of the websocket, both ways: JSON objects that say by `type` what they are."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import isfinite
from operator import attrgetter
from typing import Any

from maya_un.errors import InvalidRequest, MayaError
from maya_un.http.stream.wire import framed
from maya_un.process.spec.json_object import decode_object
from maya_un.schema.encoding import to_json
from maya_un.schema.robot import EventMessage
from maya_un.values import State

PROTOCOL = 1
"""Version of this protocol; one that a client of an older one would misread has another."""

SLOWEST, FASTEST = 0.1, 100.0
"""Rates at which states may be asked for [Hz]."""

_KEYS: dict[str, frozenset[str]] = {
    "hello": frozenset({"token", "protocol"}),
    "subscribe": frozenset({"state", "events", "queue"}),
    "ping": frozenset(),
    "renew": frozenset({"lease", "bound"}),
}
"""Messages of a client, with their keys besides `type` and `id`."""


@dataclass(frozen=True, slots=True)
class ReplayStart:
    """From where events are wanted: those numbered above `since` (None: from now on) of `run` (None: this one)."""

    since: int | None = None
    run: int | None = None


@dataclass(frozen=True, slots=True)
class StreamSubscription:
    """One `subscribe`: a missing key changes nothing (`named` lists the rest).

    `rate` [Hz] is None where states, `past` where events are not wanted.
    """

    named: frozenset[str]
    rate: float | None = None
    past: ReplayStart | None = None
    queue: bool = False


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object that a client sent; raises `InvalidRequest`."""
    return decode_object(text.encode() if isinstance(text, str) else text)


def kind_of(message: Mapping[str, Any]) -> str:
    """Return what a client's message is; raises `InvalidRequest` for what is none, or has a key that it cannot have."""
    kind = message.get("type")
    if not isinstance(kind, str) or kind not in _KEYS:
        raise InvalidRequest(key="type", reason=f"it is one of {', '.join(_KEYS)}")
    for key in message:
        if key not in _KEYS[kind] | {"type", "id"}:
            raise InvalidRequest(key=key, reason=f"a message of type {kind} has no such key")
    return kind


def subscription(message: Mapping[str, Any]) -> StreamSubscription:
    """Return what a `subscribe` wants; raises `InvalidRequest`."""
    queue = message.get("queue", False)
    if not isinstance(queue, bool):
        raise InvalidRequest(key="queue", reason="it is true or false")
    named = frozenset(message) & _KEYS["subscribe"]
    return StreamSubscription(named, _rate(message.get("state")), _past(message.get("events")), queue)


def _rate(wanted: object) -> float | None:
    if wanted is None:
        return None
    rate = _part(wanted, "state", frozenset({"rate"})).get("rate", 10.0)
    if not isinstance(rate, int | float) or isinstance(rate, bool) or not isfinite(rate):
        raise InvalidRequest(key="state.rate", reason="it is a number [Hz]")
    if not SLOWEST <= rate <= FASTEST:
        raise InvalidRequest(key="state.rate", reason=f"it is {SLOWEST:g} to {FASTEST:g} Hz")
    return float(rate)


def _past(wanted: object) -> ReplayStart | None:
    if wanted is None:
        return None
    part = _part(wanted, "events", frozenset({"since", "run"}))
    return ReplayStart(_number(part, "since", 0), _number(part, "run", 1))


def _part(wanted: object, name: str, keys: frozenset[str]) -> dict[str, Any]:
    if not isinstance(wanted, dict):
        raise InvalidRequest(key=name, reason="it is an object, or null")
    for key in wanted:
        if key not in keys:
            raise InvalidRequest(key=f"{name}.{key}", reason=f"there are {', '.join(sorted(keys))}")
    return wanted


def _number(part: Mapping[str, Any], key: str, least: int) -> int | None:
    value = part.get(key)
    if value is None:
        return None
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InvalidRequest(key=f"events.{key}", reason=f"it is a whole number, {least} or more")
    return value


_CONTENT = attrgetter(*(field.name for field in fields(State) if field.name != "time"))


def content(state: State) -> object:
    """Return what a state says besides its time: where that is the same nothing has changed."""
    return _CONTENT(state)


def state_frame(run: int, state: State) -> bytes:
    """Return the frame of a state."""
    return framed(b'{"type":"state","run":%d,"state":%b}' % (run, to_json(state)))


def event_frame(run: int, event: EventMessage) -> bytes:
    """Return the frame of an event."""
    return framed(b'{"type":"event","run":%d,"event":%b}' % (run, to_json(event)))


def queue_frame(view: object) -> bytes:
    """Return the frame of the queue as it stands."""
    return framed(b'{"type":"queue","queue":%b}' % to_json(view))


def plain_frame(kind: str, about: Mapping[str, Any] | None = None, **content: object) -> bytes:
    """Return the frame of any other message; it carries the `id` of the message it is `about`, if that had one."""
    message: dict[str, object] = {"type": kind}
    if about is not None and "id" in about:
        message["id"] = about["id"]
    return framed(json.dumps(message | content, default=str, ensure_ascii=False).encode("utf-8", "replace"))


def error_frame(error: MayaError, language: str, about: Mapping[str, Any] | None = None) -> bytes:
    """Return the frame of an error of ours: code, sentence, details."""
    details = {key: _plain(value) for key, value in error.details.items()}
    return plain_frame("error", about, code=error.code, message=error.text(language), details=details)


def _plain(value: object) -> object:
    finite = not isinstance(value, float) or isfinite(value)
    return value if finite and isinstance(value, str | int | float | None) else str(value)
