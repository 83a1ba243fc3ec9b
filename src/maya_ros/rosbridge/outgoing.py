"""Messages to clients as JSON, CBOR or PNG; each form is made once for all clients.

Pictures are written as rosbridge writes them: nearly square, red, green, blue, padded with line ends. Clients may send
any of the 8 bit forms. Pillow unpacks their pixels and reads nothing else of their files (decision 47).

The conversion of a type is computed once. Messages of unknown types are sent unchanged.
"""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from math import ceil, isfinite, isqrt
from typing import Any, NamedTuple

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.catalogue import SCALAR, Field, is_base, spec
from maya_ros.graph.protocol import Message, stamp
from maya_ros.graph.validation import BYTES
from maya_ros.rosbridge import incoming
from maya_un.errors import InvalidRequest, UnknownInterface
from maya_un.http.stream.messages import BINARY, framed

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MODES = {0: "L", 2: "RGB", 4: "LA", 6: "RGBA"}
"""Pillow's name of each type of colour: a letter for each channel."""

_WIDEST = 1 << 16


def encoded(text: str) -> str:
    """Return the picture of a text, in base64."""
    content = text.encode()
    width = max(1, isqrt(len(content) // 3))
    height = max(1, ceil(len(content) / 3 / width))
    stride = 3 * width
    content += b"\n" * (stride * height - len(content))
    rows = b"".join(b"\0" + content[begin : begin + stride] for begin in range(0, len(content), stride))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = ((b"IHDR", head), (b"IDAT", zlib.compress(rows, 6)), (b"IEND", b""))
    return base64.b64encode(_SIGNATURE + b"".join(_chunk(kind, data) for kind, data in parts)).decode()


def decoded(data: str, most: int) -> str:
    """Return the text of a picture in base64, of at most `most` bytes; raises `InvalidRequest`."""
    try:
        return _text(base64.b64decode(data, validate=True), most)
    except (ValueError, struct.error) as error:
        raise InvalidRequest(
            key="data", reason=phrase("it is not a PNG picture of a text ({error})", error=error)
        ) from error


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _chunks(picture: bytes) -> Iterator[tuple[bytes, bytes]]:
    if not picture.startswith(_SIGNATURE):
        raise ValueError(phrase("no signature"))
    place = len(_SIGNATURE)
    while place < len(picture):
        length, kind = struct.unpack_from(">I4s", picture, place)
        data = picture[place + 8 : place + 8 + length]
        (sum_,) = struct.unpack_from(">I", picture, place + 8 + length)
        if sum_ != zlib.crc32(kind + data):
            raise ValueError(phrase("a check sum is wrong"))
        yield kind, data
        place += 12 + length


def _text(picture: bytes, most: int) -> str:
    head, packed = b"", list[bytes]()
    for kind, data in _chunks(picture):
        if kind == b"IHDR":
            head = data
        elif kind == b"IDAT":
            packed.append(data)
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", head)
    mode = _MODES.get(colour)
    if depth != 8 or mode is None or interlaced:
        raise ValueError(phrase("it is read with 8 bits a channel and not interlaced"))
    stride = len(mode) * width
    if not 0 < width < _WIDEST or not 0 < height < _WIDEST or stride * height > most + 4 * stride:
        raise ValueError(phrase("it has more than {most} bytes", most=most))
    return _pixels(mode, (width, height), b"".join(packed)).decode().rstrip("\n")


def _pixels(mode: str, size: tuple[int, int], packed: bytes) -> bytes:
    """Return the pixels of rows that each begin with their filter type; unpacks no more than fits in `size`.

    Pillow does not open the file, because it would also unpack colour profiles and comments of unlimited size.
    """
    from PIL import Image  # noqa: PLC0415 - few clients send pictures

    pixels = Image.frombytes(mode, size, packed, "zip", mode).tobytes()
    if b"\0" in pixels:  # Pillow leaves missing rows zero, which no JSON holds
        raise ValueError(phrase("rows are missing"))
    return pixels


Form = Callable[[Any], Any]

_PACKED = {
    "uint16": (69, "H"), "uint32": (70, "I"), "uint64": (71, "Q"), "int8": (72, "b"), "byte": (72, "b"),
    "int16": (77, "h"), "int32": (78, "i"), "int64": (79, "q"), "float32": (85, "f"), "float64": (86, "d"),
}  # fmt: skip
"""The tag of an array of numbers, little-endian (RFC 8746), and how it is packed."""

_encoder = json.JSONEncoder(ensure_ascii=False, check_circular=False, allow_nan=False, separators=(",", ":"))


def as_json(kind: str, message: Message) -> str:
    """Return a message of a type as JSON; numbers that JSON lacks (NaN, infinity) become null."""
    form = _json_form(kind)
    return text_of(message if form is None else form(message))


def text_of(value: Any) -> str:
    """Return plain data as JSON; numbers that JSON lacks become null."""
    try:
        return _encoder.encode(value)
    except ValueError:
        return _encoder.encode(_finite(value))


def as_plain(kind: str, message: Message) -> Message:
    """Return the plain data that `as_json` encodes."""
    form = _json_form(kind)
    return message if form is None else form(message)


def as_cbor(kind: str, message: Message) -> Any:
    """Return the data of a message for CBOR."""
    form = _cbor_form(kind)
    return message if form is None else form(message)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return value


@cache
def _json_form(kind: str) -> Form | None:
    return _form(kind, _json_field)


@cache
def _cbor_form(kind: str) -> Form | None:
    return _form(kind, _cbor_field)


def _form(kind: str, of_field: Callable[[Field], Form | None]) -> Form | None:
    """Return the conversion of the fields that need one, None if no field does."""
    try:
        fields = spec(kind).fields
    except UnknownInterface:
        return None
    changed = [(field.name, form) for field in fields if (form := of_field(field)) is not None]
    if not changed:
        return None
    return lambda message: {**message, **{name: form(message[name]) for name, form in changed}}


def _json_field(field: Field) -> Form | None:
    if field.length != SCALAR and field.type in BYTES:
        return lambda values: base64.b64encode(bytes(values)).decode()
    return None if is_base(field.type) else _each(_json_form(field.type), field)


def _cbor_field(field: Field) -> Form | None:
    if field.length != SCALAR and field.type in BYTES:
        return bytes
    if field.length != SCALAR and field.type in _PACKED:
        from cbor2 import CBORTag  # noqa: PLC0415 - few clients request CBOR

        tag, code = _PACKED[field.type]
        return lambda values: CBORTag(tag, struct.pack(f"<{len(values)}{code}", *values))
    return None if is_base(field.type) else _each(_cbor_form(field.type), field)


def _each(form: Form | None, field: Field) -> Form | None:
    if form is None or field.length == SCALAR:
        return form
    return lambda values: [form(value) for value in values]


COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
"""Compressions of messages, the weakest first: the strongest that a client requests is used."""


class MessageFormat(NamedTuple):
    """Format of a topic's messages for a client, which calls the topic `name`; `fragment` 0 sends whole messages."""

    name: str
    compression: str = "none"
    fragment: int = 0


class Outgoing:
    """One message of a type, received at `now` [s since the epoch]."""

    def __init__(self, kind: str, message: Message, now: float) -> None:
        self.message = message
        self._kind = kind
        self._now = now
        self._text: str | None = None
        self._frames: dict[MessageFormat, bytes] = {}

    def frames(self, form: MessageFormat) -> bytes:
        """Return complete websocket frames."""
        made = self._frames.get(form)
        if made is None:
            made = self._frames[form] = self._made(form)
        return made

    def _made(self, form: MessageFormat) -> bytes:
        if form.compression == "cbor":
            return self._binary(form.name, as_cbor(self._kind, self.message))
        if form.compression == "cbor-raw":
            return self._binary(form.name, {**stamp(self._now), "bytes": types.serialize(self._kind, self.message)})
        if self._text is None:
            self._text = as_json(self._kind, self.message)
        text = f'{{"op":"publish","topic":{json.dumps(form.name)},"msg":{self._text}}}'
        return shaped(text, form.compression, form.fragment)

    @staticmethod
    def _binary(name: str, content: object) -> bytes:
        from cbor2 import dumps  # noqa: PLC0415 - few clients request CBOR

        return framed(dumps({"op": "publish", "topic": name, "msg": content}), BINARY)


def shaped(text: str, compression: str, fragment: int, name: str | float | None = None) -> bytes:
    """Return a message in JSON as frames, as a picture and in fragments if requested."""
    if compression == "png":
        text = json.dumps({"op": "png", "data": encoded(text)})
    if fragment and len(text) > fragment:
        return b"".join(framed(piece.encode()) for piece in incoming.cut(text, fragment, name))
    return framed(text.encode("utf-8", "replace"))


class MessageEncoder:
    """Encodes received messages, the latest of every topic once for all clients that subscribe to it."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self._latest: dict[tuple[str, str], Outgoing] = {}
        self._readers = Counter[tuple[str, str]]()

    def join(self, topic: str, kind: str) -> None:
        """Add a subscriber of a topic."""
        self._readers[topic, kind] += 1

    def leave(self, topic: str, kind: str) -> None:
        """Remove a subscriber; without subscribers, the latest message is dropped."""
        self._readers[topic, kind] -= 1
        if not self._readers[topic, kind]:
            del self._readers[topic, kind]
            self._latest.pop((topic, kind), None)

    def outgoing(self, topic: str, kind: str, message: Message) -> Outgoing:
        """Return the outgoing form of a message from a topic, the same for all subscribers."""
        latest = self._latest.get((topic, kind))
        if latest is None or latest.message is not message:
            latest = self._latest[topic, kind] = Outgoing(kind, message, self.now())
        return latest
