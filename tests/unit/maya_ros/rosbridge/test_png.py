"""Messages as pictures, against the library that rosbridge itself uses for them."""

from __future__ import annotations

import base64
import io
import math
import struct
import time
import zlib
from contextlib import suppress
from itertools import pairwise

import pytest
from PIL import Image

from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.limits import LONGEST_MESSAGE
from maya_un.errors import InvalidRequest
from tests.campaign import Campaign

MOST = 100_000


def as_rosbridge_writes(text: str) -> str:
    """Return a picture as rosbridge_suite makes it: nearly square, padded with line ends."""
    content = text.encode()
    width = max(1, math.floor(math.sqrt(len(content) / 3.0)))
    height = math.ceil(len(content) / 3.0 / width)
    content += b"\n" * (width * height * 3 - len(content))
    return saved(Image.frombytes("RGB", (width, height), content))


def saved(image: Image.Image, **options: object) -> str:
    out = io.BytesIO()
    image.save(out, "png", **options)
    return base64.b64encode(out.getvalue()).decode()


def seen(picture: str) -> bytes:
    return Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB").tobytes()


TEXTS = ["{}", "x" * 1000, '{"op":"publish","msg":{"data":"ä🤖"}}', "abc" * 5000]


@pytest.mark.parametrize("text", TEXTS)
def test_a_picture_of_ours_is_read_by_others(text: str) -> None:
    assert seen(outgoing.encoded(text)).rstrip(b"\n").decode() == text


@pytest.mark.parametrize("text", TEXTS)
def test_a_picture_of_others_is_read(text: str) -> None:
    assert outgoing.decoded(as_rosbridge_writes(text), MOST) == text


def test_every_filter_of_a_writer_gives_the_same_text(campaign: Campaign) -> None:
    for case in range(campaign.size(ci=40, long=1000)):
        draw = campaign.rng(case)
        text = "".join(chr(draw.choice((65, 66, 67, 120, 233))) for _ in range(draw.randrange(1, 3000)))
        assert outgoing.decoded(as_rosbridge_writes(text), MOST) == text
        assert outgoing.decoded(outgoing.encoded(text), MOST) == text


@pytest.mark.parametrize("filter_", range(5))
@pytest.mark.parametrize(("mode", "channels", "colour"), [("RGB", 3, 2), ("L", 1, 0), ("LA", 2, 4), ("RGBA", 4, 6)])
def test_every_filter_and_every_kind_of_pixel_is_undone(filter_: int, mode: str, channels: int, colour: int) -> None:
    width, height = 7, 5
    content = bytes((31 * place) % 94 + 33 for place in range(width * height * channels))
    picture = drawn(content, width, height, channels, colour, filter_)
    assert Image.open(io.BytesIO(picture)).convert(mode).tobytes() == content, "the picture itself is right"
    assert outgoing.decoded(base64.b64encode(picture).decode(), MOST) == content.decode()


def drawn(content: bytes, width: int, height: int, step: int, colour: int, filter_: int) -> bytes:
    """Return a picture whose rows are all filtered in one way."""
    stride = step * width
    rows = [bytes(stride), *(content[begin : begin + stride] for begin in range(0, len(content), stride))]
    return filed(
        b"".join(bytes([filter_]) + filtered(row, above, step, filter_) for above, row in pairwise(rows)),
        width,
        height,
        colour,
    )


def filed(rows: bytes, width: int, height: int, colour: int = 2, *others: tuple[bytes, bytes]) -> bytes:
    """Return the file of filtered rows, with chunks of other kinds before them."""
    head = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
    parts = ((b"IHDR", head), *others, (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def filtered(row: bytes, above: bytes, step: int, filter_: int) -> bytes:
    def predicted(at: int) -> int:
        left, over = row[at - step] if at >= step else 0, above[at]
        corner = above[at - step] if at >= step else 0
        guess = left + over - corner
        paeth = min((left, over, corner), key=lambda one: abs(guess - one))
        return (0, left, over, (left + over) // 2, paeth)[filter_]

    return bytes((byte - predicted(at)) % 256 for at, byte in enumerate(row))


GOOD = base64.b64decode(outgoing.encoded("a text of some length"))


@pytest.mark.parametrize(
    "data",
    [
        "",
        "no base64!",
        base64.b64encode(b"no picture").decode(),
        base64.b64encode(GOOD[:40]).decode(),
        base64.b64encode(GOOD[:-20] + bytes(20)).decode(),
        saved(Image.new("P", (4, 4))),
        saved(Image.new("1", (4, 4))),
        base64.b64encode(filed(b"\0abcdef" * 2, 2, 3)).decode(),
        base64.b64encode(filed(b"\0abcdef" * 2 + b"\0abc", 2, 3)).decode(),
        base64.b64encode(filed(b"\5abcdef" * 3, 2, 3)).decode(),
        saved(Image.frombytes("RGB", (2, 1), b"\xff\xfe\xfd\xfc\xfb\xfa")),
    ],
)
def test_picture_without_a_text_is_refused(data: str) -> None:
    with pytest.raises(InvalidRequest):
        outgoing.decoded(data, MOST)


def test_a_picture_that_unpacks_to_too_much_is_refused_before_it_is_unpacked() -> None:
    bomb = saved(Image.new("RGB", (2000, 2000), (65, 65, 65)))
    assert len(bomb) < MOST
    with pytest.raises(InvalidRequest):
        outgoing.decoded(bomb, MOST)


def test_rows_beyond_the_height_are_not_unpacked() -> None:
    bomb = base64.b64encode(filed(b"\0abcdef" * 30_000_000, 2, 3)).decode()
    began = time.thread_time()
    assert outgoing.decoded(bomb, LONGEST_MESSAGE) == "abcdef" * 3
    assert time.thread_time() - began < 0.1


def test_profiles_and_comments_are_not_unpacked() -> None:
    bomb = b"p\0\0" + zlib.compress(bytes(1_000_000))
    others = [(kind, bomb) for kind in (b"iCCP", b"zTXt")] * 300
    picture = base64.b64encode(filed(b"\0abcdef", 2, 1, 2, *others)).decode()
    assert len(picture) < LONGEST_MESSAGE
    began = time.thread_time()
    assert outgoing.decoded(picture, LONGEST_MESSAGE) == "abcdef"
    assert time.thread_time() - began < 0.1


@pytest.mark.parametrize("filter_", range(5))
def test_no_filter_holds_the_loop(filter_: int) -> None:
    side = 577
    picture = base64.b64encode(filed((bytes([filter_]) + b"\1" + bytes(3 * side - 1)) * side, side, side)).decode()
    began = time.thread_time()
    with suppress(InvalidRequest):  # of most filters it is no text
        outgoing.decoded(picture, LONGEST_MESSAGE)
    assert time.thread_time() - began < 0.1
