"""Steps over a graph: /step_command in, /step_result out, with and without a subscriber."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, GraphHandle, Message
from maya_ros.graph.servers.steps import bridged
from maya_ros.graph.table import EVENT, STEP_COMMAND, STEP_RESULT, TASK
from maya_un.errors import NodeGone, StepNotBegun
from maya_un.steps.store import StepStore
from maya_un.steps.text import INTERRUPTED
from tests.virtual_time import elapse


@dataclass
class Cloud:
    """A client that sends steps and reads results, and a robot that does each step in a second."""

    bus: Bus
    results: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    tasks: list[str] = field(default_factory=list[str])

    def __post_init__(self) -> None:
        self.node: BusNode = self.bus.node("ros_coms")
        self._commands = self.node.advertise(STEP_COMMAND.name, STEP_COMMAND.type)

    def robot(self) -> GraphHandle:
        async def act(goal: Message, feedback: Feedback) -> Message:
            feedback({"phase": "begun"})
            self.tasks.append(goal["task"]["command"])
            await elapse(1.0)
            return success()

        return self.bus.node("primitive_server").act(TASK.name, TASK.type, act)

    def listens(self) -> GraphHandle:
        def heard(message: Message) -> None:
            self.results.append(json.loads(message["data"]))

        return self.node.subscribe(STEP_RESULT.name, STEP_RESULT.type, heard)

    def sends(self, id_: str, name: str = "home") -> None:
        self._commands.publish({"data": json.dumps({"id": id_, "command": name})})


@asynccontextmanager
async def bridge(cloud: Cloud, folder: Path) -> AsyncIterator[None]:
    store = await StepStore.open(folder / "steps.db")
    node = cloud.bus.node("firebase_bridge")
    async with bridged(node, store, lambda: "now"):
        yield
    await store.close()
    node.close()


async def test_every_command_has_one_result(tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.robot()
    cloud.listens()
    async with bridge(cloud, tmp_path):
        for id_, name in (("1", "home"), ("2", "fly"), ("3", "home")):
            cloud.sends(id_, name)
            await elapse(2.0)
    assert [(result["id"], result["success"]) for result in cloud.results] == [("1", True), ("2", False), ("3", True)]
    assert cloud.tasks == ["home", "home"]


async def test_result_waits_for_a_subscriber(tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.robot()
    async with bridge(cloud, tmp_path):
        cloud.sends("1")
        await elapse(30.0)
        assert cloud.tasks == ["home"]
        cloud.listens()
        await elapse(1.0)
        assert [result["id"] for result in cloud.results] == ["1"]


async def test_result_without_a_subscriber_is_published_once_by_the_next_run(tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.robot()
    async with bridge(cloud, tmp_path):
        cloud.sends("1")
        await elapse(5.0)
    ear = cloud.listens()
    async with bridge(cloud, tmp_path):
        await elapse(1.0)
    assert [(result["id"], result["success"]) for result in cloud.results] == [("1", True)]
    async with bridge(cloud, tmp_path):
        await elapse(1.0)
    assert len(cloud.results) == 1
    ear.close()


async def test_bridge_needs_no_robot_and_reports_a_missing_one(tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.listens()
    async with bridge(cloud, tmp_path):
        cloud.sends("1")
        await elapse(1.0)
        assert cloud.results[0]["code"] == str(NodeGone.code)
        cloud.robot()
        cloud.sends("2")
        await elapse(2.0)
        assert cloud.results[1]["success"]
    assert cloud.tasks == ["home"]


async def test_end_of_the_bridge_stops_its_step_and_reports_it(tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.robot()
    cloud.listens()
    async with bridge(cloud, tmp_path):
        cloud.sends("1")
        await elapse(0.5)
    assert [(result["id"], result["code"]) for result in cloud.results] == [("1", "2202")]
    assert cloud.results[0]["code"] != INTERRUPTED


@pytest.mark.parametrize("word", ["stopped", "limit", "fault", "estop"])
async def test_after_a_stop_between_steps_no_step_begins_that_waits(word: str, tmp_path: Path) -> None:
    cloud = Cloud(Bus())
    cloud.robot()
    cloud.listens()
    events = cloud.bus.node("hw_simulator").advertise(EVENT.name, EVENT.type)
    async with bridge(cloud, tmp_path):
        cloud.sends("1")
        cloud.sends("2")
        await elapse(0.5)
        events.publish({"data": word + " {}"})
        await elapse(2.0)
        cloud.sends("3")
        await elapse(2.0)
    assert [(result["id"], result["code"]) for result in cloud.results] == [
        ("1", "2202"),
        ("2", str(StepNotBegun.code)),
        ("3", None),
    ]
