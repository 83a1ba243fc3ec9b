"""Request and reply over the driver, against a bare asyncio echo of the same bytes; both ends on one CPU."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable

from harness import Case, Goal, Sample, measure, report, timed

from dmc41x3.driver import Driver
from dmc41x3.language.commands import parse
from dmc41x3.language.record import AxisRecord, DataRecord, decode, encode
from dmc41x3.wire.framing import LineSplitter
from dmc41x3.wire.transport import TcpTransport

REQUESTS = 2_000
RATE = 50.0
"""Records a second that the controller layer asks for."""

ASK = b"TP\r"
REPLY = b" 200, -10, 0\r\n:"
ECHO = "bare asyncio echo"


RECORD = encode(DataRecord(axes=(AxisRecord(),) * 3))


class Answerer(asyncio.Protocol):
    """Answers QR with a record, everything else with the same reply."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection to answer on."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        """Answer."""
        self._transport.write(RECORD + b":" if data == b"QR\r" else REPLY)


async def over(count: int, request: Callable[[], Awaitable[object]]) -> None:
    """Make requests one after the other."""
    for _ in range(count):
        await request()


def in_loop(loop: asyncio.AbstractEventLoop, request: Callable[[], Awaitable[object]]) -> Sample:
    """Return a sample of the time of one request [s]."""
    batch = timed(lambda: loop.run_until_complete(over(REQUESTS, request)))
    return lambda: batch() / REQUESTS


def language() -> list[Case]:
    """Return what the language costs on its own."""
    splitter = LineSplitter()
    return [
        Case("decode a data record", timed(lambda: decode(RECORD), 2000)),
        Case("parse a segment (LI)", timed(lambda: parse("LI 1000,-2000,3000<4000>200"), 2000)),
        Case("split a line of four", timed(lambda: splitter.feed(b"LI 1,2,3;LI 4,5,6;LE;BGS\r"), 2000)),
    ]


def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    loop = asyncio.new_event_loop()
    server = loop.run_until_complete(loop.create_server(Answerer, "127.0.0.1", 0))
    port = server.sockets[0].getsockname()[1]
    reader, writer = loop.run_until_complete(asyncio.open_connection("127.0.0.1", port))
    transport = loop.run_until_complete(TcpTransport.connect("127.0.0.1", port, 5.0))
    driver = loop.run_until_complete(Driver.open(transport, timeout=5.0))

    async def echo() -> None:
        writer.write(ASK)
        await reader.read(100)

    cases = [
        Case(ECHO, in_loop(loop, echo)),
        Case("driver, request and reply", in_loop(loop, lambda: driver.send("TP")), goal=Goal(2.0, to=ECHO)),
        # Both ends of it and the kernel, at 50 Hz: a hundredth of a core is 200 µs a record.
        Case("driver, a whole record", in_loop(loop, driver.record), goal=Goal(0.01 / RATE * 1e6)),
    ]
    figures = measure([*cases, *language()], rounds=9)
    loop.run_until_complete(driver.close())
    writer.close()
    server.close()
    loop.run_until_complete(server.wait_closed())
    loop.close()
    report(figures)


if __name__ == "__main__":
    main()
