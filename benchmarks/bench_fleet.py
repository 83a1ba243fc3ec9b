"""The cost of a supervisor that follows 100 robots, each of which reports its state once a second, on one broker.

`maya fleet watch` stands beside a bare client that receives the same. Both are processes of their own, as is the broker
(mosquitto); the robots' reports come from this process. A sample is the processor time that a process uses while all
robots report, by second: 100 ms are a tenth of a core.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from queue import Queue
from statistics import median
from tempfile import TemporaryDirectory
from threading import Thread

import aiomqtt
from harness import Case, Goal, Sample, cpu_time, measure, report

from maya_un.http import dates
from tests.system.brokers import broker
from tests.system.processes import MAYA

NUMBERS = count(1)
ROBOTS = 100
LASTS = 4
"""Reports of each robot in one sample, one a second."""


def client(port: int, name: str) -> aiomqtt.Client:
    """Return a client as maya has it."""
    return aiomqtt.Client("127.0.0.1", port, identifier=name, protocol=aiomqtt.ProtocolVersion.V5)


async def receive(port: int) -> None:
    """Receive what a supervisor receives, and write it to standard output."""
    async with client(port, "bare") as one:
        await one.subscribe([("maya/v1/+/progress", 0), ("maya/v1/+/results", 1), ("maya/v1/+/connection", 1)])
        async for message in one.messages:
            assert isinstance(message.payload, bytes)
            print(message.payload.decode(), flush=True)


class Follower:
    """A process that follows the robots; it writes a line for each message, which is read at once."""

    def __init__(self, held: ExitStack, *command: str) -> None:
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._lines: Queue[str] = Queue()
        held.callback(self._process.kill)
        Thread(target=self._read, daemon=True).start()

    def until(self, text: str) -> None:
        """Return when it wrote a line with `text`."""
        while text not in self._lines.get(timeout=60.0):
            pass

    @property
    def used(self) -> float:
        """The processor time that it has used [s]."""
        return cpu_time(self._process.pid)

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)


async def reports(port: int, last: str) -> None:
    """Have every robot report once a second, evenly spread; the last report has the id `last`."""
    async with client(port, "robots") as robots:
        begin = time.perf_counter()
        for number in range(LASTS * ROBOTS):
            await asyncio.sleep(begin + number / ROBOTS - time.perf_counter())
            id_ = last if number == LASTS * ROBOTS - 1 else f"step {number}"
            text = json.dumps({"id": id_, "state": "executing", "date": dates.now()})
            await robots.publish(f"maya/v1/R{number % ROBOTS}/progress", text, 1)


async def present(port: int) -> None:
    """Have every robot be present."""
    async with client(port, "robots") as robots:
        for number in range(ROBOTS):
            await robots.publish(f"maya/v1/R{number}/connection", '{"connection": "ONLINE"}', 1, retain=True)


def following(port: int, follower: Follower) -> Sample:
    """Return a sample of the processor time by second of reports [s]."""

    def sample() -> float:
        last, before = f"end {next(NUMBERS)}", follower.used
        asyncio.run(reports(port, last))
        follower.until(f'"{last}"')
        return (follower.used - before) / LASTS

    return sample


def main() -> None:
    """Measure; with the number of a port, be the bare client."""
    if len(sys.argv) > 1 and sys.argv[1].isdigit():
        asyncio.run(receive(int(sys.argv[1])))
        return
    with TemporaryDirectory() as folder, ExitStack() as held:
        one = held.enter_context(broker(Path(folder)))
        asyncio.run(present(one.port))
        bare = Follower(held, sys.executable, __file__, str(one.port))
        ours = Follower(held, MAYA, "--json", "fleet", "watch", "--url", one.url)
        bare.until("ONLINE")
        ours.until("ONLINE")
        cases = [
            Case("bare client, each second", following(one.port, bare), "ms"),
            Case("maya fleet watch, each second", following(one.port, ours), "ms", Goal(100.0)),
            Case(
                "the same, by the bare one", following(one.port, ours), "ms", Goal(2.0, to="bare client, each second")
            ),
        ]
        report(measure(cases, 3, median))


if __name__ == "__main__":
    main()
