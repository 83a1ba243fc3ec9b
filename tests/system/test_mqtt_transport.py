"""The link of one robot over a real broker: an agent in this process, the robot's journal behind a real rosbridge."""

from __future__ import annotations

import asyncio
import json
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from random import Random

import aiomqtt
import pytest
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from dmc41x3.loops import run
from maya_un.coms.agent import Agent
from maya_un.coms.mqtt import Broker as Address
from maya_un.coms.mqtt import Mqtt
from maya_un.coms.robot import Rosbridge
from maya_un.errors import SessionTakenOver
from maya_un.http import dates
from maya_un.steps.store import StepStore
from tests.system.brokers import Broker, broker
from tests.unit.coms.test_agent import Robot, command
from tests.waiting import until

pytestmark = [pytest.mark.system, pytest.mark.timeout(120)]

COMMANDS = "maya/v1/MAYA/commands"


def client(one: Broker) -> aiomqtt.Client:
    return aiomqtt.Client("127.0.0.1", one.port, protocol=aiomqtt.ProtocolVersion.V5)


@asynccontextmanager
async def linked(one: Broker, robot: Robot) -> AsyncIterator[Agent]:
    """Run an agent while the block runs."""
    agent = Agent("MAYA", Rosbridge(robot.url), Mqtt(Address(one.url)), dates.now, Random(1))
    running = asyncio.create_task(agent.run())
    try:
        yield agent
    finally:
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running


Story = Callable[[Broker, Robot], Awaitable[None]]


def run_story(story: Story, folder: Path) -> None:
    """Run a story with a broker and a robot."""

    async def main(one: Broker) -> None:
        async with AsyncExitStack() as stack, asyncio.timeout(100.0):
            store = await StepStore.open(folder / "steps.db")
            stack.push_async_callback(store.close)
            robot = Robot(store)
            await stack.enter_async_context(robot.bridge())
            await stack.enter_async_context(robot.rosbridge())
            await story(one, robot)

    with broker(folder) as one:
        run(main(one))


def connected(agent: Agent) -> bool:
    status = agent.status()
    return bool(status["robot"]["connected"] and status["supervisors"]["connected"])


def test_repeated_command_does_not_block_others(tmp_path: Path) -> None:
    async def story(one: Broker, robot: Robot) -> None:
        robot.go.clear()
        async with linked(one, robot) as agent, client(one) as lab:
            await until(lambda: connected(agent))
            for _ in range(50):  # a broker hands out 20 messages that are not acknowledged
                await lab.publish(COMMANDS, command("1"), 1)
            await until(lambda: robot.begun == ["home"])
            robot.go.set()
            await lab.publish(COMMANDS, command("2", "can_teleop"), 1)
            await until(lambda: robot.begun == ["home", "can_teleop"])

    run_story(story, tmp_path)


def test_the_link_ends_while_the_broker_does_not_answer(tmp_path: Path) -> None:
    async def story(one: Broker, robot: Robot) -> None:
        async with asyncio.timeout(30.0), linked(one, robot) as agent:
            await until(lambda: connected(agent))
            one.signal(signal.SIGSTOP)

    run_story(story, tmp_path)


def test_a_broker_that_forgot_the_last_seconds_does_not_keep_a_robot_away(tmp_path: Path) -> None:
    async def story(one: Broker, robot: Robot) -> None:
        stored = one.folder / "mosquitto.db"
        earlier = Mqtt(Address(one.url))
        async with earlier.connected("MAYA", "journal"):
            await until(lambda: stored.exists() and earlier.session.encode() in stored.read_bytes())
            before = stored.read_bytes()
        async with linked(one, robot) as agent:
            await until(lambda: connected(agent))
            one.kill()
            await until(lambda: not agent.status()["supervisors"]["connected"])
            stored.write_bytes(before)  # there, this robot's last run is still online
            one.start()
            await until(lambda: connected(agent) or agent.status()["supervisors"]["code"] == SessionTakenOver.code)
            assert connected(agent)

    run_story(story, tmp_path)


def test_a_retained_command_is_not_carried_out_because_the_robot_connects(tmp_path: Path) -> None:
    async def story(one: Broker, robot: Robot) -> None:
        async with client(one) as lab:
            await lab.publish(COMMANDS, command("old"), 1, retain=True)
            async with linked(one, robot) as agent:
                await until(lambda: connected(agent))
                await lab.publish(COMMANDS, command("new", "can_teleop"), 1)
                await until(lambda: robot.begun != [])
        assert robot.begun == ["can_teleop"]

    run_story(story, tmp_path)


def test_a_result_of_an_earlier_connection_does_not_answer_another_command(tmp_path: Path) -> None:
    async def story(one: Broker, robot: Robot) -> None:
        robot.go.clear()
        async with linked(one, robot) as agent:
            await until(lambda: connected(agent))
            async with client(one) as lab:
                await lab.publish(COMMANDS, command("old"), 1)
            await until(lambda: robot.begun == ["home"])
            one.kill()
            (one.folder / "mosquitto.db").unlink(missing_ok=True)
            await until(lambda: not agent.status()["supervisors"]["connected"])
            one.start()
            await until(lambda: connected(agent))
            async with client(one) as lab:
                await lab.subscribe("answers")
                properties = Properties(PacketTypes.PUBLISH)
                properties.ResponseTopic = "answers"
                await lab.publish(COMMANDS, command("new", "can_teleop"), 1, properties=properties)
                await until(lambda: "new" in agent.status()["steps"])
                robot.go.set()
                async for message in lab.messages:
                    assert isinstance(message.payload, bytes)
                    assert json.loads(message.payload)["id"] == "new"
                    break

    run_story(story, tmp_path)
