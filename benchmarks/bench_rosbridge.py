"""The cost of the rosbridge endpoint: how late a message is, how long a service takes, twenty readers at 100 Hz.

The server is a process of its own: `maya up --rosbridge` as everybody has it, on the twin. Beside it runs a bare server
of the library websockets, which sends what it is sent to all, as its manual shows it. Publisher and subscribers are in
this process; the two servers take turns. The cost is CPU time of the server's process, of ours less what it takes when
nobody is there: what the twin takes is not the endpoint's.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from contextlib import ExitStack
from statistics import median
from typing import Any

from harness import Case, Goal, Sample, cpu_time, measure, report
from service import service
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, broadcast, serve

READERS = 20
RATE = 100.0
SECONDS = 2.0
"""How long one sample lasts."""

TIMES = 300
"""Number of successive messages in one sample of their delay."""

TOPIC = {"topic": "/bench", "type": "std_msgs/String"}


async def serve_bare() -> None:
    """Send every message to everybody else."""
    clients = set[ServerConnection]()

    async def serve_one(connection: ServerConnection) -> None:
        clients.add(connection)
        try:
            async for text in connection:
                broadcast(clients - {connection}, text)
        finally:
            clients.discard(connection)

    async with serve(serve_one, "127.0.0.1", 0, compression=None) as server:
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await asyncio.Event().wait()


class Server:
    """A server process and clients of it: one that publishes, and those that read."""

    def __init__(self, pid: int, url: str, loop: asyncio.AbstractEventLoop) -> None:
        self._pid = pid
        self._url = url
        self._loop = loop
        self._clients: list[ClientConnection] = []
        self._idle = 0.0

    def connect(self, readers: int) -> None:
        """Have so many readers, and a publisher."""
        self._loop.run_until_complete(self._connect(readers))

    def close(self) -> None:
        """Have all clients go."""
        self._loop.run_until_complete(self._leave())

    async def _leave(self) -> None:
        for client in self._clients:
            await client.close()
        self._clients = []

    async def _connect(self, readers: int) -> None:
        await self._leave()
        self._clients = [await connect(self._url, compression=None) for _ in range(readers + 1)]
        first, *others = self._clients
        await first.send(said("advertise", **TOPIC))
        for reader in others:
            await reader.send(said("subscribe", **TOPIC))
        waiting = [asyncio.ensure_future(until(reader, "ready?")) for reader in others]
        while not all(one.done() for one in waiting):
            await first.send(said("publish", topic="/bench", msg={"data": "ready?"}))
            await asyncio.sleep(0.05)
        await first.send(said("publish", topic="/bench", msg={"data": "all"}))
        for reader in others:
            await until(reader, "all")

    def late(self) -> float:
        """Return the median from publishing to reading [s], by one reader."""
        return self._loop.run_until_complete(self._late())

    async def _late(self) -> float:
        writer, reader = self._clients[:2]
        taken: list[float] = []
        for number in range(TIMES):
            mark = f"{number}-{time.monotonic()}"
            began = time.perf_counter()
            await writer.send(said("publish", topic="/bench", msg={"data": mark}))
            await until(reader, mark)
            taken.append(time.perf_counter() - began)
        return median(taken)

    def called(self) -> float:
        """Return the median of a call of a service [s]."""
        return self._loop.run_until_complete(self._called())

    async def _called(self) -> float:
        client = self._clients[0]
        taken: list[float] = []
        for number in range(TIMES):
            began = time.perf_counter()
            request = {"task": {"command": "can_teleop"}}
            await client.send(said("call_service", id=number, service="/maya_command", args=request))
            while json.loads(await client.recv()).get("id") != number:
                pass
            taken.append(time.perf_counter() - began)
        return median(taken)

    def rest(self) -> float:
        """Return CPU seconds a second while nothing is published, and remember it."""
        before, began = cpu_time(self._pid), time.monotonic()
        self._loop.run_until_complete(asyncio.sleep(SECONDS))
        self._idle = (cpu_time(self._pid) - before) / (time.monotonic() - began)
        return self._idle

    def cost(self) -> float:
        """Return CPU seconds a second for all readers at the rate, less what the server takes at rest."""
        return self._loop.run_until_complete(self._cost()) - self._idle

    async def _cost(self) -> float:
        writer, *readers = self._clients
        expected = round(SECONDS * RATE)
        reading = [asyncio.ensure_future(read(reader, expected)) for reader in readers]
        before, began = cpu_time(self._pid), time.monotonic()
        due = began
        for number in range(expected):
            due = max(due + 1.0 / RATE, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            await writer.send(said("publish", topic="/bench", msg={"data": f"{number}"}))
        await asyncio.gather(*reading)
        return (cpu_time(self._pid) - before) / (time.monotonic() - began)


def said(op: str, **message: Any) -> str:
    return json.dumps({"op": op, **message})


async def until(reader: ClientConnection, mark: str) -> None:
    """Read until something with this mark comes."""
    while mark not in str(await reader.recv()):
        pass


async def read(reader: ClientConnection, count: int) -> None:
    """Read so many messages of the topic."""
    while count:
        await reader.recv()
        count -= 1


def of_many(server: Server) -> Sample:
    """Return a sample of cost that first looks what the server takes at rest."""

    def sample() -> float:
        server.rest()
        return server.cost()

    return sample


def with_readers(server: Server, readers: int, sample: Sample) -> Sample:
    def sampled() -> float:
        server.connect(readers)
        return sample()

    return sampled


def bare(stack: ExitStack, loop: asyncio.AbstractEventLoop) -> Server:
    import subprocess

    process = stack.enter_context(subprocess.Popen([sys.executable, __file__, "bare"], stdout=subprocess.PIPE))
    stack.callback(process.kill)
    assert process.stdout is not None
    return Server(process.pid, f"ws://127.0.0.1:{int(process.stdout.readline())}", loop)


def ours(stack: ExitStack, loop: asyncio.AbstractEventLoop) -> Server:
    port = free_port()
    running = stack.enter_context(service("--journal", "memory", "--rosbridge-port", str(port)))
    return Server(running.pid, f"ws://127.0.0.1:{port}", loop)


def free_port() -> int:
    """Return a port that nobody listens at."""
    import socket

    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def main() -> None:
    if sys.argv[1:2] == ["bare"]:
        asyncio.run(serve_bare())
        return
    loop = asyncio.new_event_loop()
    with ExitStack() as stack:
        plain, own = bare(stack, loop), ours(stack, loop)
        cases = [
            Case("bare websockets, publish to subscriber", with_readers(plain, 1, plain.late), "ms"),
            Case("publish to subscriber", with_readers(own, 1, own.late), "ms", Goal(0.4)),
            Case("service", with_readers(own, 0, own.called), "ms", Goal(0.6)),
            Case(
                f"bare, {READERS} readers x {RATE:g} Hz, CPU a second",
                with_readers(plain, READERS, of_many(plain)),
                "ms",
            ),
            Case(
                f"{READERS} readers x {RATE:g} Hz, CPU a second",
                with_readers(own, READERS, of_many(own)),
                "ms",
                Goal(60.0),
            ),
        ]
        figures = measure(cases, rounds=3, by=median)
        plain.close()
        own.close()
    report(figures)


if __name__ == "__main__":
    main()
