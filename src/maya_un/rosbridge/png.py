"""A message as a picture: its text is the bytes of the pixels (PNG, ISO/IEC 15948), for `compression` png.

Pictures are written as rosbridge writes them: nearly square, red, green, blue, padded with line ends. Those of clients
may have any of the 8 bit forms.
"""

from __future__ import annotations

import base64
import binascii
import struct
import zlib
from collections.abc import Iterator
from math import ceil, isqrt

from maya_un.errors import InvalidRequest

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}
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
    except (binascii.Error, UnicodeDecodeError, ValueError, struct.error, zlib.error) as error:
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
    head, packed = b"", b""
    for kind, data in _chunks(picture):
        if kind == b"IHDR":
            head = data
        elif kind == b"IDAT":
            packed += data
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", head)
    if depth != 8 or colour not in _CHANNELS or interlaced:
        raise ValueError("it is read with 8 bits a channel and not interlaced")
    stride = _CHANNELS[colour] * width
    size = (stride + 1) * height
    if not 0 < width < _WIDEST or not 0 < height < _WIDEST or stride * height > most + 4 * stride:
        raise ValueError(f"it has more than {most} bytes")
    rows = zlib.decompressobj().decompress(packed, size)
    if len(rows) != size:
        raise ValueError("rows are missing")
    return _unfiltered(rows, stride, _CHANNELS[colour]).decode().rstrip("\n")


def _unfiltered(rows: bytes, stride: int, step: int) -> bytes:
    """Return the pixels of rows that each begin with how they are filtered (ISO/IEC 15948, 9.2)."""
    above = bytearray(stride)
    content = bytearray()
    for begin in range(0, len(rows), stride + 1):
        row = bytearray(rows[begin + 1 : begin + 1 + stride])
        _FILTERS[rows[begin]](row, above, step) if rows[begin] < len(_FILTERS) else _unknown()
        content += row
        above = row
    return bytes(content)


def _unknown() -> None:
    raise ValueError("no such filter")


def _none(_row: bytearray, _above: bytearray, _step: int) -> None:
    """Leave a row as it is."""


def _sub(row: bytearray, _above: bytearray, step: int) -> None:
    for at in range(step, len(row)):
        row[at] = row[at] + row[at - step] & 255


def _up(row: bytearray, above: bytearray, _step: int) -> None:
    for at, over in enumerate(above):
        row[at] = row[at] + over & 255


def _average(row: bytearray, above: bytearray, step: int) -> None:
    for at, over in enumerate(above):
        left = row[at - step] if at >= step else 0
        row[at] = row[at] + (left + over) // 2 & 255


def _paeth(row: bytearray, above: bytearray, step: int) -> None:
    for at, over in enumerate(above):
        left, corner = (row[at - step], above[at - step]) if at >= step else (0, 0)
        guess = left + over - corner
        nearest = min((left, over, corner), key=lambda one: abs(guess - one))
        row[at] = row[at] + nearest & 255


_FILTERS = (_none, _sub, _up, _average, _paeth)
