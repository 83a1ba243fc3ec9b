"""A message as a picture: its text is the bytes of the pixels (PNG, ISO/IEC 15948), for `compression` png.

Pictures are written as rosbridge writes them: nearly square, red, green, blue, padded with line ends. Clients may send
any of the 8 bit forms. Pillow unpacks their pixels and sees nothing else of their files (decision 47).
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Iterator
from math import ceil, isqrt

from maya_un.errors import InvalidRequest

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
        raise InvalidRequest(key="data", reason=f"it is not a PNG picture of a text ({error})") from error


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _chunks(picture: bytes) -> Iterator[tuple[bytes, bytes]]:
    if not picture.startswith(_SIGNATURE):
        raise ValueError("no signature")
    place = len(_SIGNATURE)
    while place < len(picture):
        length, kind = struct.unpack_from(">I4s", picture, place)
        data = picture[place + 8 : place + 8 + length]
        (sum_,) = struct.unpack_from(">I", picture, place + 8 + length)
        if sum_ != zlib.crc32(kind + data):
            raise ValueError("a check sum is wrong")
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
        raise ValueError("it is read with 8 bits a channel and not interlaced")
    stride = len(mode) * width
    if not 0 < width < _WIDEST or not 0 < height < _WIDEST or stride * height > most + 4 * stride:
        raise ValueError(f"it has more than {most} bytes")
    return _pixels(mode, (width, height), b"".join(packed)).decode().rstrip("\n")


def _pixels(mode: str, size: tuple[int, int], packed: bytes) -> bytes:
    """Return the pixels of rows that each begin with how they are filtered; unpacks no more than fits in `size`.

    Pillow does not open the file: it would unpack colour profiles and comments as well, whose size nothing bounds.
    """
    from PIL import Image  # noqa: PLC0415 - few clients send pictures

    pixels = Image.frombytes(mode, size, packed, "zip", mode).tobytes()
    if b"\0" in pixels:  # Pillow leaves missing rows zero, which no JSON holds
        raise ValueError("rows are missing")
    return pixels
