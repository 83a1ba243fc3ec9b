"""Listening sockets: shared descriptors, and connections without a descriptor."""

from __future__ import annotations

import asyncio
import logging
import socket

import pytest

from dmc41x3 import listening
from dmc41x3.listening import LEAST, DescriptorShare, DescriptorShares, Listener, Refusals
from dmc41x3.loops import run
from tests.virtual_time import elapse


@pytest.mark.parametrize("limit", [32, 48, 64, 256, 1024, 1_000_000])
@pytest.mark.parametrize("used", [4, 12, 20])
def test_shares_leave_descriptors_for_the_robot_for_stops_and_for_this_machine(limit: int, used: int) -> None:
    near, far = DescriptorShares.of(limit, used)
    assert used <= far.full <= far.most <= near.full < near.most < limit
    assert limit - near.most >= (limit - used) // 5 or limit - near.most == listening.KEPT
    assert near.stops >= 1
    if limit - used >= LEAST:
        assert near.full > used


def test_shares_of_an_ordinary_limit_serve_hundreds() -> None:
    near, far = DescriptorShares.of(1024, 20)
    assert (near.full, near.most, near.stops) == (974, 1008, 32)
    assert (far.full, far.most, far.stops) == (908, 942, 32)


class Lines(logging.Handler):
    """Keeps what is logged."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(record.getMessage())


async def test_refusals_are_logged_once_a_minute_with_their_number() -> None:
    refusals, lines = Refusals(), Lines()
    logger = logging.getLogger("maya.connections")
    logger.addHandler(lines)
    try:
        for _ in range(130):
            refusals.add()
            await elapse(1.0)
    finally:
        logger.removeHandler(lines)
    assert [line.rpartition(": ")[2] for line in lines.said] == ["1", "60", "60"]


def bound() -> socket.socket:
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    return listener


class Greeter(asyncio.Protocol):
    """Reports that a connection was taken."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.WriteTransport)
        transport.write(b"x")
        transport.close()


def listened(share: DescriptorShare, count: int) -> list[bytes]:
    """Return the answers to `count` simultaneous connections."""

    async def main() -> list[bytes]:
        server = Listener([bound()], Greeter, share)
        loop = asyncio.get_running_loop()
        lines = [socket.socket() for _ in range(count)]
        told: list[bytes] = []
        for line in lines:
            line.setblocking(False)
            await loop.sock_connect(line, server.address)
        for line in lines:
            told.append(await loop.sock_recv(line, 1))
            line.close()
        server.close()
        await server.wait_closed()
        assert not server.is_serving()
        return told

    return run(main(), asyncio.SelectorEventLoop)


def test_listener_with_descriptors_left_takes_all() -> None:
    assert listened(listening.ALL, 5) == [b"x"] * 5


def test_listener_with_few_descriptors_left_takes_one_after_the_other() -> None:
    assert listened(DescriptorShare(0, 1_000_000), 20) == [b"x"] * 20


def test_listener_out_of_descriptors_closes_new_connections() -> None:
    assert listened(DescriptorShare(0, 0), 5) == [b""] * 5
