"""`maya_un.supervisor` against a real broker, `maya coms`, `maya up` and its twin; one of them goes away."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from maya_un.errors import KeyReused, SupervisorsNotReached, Unreachable
from maya_un.steps.text import StepEnd, StepState, content_of
from maya_un.supervisor import Supervisor
from tests.system.brokers import Broker, broker, disconnect
from tests.system.observing import Observer, observing
from tests.system.processes import Process
from tests.system.test_coms import coms, robot
from tests.virtual_time import turn

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]


class BrokerSetup(NamedTuple):
    """A broker that keeps nothing over its end, an observer of it, and the address of a robot's rosbridge."""

    broker: Broker
    observer: Observer
    rosbridge: str

    def link(self) -> Process:
        """Run `maya coms`, connected."""
        return coms(self.broker, self.rosbridge, "--connect")


@pytest.fixture(scope="module")
def broker_setup(tmp_path_factory: pytest.TempPathFactory) -> Iterator[BrokerSetup]:
    folder = tmp_path_factory.mktemp("broker")
    with broker(folder) as one, robot() as rosbridge, observing(one) as observer:
        yield BrokerSetup(one, observer, rosbridge)


def run_story(story: Callable[[], Awaitable[None]]) -> None:
    async def main() -> None:
        async with asyncio.timeout(60.0):
            await story()

    asyncio.run(main())


async def presence(lab: Supervisor, name: str, state: str) -> None:
    """Wait until a robot's presence is `state`."""
    async for event in lab.watch():
        if event.robot == name and event.data.get("connection") == state:
            return


@pytest.mark.waits("2.4 s of homing at a hundred times real speed and 1 s of a pick, over a real broker")
def test_a_step_returns_its_result_or_raises_its_error(broker_setup: BrokerSetup) -> None:
    async def story() -> None:
        async with Supervisor(broker_setup.broker.url) as lab:
            await presence(lab, "MAYA", "ONLINE")
            maya = lab.robot("MAYA")
            step = maya.home()
            assert [report.state async for report in step][-1] is StepState.EXECUTING
            assert (await step).error is None
            assert (await maya.pick(0.5, 1.1, 0.4)).id in broker_setup.observer.commands()
            with pytest.raises(Unreachable, match="cannot be reached"):
                await maya.approach(5.0, 1.1, 0.4)
            assert maya.connection == "ONLINE"

    link = broker_setup.link()
    try:
        run_story(story)
    finally:
        link.kill()


def test_the_presence_of_a_robot_that_dies_is_broken(broker_setup: BrokerSetup) -> None:
    async def story() -> None:
        async with Supervisor(broker_setup.broker.url) as lab:
            await presence(lab, "MAYA", "ONLINE")
            link.kill()
            await presence(lab, "MAYA", "CONNECTION_BROKEN")
            assert lab.robots["MAYA"] == "CONNECTION_BROKEN"
        async with Supervisor(broker_setup.broker.url) as lab:
            assert lab.robots["MAYA"] == "CONNECTION_BROKEN"

    link = broker_setup.link()
    try:
        run_story(story)
    finally:
        link.kill()


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_step_for_a_robot_that_the_broker_never_knew_waits_for_it(broker_setup: BrokerSetup, tmp_path: Path) -> None:
    async def story() -> None:
        with broker(tmp_path) as one:
            async with Supervisor(one.url) as lab:
                assert "MAYA" not in lab.robots
                step = lab.robot("MAYA").home()
                link = coms(one, broker_setup.rosbridge, "--connect")
                try:
                    assert (await step).error is None
                finally:
                    link.kill()

    run_story(story)


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_step_survives_a_broker_that_forgets_everything(broker_setup: BrokerSetup, tmp_path: Path) -> None:
    async def story() -> None:
        with broker(tmp_path, "persistence false") as one:
            link = coms(one, broker_setup.rosbridge, "--connect")
            try:
                async with Supervisor(one.url) as lab:
                    await presence(lab, "MAYA", "ONLINE")
                    one.kill()
                    step = lab.robot("MAYA").home()
                    one.start()
                    assert (await step).error is None
            finally:
                link.kill()

    run_story(story)


def test_no_broker_is_reported_at_once(broker_setup: BrokerSetup, tmp_path: Path) -> None:
    async def story() -> None:
        with pytest.raises(SupervisorsNotReached, match="refused"):
            async with Supervisor(Broker(tmp_path).url):
                pass

    run_story(story)


def test_supervisor_needs_no_numpy_and_no_pydantic() -> None:
    line = "import maya_un.supervisor.process, sys; print({'numpy', 'pydantic'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", line], capture_output=True, check=True, text=True).stdout == "set()\n"


class AnsweringRobots:
    """Stands in for many robots: one plain client that answers every command at once.

    Before each result it publishes what a robot answers to another program that uses the same id.
    """

    DATE = "2026-01-31T12:00:00Z"

    def __init__(self, broker: Broker) -> None:
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
        self._client.on_message = self._answer
        subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()
        self._client.subscribe("maya/v1/+/commands", 1)
        assert subscribed.wait(30.0)

    def _answer(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        robot, id_ = message.topic.split("/")[2], json.loads(message.payload)["id"]
        other = content_of({"command": "gripper", "args": {"open": True}})
        refusal = StepEnd.refused(id_, KeyReused(key=id_), self.DATE, content=other)
        for result in (refusal, StepEnd(id_, None, None, self.DATE, self.DATE)):
            self._client.publish(f"maya/v1/{robot}/results", result.text, 1)

    def close(self) -> None:
        disconnect(self._client)


def test_no_result_is_missed_while_other_robots_are_added(tmp_path: Path) -> None:
    async def story() -> None:
        async with Supervisor(one.url) as lab:

            async def work(number: int) -> None:
                for _ in range(20 * number):
                    await turn()
                for _ in range(3):
                    await lab.robot(f"R{number}").home()

            await asyncio.gather(*map(work, range(50)))

    with broker(tmp_path) as one:
        crowd = AnsweringRobots(one)
        try:
            run_story(story)
        finally:
            crowd.close()
