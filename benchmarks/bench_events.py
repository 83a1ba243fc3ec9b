"""How soon what happens is told, and how soon a stop is obeyed: from the controller to a client, and back.

A twin on a socket plays the controller, and `maya up` drives it in a process of its own, in real time. An event is late
by what passes from when the controller's layer says it to when a websocket client has read it; the worst of a hundred
is told. A stop is late by what passes from when a shell starts `maya stop` until the controller has read its ST; it is
said while the robot homes. A busy machine delays both, so the best of all rounds counts.
"""

from __future__ import annotations

import asyncio
import http.client
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from harness import Case, Goal, measure, report, timed
from service import MAYA, Service, service
from stream_client import Client, time_in

CALLS = 100
"""Changes of the speed in a sample; each is told by several events."""


class Box:
    """A twin on a socket, in a thread of its own; notes when a stop came."""

    def __init__(self) -> None:
        self.address = ""
        self.stopped: Future[float] = Future()
        self._over = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

    async def _serve(self, ready: Future[None]) -> None:
        from maya_un.assembly.controller import make_twin

        twin = make_twin()
        twin.controller.tap = self._see
        host, port = await twin.controller.serve()
        self._loop, self.address = asyncio.get_running_loop(), f"{host}:{port}"
        ready.set_result(None)
        await self._over.wait()
        await twin.controller.close()

    def _see(self, _: str, way: str, data: bytes) -> None:
        if way == "rx" and not self.stopped.done() and any(line.startswith(b"ST") for line in data.split(b"\r")):
            self.stopped.set_result(time.monotonic())

    @contextmanager
    def running(self) -> Iterator[None]:
        """Serve while the block runs."""
        ready: Future[None] = Future()
        thread = threading.Thread(target=lambda: asyncio.run(self._serve(ready)))
        thread.start()
        ready.result(10.0)
        try:
            yield
        finally:
            assert self._loop is not None
            self._loop.call_soon_threadsafe(self._over.set)
            thread.join()


class Probe:
    """Measures a running service from outside."""

    def __init__(self, running: Service) -> None:
        self._service = running
        self._connection = http.client.HTTPConnection(running.url.removeprefix("http://"), timeout=30.0)

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Return an answer."""
        headers = {"Content-Type": "application/json"}
        self._connection.request(method, path, None if body is None else json.dumps(body), headers)
        return json.loads(self._connection.getresponse().read())

    def event(self) -> float:
        """Return how late the latest one of a hundred events is [s]."""
        return asyncio.run(self._lateness())

    async def _lateness(self) -> float:
        late: list[float] = []
        loop, subscribed = asyncio.get_running_loop(), asyncio.Event()

        def seen(text: bytes, now: float) -> None:
            if text.startswith(b'{"type":"event"'):
                late.append(now - time_in(text))
            elif b'"subscribed"' in text:
                subscribed.set()

        host, _, port = self._service.url.removeprefix("http://").partition(":")
        request = {"type": "subscribe", "events": {}}
        transport, client = await loop.create_connection(lambda: Client(request, seen), host, int(port))
        await client.open.wait()
        await subscribed.wait()
        for call in range(CALLS):
            ratio = {"ratio": 0.5 + call / (4 * CALLS)}
            await loop.run_in_executor(None, self.ask, "POST", "/v1/speed", ratio)
        await asyncio.sleep(0.2)
        transport.close()
        assert len(late) >= CALLS, f"only {len(late)} events came"
        return sorted(late)[int(0.99 * len(late))]

    def stop(self, box: Box) -> float:
        """Return how late a stop is [s]."""
        self.ask("POST", "/v1/tasks", {"command": "home"})
        while not self.ask("GET", "/v1/status")["state"]["moving"]:
            time.sleep(0.02)
        box.stopped = Future()
        began = time.monotonic()
        subprocess.run([MAYA, "stop"], env=self._service.environment, stdout=subprocess.DEVNULL, check=True)
        late = box.stopped.result(10.0) - began
        while self.ask("GET", "/v1/status")["state"]["moving"]:
            time.sleep(0.02)
        return late


def nothing() -> None:
    """Start a Python that does nothing: what the machine takes of a stop by itself."""
    subprocess.run([sys.executable, "-c", "pass"], check=True)


def main() -> None:
    box = Box()
    with box.running(), service("--address", box.address) as running:
        probe = Probe(running)
        cases = [
            Case("event to client, 99 of 100 are sooner", probe.event, "ms", Goal(5.0)),
            Case("python -c pass in a shell", timed(nothing), "ms"),
            Case("maya stop in a shell, until ST is read", lambda: probe.stop(box), "ms", Goal(200.0)),
        ]
        figures = measure(cases, rounds=7)
    report(figures)


if __name__ == "__main__":
    main()
