"""How long a supervisor's command takes until its step begins, over MQTT and over a Realtime Database.

Each way stands beside the least that its transport takes: a round trip between two bare MQTT clients through the same
broker, and a bare write to the same database until its event comes back, with a conditional write after it as a claim
needs it (docs/decisions/0044). The broker (mosquitto), the database (the
tests' own), `maya coms` and the bare client that sends back are processes of their own. The supervisor, the rosbridge
and the robot's journal are in this process. A step is free of motion, so what is measured is the way: transport, link,
rosbridge, and the write of the journal to the disk before a step begins, which stands beside the others by itself.
"""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager
from itertools import count
from pathlib import Path
from socket import IPPROTO_TCP, TCP_NODELAY
from statistics import median
from tempfile import TemporaryDirectory

import aiomqtt
import httpx
from harness import Case, Goal, Sample, measure, report

from dmc41x3.loops import run
from maya_ros.graph.protocol import Feedback, Message
from maya_un.http import dates
from maya_un.steps.store import StepStore
from tests.system.brokers import broker
from tests.system.processes import Process
from tests.system.rtdb.server import realtime_database
from tests.unit.coms.test_agent import Robot

TIMES = 100
"""Commands one after the other make one sample."""

ROUNDS = 5


def client(port: int, name: str) -> aiomqtt.Client:
    """Return a client as maya has it."""
    return aiomqtt.Client(
        "127.0.0.1",
        port,
        identifier=name,
        protocol=aiomqtt.ProtocolVersion.V5,
        socket_options=[(IPPROTO_TCP, TCP_NODELAY, 1)],
    )


async def echo(port: int) -> None:
    """Send back what comes."""
    async with client(port, "echo") as one:
        await one.subscribe("bench/there", 1)
        print("here", flush=True)
        async for message in one.messages:
            await one.publish("bench/back", message.payload, 1)


def serve_database() -> None:
    """Serve a database until the end of standard input."""
    with realtime_database() as one:
        print(one.url, flush=True)
        sys.stdin.read()


class Timed(Robot):
    """A robot that notes when a step begins [s]."""

    at = 0.0

    def __init__(self, store: StepStore) -> None:
        super().__init__(store)
        self.begun_one = asyncio.Event()

    async def _act(self, goal: Message, feedback: Feedback) -> Message:
        self.at = time.perf_counter()
        self.begun_one.set()
        return await super()._act(goal, feedback)

    async def times(self, send: Callable[[str], Awaitable[object]], ended: Callable[[], Awaitable[object]]) -> float:
        """Return the median time from `send` with an id to the begin of that step [s]; `ended` waits for its result."""
        times: list[float] = []
        for _ in range(TIMES):
            self.begun_one.clear()
            asked = time.perf_counter()
            await send(f"b{next(NUMBERS)}")
            await self.begun_one.wait()
            times.append(self.at - asked)
            await ended()
        return median(times)


NUMBERS = count(1)


def resident_memory(pid: int) -> float:
    """Return the resident memory of a process [bytes]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return float(re.findall(r"VmRSS:\s+(\d+)", status)[0]) * 1024


def started(held: AsyncExitStack, word: str) -> str:
    """Run this file as a process of its own until the end; return the first line that it says."""
    process = subprocess.Popen([sys.executable, __file__, word], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    held.callback(process.kill)
    assert process.stdout is not None
    return process.stdout.readline().decode().strip()


def link(held: AsyncExitStack, url: str, robot: Robot) -> Process:
    """Run `maya coms` between a robot and its supervisors until the end."""
    process = Process(f"coms --connect --port 0 --url {url} --rosbridge {robot.url}", cold=True)
    held.callback(process.kill)
    return process


def sampled(work: Callable[[], Coroutine[None, None, float]]) -> Sample:
    """Return a sample, for a thread of its own, of what takes its time in this loop."""
    loop = asyncio.get_running_loop()
    return lambda: asyncio.run_coroutine_threadsafe(work(), loop).result()


@asynccontextmanager
async def timed_robot(journal: Path) -> AsyncIterator[Timed]:
    """Give a robot with this journal, behind a rosbridge."""
    robot = Timed(await StepStore.open(journal))
    try:
        async with robot.bridge(), robot.rosbridge():
            yield robot
    finally:
        await robot.store.close()


async def mqtt(held: AsyncExitStack, folder: Path) -> list[Case]:
    """Return the cases over MQTT."""
    one = held.enter_context(broker(folder))
    started(held, str(one.port))
    robot = await held.enter_async_context(timed_robot(folder / "mqtt.db"))
    lab = await held.enter_async_context(client(one.port, "lab"))
    await lab.subscribe([("bench/back", 1), ("maya/v1/MAYA/results", 1), ("maya/v1/MAYA/connection", 1)])
    coms = link(held, one.url, robot)
    await anext(lab.messages)

    async def bare() -> float:
        times: list[float] = []
        for _ in range(TIMES):
            asked = time.perf_counter()
            await lab.publish("bench/there", b"x" * 60, 1)
            await anext(lab.messages)
            times.append(time.perf_counter() - asked)
        return median(times)

    async def to_robot() -> float:
        def send(id_: str) -> Awaitable[None]:
            return lab.publish("maya/v1/MAYA/commands", json.dumps({"id": id_, "command": "can_teleop"}), 1)

        return await robot.times(send, lambda: anext(lab.messages))

    return [
        Case("MQTT: bare round trip", sampled(bare), "ms"),
        Case("MQTT: command to its begin", sampled(to_robot), "ms", Goal(1.0)),
        Case("MQTT: the same, by the bare one", sampled(to_robot), "ms", Goal(2.0, to="MQTT: bare round trip")),
        Case("memory of maya coms", lambda: resident_memory(coms.number), "MB", Goal(60.0)),
    ]


async def rtdb(held: AsyncExitStack, folder: Path) -> list[Case]:
    """Return the cases over a database."""
    url = started(held, "database")
    robot = await held.enter_async_context(timed_robot(folder / "rtdb.db"))
    lab = await held.enter_async_context(httpx.AsyncClient(base_url=url, timeout=60.0))

    async def put(path: str, value: object) -> None:
        (await lab.put(f"/{path}.json?print=silent", json=value)).raise_for_status()

    async def stream(path: str) -> Callable[[], Awaitable[str]]:
        """Listen to a path; return how to wait for the next event."""
        accept = {"Accept": "text/event-stream"}
        lines = (await held.enter_async_context(lab.stream("GET", f"/{path}.json", headers=accept))).aiter_lines()

        async def data() -> str:
            while not (line := await anext(lines)).startswith("data: {"):
                pass
            return line

        await data()  # the data at the beginning
        return data

    there, result, presence = await stream("bench"), await stream("robots/MAYA/results"), await stream("robots")
    link(held, url, robot)
    while "ONLINE" not in await presence():
        pass

    async def bare() -> float:
        times: list[float] = []
        for _ in range(TIMES):
            asked = time.perf_counter()
            write = asyncio.create_task(put("bench", "x" * 60))
            await there()
            times.append(time.perf_counter() - asked)
            await write
        return median(times)

    async def claimed() -> float:
        tag = {"X-Firebase-ETag": "true"}
        tag = {**tag, "If-Match": (await lab.get("/bench-claims.json", headers=tag)).headers["ETag"]}
        times: list[float] = []
        for number in range(TIMES):
            asked = time.perf_counter()
            write = asyncio.create_task(put("bench", f"x{number}"))
            await there()
            answer = await lab.put("/bench-claims.json", json={"b": number}, headers=tag)
            times.append(time.perf_counter() - asked)
            tag["If-Match"] = answer.raise_for_status().headers["ETag"]
            await write
        return median(times)

    async def to_robot() -> float:
        async def send(id_: str) -> None:
            await put(f"robots/MAYA/commands/{id_}", {"command": "can_teleop"})

        return await robot.times(send, result)

    return [
        Case("RTDB: bare write to its event", sampled(bare), "ms"),
        Case("RTDB: a bare claim too", sampled(claimed), "ms"),
        Case("RTDB: command to its begin", sampled(to_robot), "ms", Goal(3.0)),
        Case(
            "RTDB: the same, by the bare claim",
            sampled(to_robot),
            "ms",
            Goal(2.0, to="RTDB: a bare claim too"),
        ),
    ]


async def journal(held: AsyncExitStack, folder: Path) -> list[Case]:
    """Return the case of the journal alone."""
    store = await StepStore.open(folder / "alone.db")
    held.push_async_callback(store.close)

    async def written() -> float:
        times: list[float] = []
        for _ in range(TIMES):
            asked = time.perf_counter()
            await store.accept(f"b{next(NUMBERS)}", "0" * 64, dates.now(), (), begins=True)
            times.append(time.perf_counter() - asked)
        return median(times)

    return [Case("write of the journal", sampled(written), "ms")]


async def bench(folder: Path) -> None:
    """Measure and report."""
    async with AsyncExitStack() as held:
        cases = [*await mqtt(held, folder), *await rtdb(held, folder), *await journal(held, folder)]
        report(await asyncio.to_thread(measure, cases, ROUNDS, median))


def main() -> None:
    """Measure in a folder of its own; with a word, be one of the processes beside it."""
    word = sys.argv[1] if len(sys.argv) > 1 else ""
    if word == "database":
        serve_database()
    elif word.isdigit():
        asyncio.run(echo(int(word)))
    else:
        with TemporaryDirectory() as folder:
            run(bench(Path(folder)))


if __name__ == "__main__":
    main()
