"""The process layer behind its server: order of requests, and stop_queue."""

from __future__ import annotations

import json
import logging
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.diagnostics import DiagnosticLevel, DiagnosticStatus
from maya_ros.graph.protocol import Message, Publisher
from maya_ros.graph.servers.process import ProcessServer
from maya_un.errors import AnswerNeeded, NotConnected
from maya_un.robot.primitives import Primitive
from tests.virtual_time import elapse


@dataclass
class Queue:
    """Accepts jobs, each slowly, and records the order of requests."""

    asked: list[str] = field(default_factory=list[str])
    interrupted: bool = False
    error: NotConnected | None = None
    stops: int = 0
    waiting: list[str] = field(default_factory=list[str])

    async def append(self, primitives: Sequence[Primitive], stops: int) -> None:
        await elapse(1.0)
        if self.error is not None:
            raise self.error
        commands = " ".join(primitive.command for primitive in primitives)
        self.asked.append(commands)
        if stops < self.stops:
            self.waiting.append(commands)

    async def end_all(self) -> None:
        self.asked.append("end")
        await elapse(0.1)
        self.stops += 1

    async def resume(self) -> None:
        if self.interrupted:
            raise AnswerNeeded(question="what becomes of job 3", options="redo, abort")
        self.asked.append("resume")

    async def recover(self, choice: str, holding: bool | None) -> None:
        self.asked.append(f"{choice} {holding}")
        self.interrupted = False

    def told(self) -> Message:
        return {"mode": "paused", "interrupted": {"job": 3} if self.interrupted else None}

    def status(self) -> DiagnosticStatus:
        return DiagnosticStatus("maya: process", DiagnosticLevel.OK, "the queue is empty", {"queued": 0})


@dataclass
class Behind:
    queue: Queue
    send: Publisher
    start: Publisher
    stop: Publisher
    diagnostics: list[Message]
    status: list[Message]
    client: BusNode

    def refused(self) -> str:
        values = self.diagnostics[-1]["status"][0]["values"]
        return next(value["value"] for value in values if value["key"] == "last refused")


@asynccontextmanager
async def behind() -> AsyncIterator[Behind]:
    bus, queue, heard, told = Bus(), Queue(), list[Message](), list[Message]()
    client = bus.node("maya_dashboard")
    async with ProcessServer(queue).open(bus.node("process_controller")):
        client.subscribe("/diagnostics", "diagnostic_msgs/DiagnosticArray", heard.append)
        client.subscribe("/queue_status", "std_msgs/String", told.append)
        yield Behind(
            queue,
            client.advertise("/send_task", "maya_robot/MayaPrimitive"),
            client.advertise("/start_queue", "maya_process/ProcessQueue"),
            client.advertise("/stop_queue", "std_msgs/Empty"),
            heard,
            told,
            client,
        )


async def test_tasks_and_lists_are_appended_in_the_order_they_came() -> None:
    async with behind() as process:
        process.send.publish({"command": "home"})
        process.start.publish({"tasks": [{"command": "pick", "target": {"y": 1.0}}, {"command": "gripper"}]})
        process.send.publish({"command": "gripper", "open": True})
        await elapse(5.0)
        assert process.queue.asked == ["home", "pick gripper", "gripper"]


async def test_stop_passes_waiting_messages_and_ends_those_on_their_way() -> None:
    async with behind() as process:
        for _ in range(3):
            process.send.publish({"command": "home"})
        await elapse(0.5)  # the first is being appended now
        process.stop.publish({})
        await elapse(0.1)
        assert process.queue.asked == ["end"]
        await elapse(5.0)
        assert process.queue.asked == ["end", "home", "end"]
        process.send.publish({"command": "home"})
        await elapse(5.0)
        assert process.queue.asked[-1] == "home"


async def test_tasks_that_came_before_a_stop_wait_like_jobs() -> None:
    async with behind() as process:
        for command in ("home", "gripper"):
            process.send.publish({"command": command})
        process.start.publish({"tasks": [{"command": "pick"}]})
        await elapse(1.5)
        process.queue.stops += 1
        process.send.publish({"command": "place"})
        await elapse(5.0)
        assert process.queue.asked == ["home", "gripper", "pick", "place"]
        assert process.queue.waiting == ["gripper", "pick"]


@pytest.mark.parametrize("stopped", [False, True])
async def test_a_task_behind_stop_queue_waits_only_if_another_stop_follows(stopped: bool) -> None:
    async with behind() as process:
        process.stop.publish({})
        process.send.publish({"command": "home"})
        await elapse(0.5)
        process.queue.stops += stopped
        await elapse(5.0)
        assert process.queue.asked == ["end", "home"]
        assert process.queue.waiting == ["home"] * stopped


@pytest.mark.parametrize(
    ("tasks", "code"),
    [([], "4002"), ([{"command": "dance"}], "4003"), ([{"command": "pick", "target": {"x": None}}], "4001")],
)
async def test_refusal_is_logged_and_published(
    tasks: list[Message], code: str, caplog: pytest.LogCaptureFixture
) -> None:
    async with behind() as process:
        with caplog.at_level(logging.WARNING):
            process.start.publish({"tasks": tasks})
            await elapse(2.0)
        assert f"/start_queue: {code} " in caplog.text
        assert process.refused().startswith(f"/start_queue: {code} ")
        process.send.publish({"command": "home"})
        await elapse(3.0)
        assert process.refused() == ""


async def test_refusal_by_a_layer_ends_nothing_else() -> None:
    async with behind() as process:
        process.queue.error = NotConnected()
        process.send.publish({"command": "home"})
        await elapse(3.0)
        assert process.refused().startswith("/send_task: 1010 ")
        process.queue.error = None
        process.send.publish({"command": "home"})
        await elapse(3.0)
        assert process.queue.asked == ["home"]


async def test_queue_status_is_published_on_change_and_to_late_subscribers() -> None:
    async with behind() as process:
        await elapse(3.0)
        assert [json.loads(one["data"])["interrupted"] for one in process.status] == [None]
        process.queue.interrupted = True
        await elapse(1.0)
        assert json.loads(process.status[-1]["data"]) == {"mode": "paused", "interrupted": {"job": 3}}
        late = list[Message]()
        process.client.subscribe("/queue_status", "std_msgs/String", late.append)
        await elapse(0.1)
        assert late == process.status[-1:]


async def test_resume_queue_resumes_unless_an_interrupted_job_waits() -> None:
    async with behind() as process:
        process.queue.interrupted = True
        refused = await process.client.call("/resume_queue", {})
        assert (refused["success"], refused["message"].partition(":")[0]) == (False, str(AnswerNeeded.code))
        process.queue.interrupted = False
        assert await process.client.call("/resume_queue", {}) == {"success": True, "message": ""}
        assert process.queue.asked == ["resume"]


@pytest.mark.parametrize(("holding", "known"), [("", None), ("yes", True), ("no", False)])
async def test_recover_queue_hands_on_the_choice_and_the_answer(holding: str, known: bool | None) -> None:
    async with behind() as process:
        answer = await process.client.call("/recover_queue", {"choice": "redo", "holding": holding})
        assert answer == {"success": True, "code": "", "message": ""}
        assert process.queue.asked == [f"redo {known}"]


async def test_recover_queue_with_another_answer_is_refused() -> None:
    async with behind() as process:
        answer = await process.client.call("/recover_queue", {"choice": "redo", "holding": "maybe"})
        assert (answer["success"], answer["code"]) == (False, "4001")
        assert process.queue.asked == []
