"""A recorded transport is the one it wraps, and everything that passes is written down as it was."""

from __future__ import annotations

import pytest

from dmc41x3.wire.transcript import Side
from dmc41x3.wire.transport import loopback_pair
from maya_un.errors import LinkLost
from maya_un.recorder.capture import RecordedTransport, WireDirection


class ByteLog:
    """Stores its input."""

    def __init__(self) -> None:
        self.pieces: list[tuple[int, Side, bytes, str]] = []

    def __call__(self, way: WireDirection, data: bytes = b"") -> None:
        self.pieces.append((way.link, way.side, data, way.event))


async def test_bytes_of_both_sides_and_the_end_are_written_down() -> None:
    book = ByteLog()
    host, controller = loopback_pair("10.0.0.5:23")
    transport = RecordedTransport(host, book, 3)
    assert transport.peer == "10.0.0.5:23"
    transport.write(b"TP\r")
    assert await controller.read() == b"TP\r"
    controller.write(b" 1\r\n:")
    assert await transport.read() == b" 1\r\n:"
    await transport.close()
    await transport.close()
    assert await controller.read() == b""
    assert book.pieces == [
        (3, "client", b"", "open"),
        (3, "client", b"TP\r", ""),
        (3, "controller", b" 1\r\n:", ""),
        (3, "client", b"", "end"),
    ]


async def test_end_by_the_other_side_is_recorded_once_as_its_own() -> None:
    book = ByteLog()
    host, controller = loopback_pair()
    transport = RecordedTransport(host, book, 1)
    await controller.close()
    assert await transport.read() == b""
    await transport.close()
    assert book.pieces[1:] == [(1, "controller", b"", "end")]


class Broken:
    """A transport whose cable is pulled."""

    peer = "broken"

    async def read(self) -> bytes:
        raise LinkLost(address=self.peer, reason="pulled")

    def write(self, data: bytes) -> None:
        raise LinkLost(address=self.peer, reason="pulled")

    async def close(self) -> None:
        return


async def test_error_of_a_broken_link_is_raised_and_the_record_stays() -> None:
    book = ByteLog()
    transport = RecordedTransport(Broken(), book, 1)
    with pytest.raises(LinkLost):
        await transport.read()
    with pytest.raises(LinkLost):
        transport.write(b"ST\r")
    assert book.pieces[1:] == [(1, "controller", b"", "end"), (1, "client", b"ST\r", "")]
