"""The cost of showing the robot to a hundred websocket clients 30 times a second, and how late they see it.

The server is a process of its own: a whole stack on the twin whose states come at 30 Hz, and the stream. Beside it runs
a bare uvicorn that sends frames of the same size to as many clients, each by the framework's own call. The clients of
both stay connected, and the two take turns. The cost is CPU time of the server's process, which leaves out what other
processes of a busy machine take; how late is measured from when a state is published to when a client has read it.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from functools import partial
from statistics import median
from typing import Any, cast

import uvicorn
from fastapi import FastAPI, WebSocket
from harness import Case, Goal, Sample, measure, report
from starlette.websockets import WebSocketDisconnect
from stream_client import Client, time_in

CLIENTS = 100
RATE = 30.0
SECONDS = 2.0
"""How long one sample lasts."""

SHARE = 0.8
"""At least this share of the states must come."""


class Beating:
    """The service of a stack, but with a new state `rate` times a second while `going`."""

    def __init__(self, service: Any, rate: float) -> None:
        self._service = service
        self._rate = rate
        self.going = asyncio.Event()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._service, name)

    async def watch(self) -> AsyncIterator[Any]:
        """Yield states that differ."""
        state = await anext(self._service.watch())
        due = time.monotonic()
        while True:
            await self.going.wait()
            due = max(due + 1.0 / self._rate, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            state = replace(state, time=time.monotonic(), counts=(state.counts[0] + 1, -1234567, 2234567))
            yield state


async def obey(going: asyncio.Event) -> None:
    """Do what the lines of the input say: go, stop, or tell the CPU time used [s]; ends with the input."""
    loop = asyncio.get_running_loop()
    while line := (await loop.run_in_executor(None, sys.stdin.readline)).strip():
        if line == "go":
            going.set()
        elif line == "stop":
            going.clear()
        print(time.process_time(), flush=True)


async def serve_ours(rate: float) -> None:
    from maya_un.assembly.stack import stack
    from maya_un.config import Config
    from maya_un.http.app import create_app
    from maya_un.http.bridge import Bridge
    from maya_un.http.sockets import bound_socket
    from maya_un.http.thread import served

    async with stack(Config(), live=False) as robot:
        beating = Beating(robot.service, rate)
        bridge = Bridge(asyncio.get_running_loop(), cast("Any", beating))
        with bound_socket(0) as listener:
            async with served(create_app(bridge), listener) as url:
                print(url.rpartition(":")[2], flush=True)
                await obey(beating.going)


async def serve_bare(rate: float) -> None:
    """Send what the stream sends, one client after the other, as the framework's manual shows it."""
    from maya_un.assembly.stack import stack
    from maya_un.config import Config
    from maya_un.http.sockets import bound_socket
    from maya_un.http.stream.messages import state_frame

    app, clients, going = FastAPI(), set[WebSocket](), asyncio.Event()
    async with stack(Config(), live=False) as robot:
        state = (await robot.service.status()).state

    @app.websocket("/v1/stream")
    async def _(socket: WebSocket) -> None:
        await socket.accept()
        clients.add(socket)
        try:
            while True:
                await socket.receive()
        except (RuntimeError, WebSocketDisconnect):
            clients.discard(socket)

    async def beat() -> None:
        due = time.monotonic()
        while True:
            await going.wait()
            due = max(due + 1.0 / rate, time.monotonic())
            await asyncio.sleep(due - time.monotonic())
            changed = replace(state, time=time.monotonic(), counts=(1, -1234567, 2234567))
            text = payload(state_frame(1, changed)).decode()
            for socket in tuple(clients):
                await socket.send_text(text)

    with bound_socket(0) as listener:
        listener.listen()
        server = uvicorn.Server(uvicorn.Config(app, log_config=None, access_log=False, ws_per_message_deflate=False))
        serving = asyncio.create_task(server.serve([listener]))
        beating = asyncio.create_task(beat())
        print(listener.getsockname()[1], flush=True)
        await obey(going)
        beating.cancel()
        server.should_exit = True
        await serving


def payload(frame: bytes) -> bytes:
    """Return the text of one frame of at least 126 and less than 65 536 bytes."""
    return frame[4:]


class Server:
    """A server in a process of its own, with its clients in this one.

    A sample lasts `seconds`; at least the share `share` of all states must come. `received` counts those of every
    client in the last sample, `last` is the last one of any.
    """

    def __init__(self, kind: str, loop: asyncio.AbstractEventLoop, clients: int = CLIENTS, rate: float = RATE) -> None:
        self._loop = loop
        self._rate = rate
        self.seconds, self.share = SECONDS, SHARE
        self.received = [0] * clients
        self.last = b""
        self._clients: list[Client] = []
        self._process = subprocess.Popen(
            [sys.executable, __file__, kind, str(rate)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._port = int(self._said())
        self._late: list[float] = []
        loop.run_until_complete(self._connect())

    def _said(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline()

    async def _connect(self) -> None:
        request = {"type": "subscribe", "state": {"rate": self._rate}}
        for number in range(len(self.received)):
            seen = partial(self._see, number)
            _, client = await self._loop.create_connection(partial(Client, request, seen), "127.0.0.1", self._port)
            self._clients.append(client)
            await client.open.wait()

    def _see(self, number: int, text: bytes, now: float) -> None:
        if text.startswith(b'{"type":"state"'):
            self._late.append(now - time_in(text))
            self.received[number] += 1
            self.last = text

    def tell(self, word: str) -> float:
        """Have it go, stop or just tell its CPU time [s]."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{word}\n")
        self._process.stdin.flush()
        return float(self._said())

    def sample(self) -> tuple[float, float]:
        """Return CPU seconds a second, and the median of how late states were [s]."""
        self._late.clear()
        self.received = [0] * len(self.received)
        before, began = self.tell("go"), time.monotonic()
        self._loop.run_until_complete(asyncio.sleep(self.seconds))
        used, took = self.tell("stop") - before, time.monotonic() - began
        self._loop.run_until_complete(asyncio.sleep(0.1))
        expected = len(self.received) * self._rate * self.seconds
        assert len(self._late) > self.share * expected, f"{len(self._late)} of {expected:.0f} states came"
        return used / took, median(self._late)

    def end(self) -> None:
        """End it."""
        for client in self._clients:
            client.close()
        self._loop.run_until_complete(asyncio.sleep(0.0))
        self._process.kill()
        self._process.communicate()  # closes its pipes


def both(server: Server) -> tuple[Sample, Sample]:
    """Return samples of cost and of lateness of the same run."""
    last: list[tuple[float, float]] = []

    def cost() -> float:
        last[:] = [server.sample()]
        return last[0][0]

    return cost, lambda: last[0][1]


SERVERS: dict[str, Callable[[float], Any]] = {"ours": serve_ours, "bare": serve_bare}


def main() -> None:
    if len(sys.argv) > 1 and sys.argv[1] in SERVERS:
        asyncio.run(SERVERS[sys.argv[1]](float(sys.argv[2])))
        os._exit(0)  # a thread waits for input
    loop = asyncio.new_event_loop()
    bare, ours = Server("bare", loop), Server("ours", loop)
    bare_cost, bare_late = both(bare)
    our_cost, our_late = both(ours)
    figures = measure(
        [
            Case("bare uvicorn, CPU a second", bare_cost, "ms"),
            Case("bare uvicorn, how late", bare_late, "ms"),
            Case(f"{CLIENTS} clients x {RATE:g} Hz, CPU a second", our_cost, "ms", Goal(100.0)),
            Case("how late", our_late, "ms", Goal(2.0, to="bare uvicorn, how late")),
        ],
        rounds=5,
        by=median,
    )
    bare.end()
    ours.end()
    report(figures)


if __name__ == "__main__":
    main()
