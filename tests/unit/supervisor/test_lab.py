"""The connection of a supervisor, with a client instead of a broker."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, cast

import aiomqtt
import pytest

from maya_un.coms.mqtt import Broker
from maya_un.errors import StepFailed
from maya_un.supervisor import Supervisor
from maya_un.supervisor.lab import ONLINE
from tests.virtual_time import turn
from tests.waiting import until


class Messages:
    """The messages of a client, in their order."""

    def __init__(self) -> None:
        self.queue: asyncio.Queue[aiomqtt.Message] = asyncio.Queue()

    def __len__(self) -> int:
        return self.queue.qsize()

    def __aiter__(self) -> Messages:
        return self

    async def __anext__(self) -> aiomqtt.Message:
        return await self.queue.get()


class Client:
    """A connection to a broker; `publishing` tells that a message is on its way, and waits while `free` is not set."""

    def __init__(self) -> None:
        self.messages = Messages()
        self.published = list[str]()
        self.free = asyncio.Event()
        self.free.set()

    async def subscribe(self, topics: object, **_: object) -> list[int]:
        return [0] * (len(topics) if isinstance(topics, list) else 1)

    async def publish_checked(self, where: str, text: str) -> bool:
        del where
        self.published.append(json.loads(text)["command"])
        await self.free.wait()
        return True

    def acknowledge(self, _: aiomqtt.Message) -> None:
        pass

    def hear(self, kind: str, data: dict[str, Any]) -> None:
        text = json.dumps(data).encode()
        self.messages.queue.put_nowait(aiomqtt.Message(f"maya/v1/MAYA/{kind}", text, 0, False, 1, None))


def supervisor_of(client: Client) -> Supervisor:
    class Place:
        where = "mqtt://lab"

        @asynccontextmanager
        async def connected(self, *_: object, **__: object) -> AsyncIterator[Client]:
            yield client

    lab = Supervisor("mqtt://lab")
    lab._broker = cast("Broker", Place())
    return lab


async def test_step_without_a_result_ends_with_the_block_and_says_whether_it_was_sent() -> None:
    client = Client()
    client.free.clear()
    async with supervisor_of(client) as lab:
        robot = lab.robot("MAYA")
        sent = robot.home()
        await until(lambda: client.published == ["home"])
        waiting = robot.can_teleop()
    later = robot.home()
    for step, code in ((sent, "RESULT_UNKNOWN"), (waiting, "NOT_SENT"), (later, "NOT_SENT")):
        async with asyncio.timeout(5.0):
            with pytest.raises(StepFailed, match="closed the connection") as found:
                await step
        assert found.value.details["error_code"] == code
        assert [report async for report in step] == []
    assert client.published == ["home"]


async def test_step_is_sent_again_if_its_robot_connects_while_it_is_sent() -> None:
    client = Client()
    async with supervisor_of(client) as lab:
        client.free.clear()
        step = lab.robot("MAYA").home()
        await until(lambda: client.published == ["home"])
        client.hear("connection", {"connection": ONLINE})
        await until(lambda: lab.robots == {"MAYA": ONLINE})
        client.free.set()
        await until(lambda: client.published == ["home", "home"])
        client.hear("results", {"id": step.id, "success": True, "started": "", "finished": ""})
        assert (await step).error is None
        await turn()
        assert client.published == ["home", "home"]
