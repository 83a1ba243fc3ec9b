"""The interface for faults on demand: lines of JSON over a socket."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest

from dmc41x3.loops import run
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.injection import FaultControlServer
from dmc41x3.twin.wire.server import VirtualController

PATIENCE = 20.0


class Guest:
    """A client of the interface."""

    def __init__(self, virtual: VirtualController, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.virtual = virtual
        self.reader = reader
        self.writer = writer

    async def ask(self, request: Any) -> dict[str, Any]:
        return await self.say(json.dumps(request).encode() + b"\n")

    async def say(self, line: bytes) -> dict[str, Any]:
        self.writer.write(line)
        async with asyncio.timeout(PATIENCE):
            return json.loads(await self.reader.readline())


@asynccontextmanager
async def guest() -> AsyncIterator[Guest]:
    virtual = VirtualController(VirtualDmc(BenchPlant()))
    control = await FaultControlServer.opened(virtual.faults)
    reader, writer = await asyncio.open_connection("127.0.0.1", control.port)
    try:
        yield Guest(virtual, reader, writer)
    finally:
        await control.close()
        writer.close()
        with suppress(ConnectionError):
            await writer.wait_closed()
        await virtual.close()


def test_fault_is_begun_listed_and_ended() -> None:
    async def main() -> None:
        async with guest() as visitor:
            assert await visitor.ask({}) == {"active": []}
            answer = await visitor.ask({"fault": "latency", "values": {"seconds": 0.5}})
            assert answer == {
                "active": [{"fault": "latency", "values": {"seconds": 0.5, "jitter": 0.0}, "seconds": None}]
            }
            assert visitor.virtual.wire.latency == 0.5
            answer = await visitor.ask({"fault": "drop", "seconds": 100})
            assert [one["fault"] for one in answer["active"]] == ["latency", "drop"]
            assert 99.0 < answer["active"][1]["seconds"] <= 100.0
            assert [one["fault"] for one in (await visitor.ask({"clear": "latency"}))["active"]] == ["drop"]
            assert await visitor.ask({"clear": None}) == {"active": []}
            assert visitor.virtual.wire.latency == visitor.virtual.wire.drop == 0.0

    run(main())


@pytest.mark.parametrize(
    ("line", "code", "details"),
    [
        (b'{"fault": "nope"}', 4003, {"name": "nope"}),
        (b'{"clear": "nope"}', 4003, {"name": "nope"}),
        (b'{"clear": 5}', 4005, {"key": "clear"}),
        (b'{"fault": "drop", "values": {"probability": 2}}', 4001, {"key": "probability", "value": "2"}),
        (b'{"fault": "drop", "values": {"speed": 2}}', 4003, {"name": "speed"}),
        (b'{"fault": "drop", "values": {"probability": null}}', 4001, {"key": "probability"}),
        (b'{"fault": "drop", "values": {"probability": [1]}}', 4001, {"key": "probability"}),
        (b'{"fault": "drop", "values": {"probability": ' + b"9" * 400 + b"}}", 4001, {"key": "probability"}),
        (b'{"fault": "drop", "values": [1]}', 4005, {"key": "values"}),
        (b'{"fault": "encoder_loss", "values": {"axis": "H"}}', 4001, {"key": "axis"}),
        (b'{"fault": "drop", "seconds": 0}', 4005, {"key": "seconds"}),
        (b'{"fault": "drop", "seconds": true}', 4005, {"key": "seconds"}),
        (b'{"fault": "drop", "seconds": NaN}', 4005, {"key": "seconds"}),
        (b'{"fault": "drop", "seconds": ' + b"9" * 400 + b"}", 4005, {"key": "seconds"}),
        (b"[]", 4005, {"key": "line"}),
        (b"\xff{", 4005, {"key": "line"}),
        (b"", 4005, {"key": "line"}),
        (b"[" * 60000, 4005, {"key": "line"}),
    ],
)
def test_nonsense_is_answered_by_its_code_and_changes_nothing(line: bytes, code: int, details: dict[str, str]) -> None:
    async def main() -> None:
        async with guest() as visitor:
            answer = await visitor.say(line + b"\n")
            assert answer["error"]["code"] == code
            assert details.items() <= answer["error"]["details"].items()
            assert await visitor.ask({}) == {"active": []}

    run(main())


def test_a_line_without_end_is_hung_up_on() -> None:
    async def main() -> None:
        async with guest() as visitor:
            visitor.writer.write(b"x" * 70_000)
            async with asyncio.timeout(PATIENCE):
                with suppress(ConnectionError):
                    assert await visitor.reader.read() == b""

    run(main())


def test_requests_in_pieces_and_several_at_once() -> None:
    async def main() -> None:
        async with guest() as visitor:
            visitor.writer.write(b'{"fault": "dr')
            await visitor.writer.drain()
            assert len((await visitor.say(b'op"}\n{}\n'))["active"]) == 1
            async with asyncio.timeout(PATIENCE):
                assert len(json.loads(await visitor.reader.readline())["active"]) == 1

    run(main())
