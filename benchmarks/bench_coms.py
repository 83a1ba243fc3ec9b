"""How long a supervisor's command takes to the robot over MQTT, beside a bare round trip through the same broker.

The broker (mosquitto) and `maya coms` are processes of their own, and so is the bare client that sends back what it
gets. The supervisor, the rosbridge and the robot's journal are in this process. A step is free of motion, so what is
measured is the way: broker, link, rosbridge, and the two writes of the journal to the disk before a step begins.
"""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import time
from collections.abc import Callable, Coroutine
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from socket import IPPROTO_TCP, TCP_NODELAY
from statistics import median
from tempfile import TemporaryDirectory

import aiomqtt
from harness import Case, Goal, Sample, measure, report

from maya_un.graph.protocol import Feedback, Message
from maya_un.graph.step_store import StepStore
from maya_un.loops import run
from tests.system.brokers import broker
from tests.system.processes import Process
from tests.unit.coms.test_agent import Robot

TIMES = 100
"""Commands one after the other make one sample."""


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


class Timed(Robot):
    """A robot that notes when a step begins [s]."""

    at = 0.0
    begun_one = asyncio.Event()

    async def _act(self, goal: Message, feedback: Feedback) -> Message:
        self.at = time.perf_counter()
        self.begun_one.set()
        return await super()._act(goal, feedback)


def resident_memory(pid: int) -> float:
    """Return the resident memory of a process [bytes]."""
    status = Path(f"/proc/{pid}/status").read_text()
    return float(re.findall(r"VmRSS:\s+(\d+)", status)[0]) * 1024


async def bench(folder: Path) -> None:
    """Measure and report."""
    numbers = count(1)
    with ExitStack() as held:
        one = held.enter_context(broker(folder))
        echoing = subprocess.Popen([sys.executable, __file__, str(one.port)], stdout=subprocess.PIPE)  # noqa: ASYNC220
        held.callback(echoing.kill)
        assert echoing.stdout is not None
        await asyncio.to_thread(echoing.stdout.readline)
        robot = Timed(await StepStore.open(folder / "steps.db"))
        async with robot.bridge(), robot.rosbridge(), client(one.port, "lab") as lab:
            await lab.subscribe([("bench/back", 1), ("maya/v1/MAYA/results", 1), ("maya/v1/MAYA/connection", 1)])
            link = Process(f"coms --connect --port 0 --url {one.url} --rosbridge {robot.url}")
            held.callback(link.kill)
            await anext(lab.messages)

            async def to_robot() -> float:
                times: list[float] = []
                for _ in range(TIMES):
                    robot.begun_one.clear()
                    text = json.dumps({"id": f"b{next(numbers)}", "command": "can_teleop"})
                    asked = time.perf_counter()
                    await lab.publish("maya/v1/MAYA/commands", text, 1)
                    await robot.begun_one.wait()
                    times.append(robot.at - asked)
                    await anext(lab.messages)
                return median(times)

            async def bare() -> float:
                times: list[float] = []
                for _ in range(TIMES):
                    asked = time.perf_counter()
                    await lab.publish("bench/there", b"x" * 60, 1)
                    await anext(lab.messages)
                    times.append(time.perf_counter() - asked)
                return median(times)

            loop = asyncio.get_running_loop()

            def sampled(work: Callable[[], Coroutine[None, None, float]]) -> Sample:
                return lambda: asyncio.run_coroutine_threadsafe(work(), loop).result()

            cases = [
                Case("bare round trip", sampled(bare), "ms"),
                Case("command to its begin", sampled(to_robot), "ms", Goal(2.0, to="bare round trip")),
            ]
            figures = await asyncio.to_thread(measure, cases, 5, median)
            resident = resident_memory(link.number)
            memory = [Case("memory of maya coms", lambda: resident, "MB", Goal(60.0))]
            report([*figures, *measure(memory, 1)])
        await robot.store.close()


def main() -> None:
    """Measure in a folder of its own, or be the client that sends back."""
    if len(sys.argv) > 1 and sys.argv[1].isdigit():
        asyncio.run(echo(int(sys.argv[1])))
        return
    with TemporaryDirectory() as folder:
        run(bench(Path(folder)))


if __name__ == "__main__":
    main()
