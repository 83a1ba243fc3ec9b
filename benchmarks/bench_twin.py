"""The virtual controller: commands over TCP against a bare asyncio echo, data records, motion in virtual time, memory.

Both ends of every connection run in one loop on one CPU, and times are CPU time of this process, kernel included:
what other processes of a busy machine take is left out.
"""

from __future__ import annotations

import asyncio
import gc
import os
import time
import tracemalloc
from collections.abc import Callable

from harness import Case, Goal, Sample, measure, report

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.wire.server import VirtualController
from maya_un.controller.watchdog_program import BEAT, OUT, START, THREAD, merged

ECHO = "bare asyncio echo"
PIPELINED = 20_000
"""Commands in flight one behind the other."""

REQUESTS = 2_000
RECORDS = 2_000
RECORD = 82 + 8 * 36 + 1
SECONDS = 100.0
"""How long the axes move [s of virtual time]."""

GUARD = 0.5
"""How long the guard in the controller waits for a beat [s]; it gets two in that time."""

MANY = 1_000_000
FEW = 20_000


def spent(work: Callable[[], object]) -> float:
    """Return the CPU time that a call takes [s]."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


class Answerer(asyncio.Protocol):
    """Answers everything with a prompt."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the connection to answer on."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def data_received(self, data: bytes) -> None:
        """Answer."""
        self._transport.write(b":")


class Line:
    """A connection to whoever listens on a port, in a loop of the benchmark's own."""

    def __init__(self, loop: asyncio.AbstractEventLoop, port: int) -> None:
        self._loop = loop
        self._reader, self._writer = loop.run_until_complete(asyncio.open_connection("127.0.0.1", port))

    def pipelined(self, command: bytes, count: int, length: int) -> float:
        """Send a command many times without waiting; return the time for one [s]. Its reply has `length` bytes."""

        async def stream() -> None:
            self._writer.write(command * count)
            await self._reader.readexactly(length * count)

        return spent(lambda: self._loop.run_until_complete(stream())) / count

    def asked(self, command: bytes) -> Sample:
        """Return a sample of one request and its reply [s]."""

        async def ask() -> None:
            for _ in range(REQUESTS):
                self._writer.write(command)
                await self._reader.read(100)

        return lambda: spent(lambda: self._loop.run_until_complete(ask())) / REQUESTS

    def close(self) -> None:
        """Hang up."""
        self._writer.close()


async def served() -> tuple[VirtualController, int]:
    """Return a controller of eight axes on ideal axes, and its port."""
    controller = VirtualController(VirtualDmc(BenchPlant(8), axes=8))
    _, port = await controller.serve()
    return controller, port


def machine_in_motion(axes: int = 8) -> float:
    """Move axes for `SECONDS` of virtual time, with the guard's program kept awake; return what it takes [s]."""
    machine = VirtualDmc(BenchPlant(axes), axes=axes)
    handle = machine.connect()
    assert handle is not None

    def say(line: str) -> None:
        answer = machine.receive(handle, f"{line}\r".encode("ascii"), machine.now)
        assert not answer.strip(b":"), (line, answer)

    say(f"DL\r{merged('', GUARD, 'ABCDEFGH'[:axes])}\\")
    for line in ("SH", "SP*=20000", "PR*=100000", f"{BEAT}=TIME", f"{OUT}=0", f"XQ#{START},{THREAD}"):
        say(line)
    begun = time.process_time()
    for beat in range(int(SECONDS / GUARD * 2.0)):
        if beat % 30 == 0:
            say("BG")
        machine.advance(machine.now + GUARD / 2.0)
        say(f"{BEAT}=TIME")
    took = time.process_time() - begun
    assert machine.receive(handle, f"MG_XQ{THREAD}<0,{OUT}\r".encode("ascii"), machine.now) == b" 0.0000 0.0000\r\n:"
    return took


def growth() -> float:
    """Return by how much Python's memory grows over `MANY` commands of all sorts [bytes]."""
    machine = VirtualDmc(BenchPlant(3))
    handle = machine.connect()
    assert handle is not None
    lines = b"SHA;PRA=500;BGA\rMG _TPA,_BGA\rv=v+1;SPA=v%100*2\rGF32\rTC1\rQR\rSTA\rLMAB;LI 10,10;CSS\rMG TIME\r"
    count = lines.count(b";") + lines.count(b"\r")

    def work(commands: int) -> None:
        now = machine.now
        machine.receive(handle, b"v=0\r", now)
        for _ in range(commands // count):
            now += 0.01
            machine.receive(handle, lines, now)

    work(FEW)
    gc.collect()
    tracemalloc.start()
    work(FEW)
    gc.collect()
    before = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    work(MANY - 2 * FEW)
    tracemalloc.start()
    work(FEW)
    gc.collect()
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return float(max(0, after - before))


def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    loop = asyncio.new_event_loop()
    server = loop.run_until_complete(loop.create_server(Answerer, "127.0.0.1", 0))
    controller, port = loop.run_until_complete(served())
    echo, line = Line(loop, server.sockets[0].getsockname()[1]), Line(loop, port)
    pipelined = Goal(1e6 / 300_000)  # commands a second
    cases = [
        Case(ECHO, echo.asked(b"NO\r")),
        Case("request and reply (SPA=1000)", line.asked(b"SPA=1000\r"), goal=Goal(1.5, to=ECHO)),
        Case("request and reply (MG _TPA)", line.asked(b"MG _TPA\r"), goal=Goal(1.5, to=ECHO)),
        Case("pipelined: NO", lambda: line.pipelined(b"NO\r", PIPELINED, 1), goal=pipelined),
        Case("pipelined: SPA=1000", lambda: line.pipelined(b"SPA=1000\r", PIPELINED, 1), goal=pipelined),
        Case("pipelined: TPA", lambda: line.pipelined(b"TPA\r", PIPELINED, len(" 0\r\n:")), goal=pipelined),
        Case(
            "pipelined: MG _TPA", lambda: line.pipelined(b"MG _TPA\r", PIPELINED, len(" 0.0000\r\n:")), goal=pipelined
        ),
        Case("pipelined: QR, 8 axes", lambda: line.pipelined(b"QR\r", RECORDS, RECORD), goal=Goal(50.0)),
    ]
    figures = measure(cases, rounds=9)
    figures += measure([Case(f"{SECONDS:g} s of 8 axes and a guard", machine_in_motion, "ms", Goal(50.0))], rounds=5)
    figures += measure([Case(f"memory after {MANY} commands more", growth, "MB", Goal(0.1))], rounds=1)
    echo.close()
    line.close()
    loop.run_until_complete(controller.close())
    server.close()
    loop.run_until_complete(server.wait_closed())
    loop.close()
    report(figures)


if __name__ == "__main__":
    main()
