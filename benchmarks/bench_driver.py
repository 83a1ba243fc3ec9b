"""Request and reply over the driver, against a bare asyncio echo of the same bytes; both ends on one CPU."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Awaitable, Callable
from statistics import median

from maya_un.galil.commands import parse
from maya_un.galil.driver import Driver
from maya_un.galil.framing import LineSplitter
from maya_un.galil.record import AxisRecord, DataRecord, decode, encode
from maya_un.galil.transport import TcpTransport

ROUNDS, REQUESTS = 7, 2_000
REPLY = b" 200, -10, 0\r\n:"


class Answerer(asyncio.Protocol):
    """Answers everything with the same reply."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection to answer on."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        """Answer."""
        self._transport.write(REPLY)


async def each(request: Callable[[], Awaitable[object]]) -> float:
    """Return the time of one request [µs]."""
    start = time.perf_counter()
    for _ in range(REQUESTS):
        await request()
    return (time.perf_counter() - start) / REQUESTS * 1e6


async def round_trips() -> tuple[float, float]:
    """Return the times of a bare echo and of the driver [µs], taken in turn and their medians."""
    server = await asyncio.get_running_loop().create_server(Answerer, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    driver = await Driver.open(await TcpTransport.connect("127.0.0.1", port, 5.0), timeout=5.0)

    async def echo() -> None:
        writer.write(b"TP\r")
        await reader.read(100)

    async def request() -> None:
        await driver.send("TP")

    pairs = [(await each(echo), await each(request)) for _ in range(ROUNDS)]
    await driver.close()
    writer.close()
    server.close()
    return median(bare for bare, _ in pairs), median(ours for _, ours in pairs)


def once(work: Callable[[], object]) -> float:
    """Return the time of one call [µs]."""
    start = time.perf_counter()
    for _ in range(REQUESTS):
        work()
    return (time.perf_counter() - start) / REQUESTS * 1e6


def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    bare, ours = asyncio.run(round_trips())
    print(f"bare asyncio echo       {bare:8.1f} us")
    print(f"driver, request/reply   {ours:8.1f} us   {ours / bare:.2f} x (at most 2)")
    record = encode(DataRecord(axes=(AxisRecord(),) * 3))
    splitter = LineSplitter()
    print(f"decode a data record    {once(lambda: decode(record)):8.1f} us")
    print(f"parse a segment (LI)    {once(lambda: parse('LI 1000,-2000,3000<4000>200')):8.1f} us")
    print(f"split a line of four    {once(lambda: splitter.feed(b'LI 1,2,3;LI 4,5,6;LE;BGS' + bytes([13]))):8.1f} us")


if __name__ == "__main__":
    main()
