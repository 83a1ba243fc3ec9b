"""The supervisors' server is away for ten minutes of the link's clock; the supervisors are those of the chaos."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, AsyncExitStack, closing, contextmanager, suppress
from pathlib import Path
from random import Random
from typing import cast

import pytest

from dmc41x3.loops import ScaledLoop, run
from maya_un.coms.agent import Agent
from maya_un.coms.robot import Rosbridge
from maya_un.coms.selection import transport_of
from maya_un.coms.settings import from_environment
from maya_un.coms.transport import LONGEST_PAUSE
from maya_un.http import dates
from maya_un.steps.store import StepStore
from tests.system import coms_chaos, test_coms_chaos, test_coms_firestore_chaos, test_coms_rtdb_chaos
from tests.system.brokers import broker
from tests.system.rtdb.server import realtime_database
from tests.system.test_coms_rtdb import RULES, admit
from tests.unit.coms.test_agent import Robot
from tests.waiting import until

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

AWAY = 600.0
"""Time without a server [s, loop time]."""

HURRY = 200.0
"""Speed of the loop's clock meanwhile."""

Place = tuple[str, dict[str, str], coms_chaos.Server, coms_chaos.Supervisor]
"""The URL of a server, the environment that signs the link in, the server, and a supervisor at it."""


@contextmanager
def mqtt(folder: Path) -> Iterator[Place]:
    with broker(folder) as one, closing(test_coms_chaos.Supervisor(one)) as lab:
        yield one.url, {}, coms_chaos.Server(one.port, one.kill, one.start), lab


@contextmanager
def rtdb(_: Path) -> Iterator[Place]:
    with realtime_database(RULES) as one:
        server = coms_chaos.Server(one.port, one.go_away, one.come_back)
        yield f"{one.url}/?ns=demo", admit(one), server, test_coms_rtdb_chaos.Supervisor(one)


@contextmanager
def firestore(_: Path) -> Iterator[Place]:
    with realtime_database() as one:
        one.set_document("robots/MAYA", {})
        environment = {"FIRESTORE_EMULATOR_HOST": f"127.0.0.1:{one.port}", **admit(one)}
        server = coms_chaos.Server(one.port, one.go_away, one.come_back)
        yield "firestore://demo", environment, server, test_coms_firestore_chaos.Supervisor(one)


async def story(agent: Agent, robot: Robot, server: coms_chaos.Server, lab: coms_chaos.Supervisor) -> None:
    """Have commands sent before and behind ten minutes without the server; returns when each has its result."""
    loop = cast(ScaledLoop, asyncio.get_running_loop())

    async def send(*numbers: int) -> None:
        for number in numbers:
            await asyncio.to_thread(lab.send, number, (0.5, 0.9, 0.5))

    def steps() -> list[str]:
        return list(agent.status()["steps"].values())

    await until(lambda: agent.status()["supervisors"]["connected"])
    robot.go.clear()
    await send(1, 2, 3)
    await until(lambda: len(robot.begun) == 1 and len(steps()) == 3 and "sending" not in steps())
    await asyncio.to_thread(server.kill)
    began = loop.time()
    robot.go.set()
    await until(lambda: steps() == ["result"] * 3)
    assert len(robot.begun) == 3
    loop.speed = HURRY
    await until(lambda: loop.time() - began > AWAY)
    loop.speed = 1.0
    assert not agent.status()["supervisors"]["connected"]
    assert steps() == ["result"] * 3
    await asyncio.to_thread(server.start)
    back = loop.time()
    await send(4, 5)
    await asyncio.to_thread(lab.send_again)
    while await asyncio.to_thread(lambda: lab.unanswered):
        assert loop.time() - back < 10.0 * LONGEST_PAUSE
        await asyncio.to_thread(lab.wait)
    assert len(robot.begun) == 5


async def linked(place: Place, folder: Path) -> None:
    """Run the story with a robot and its link."""
    url, environment, server, lab = place
    settings = from_environment({**environment, "NAME": "MAYA", "MAYA_COMS_URL": url})
    async with AsyncExitStack() as stack:
        store = await StepStore.open(folder / "steps.db")
        stack.push_async_callback(store.close)
        robot = Robot(store)
        await stack.enter_async_context(robot.bridge())
        await stack.enter_async_context(robot.rosbridge())
        agent = Agent("MAYA", Rosbridge(robot.url), transport_of(settings), dates.now, Random(1))
        running = asyncio.create_task(agent.run())
        try:
            await story(agent, robot, server, lab)
        finally:
            running.cancel()
            with suppress(asyncio.CancelledError):
                await running


@pytest.mark.waits("3 s for ten minutes at 200 times real speed, and up to 10 s until the link tries again")
@pytest.mark.parametrize("there", [mqtt, rtdb, firestore])
def test_commands_survive_ten_minutes_without_a_server(
    there: Callable[[Path], AbstractContextManager[Place]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with there(tmp_path) as place:
        _, environment, _, lab = place
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        run(linked(place, tmp_path), lambda: ScaledLoop(1.0))
        results = lab.results()
    assert sorted(key for key, _ in results) == sorted(lab.sent), "every command has one result, given once"
    assert all(value["success"] for _, value in results)
    assert len({json.dumps(value, sort_keys=True) for _, value in results}) == 5, "every id has one final result"
