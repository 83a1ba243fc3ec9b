"""The robot's side: /step_robot, /step_command, /step_status and /step_result over any rosbridge."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import WebSocketException

from maya_un.coms.settings import where_of
from maya_un.coms.transport import Report, ReportKind
from maya_un.errors import RobotNotReached
from maya_un.steps.text import COMMAND_TOPIC, RESULT_TOPIC, ROBOT_TOPIC, STATUS_TOPIC, TEXT_TYPE, RobotIdentity

LONGEST = 1 << 20
"""Maximum length of a message from rosbridge [bytes]."""

_PING = 5.0
"""Interval of pings and timeout of their answer [s]; an unanswered connection ends after both."""


class RosbridgeLink:
    """A connection to a rosbridge. The methods raise `RobotNotReached` when it has ended.

    `ask` subscribes to the robot's identity. Reports of the robot arrive after `prepare` only.
    """

    def __init__(self, socket: ClientConnection, url: str, prefix: str) -> None:
        self._socket = socket
        self._url = url
        self._prefix = prefix

    async def ask(self) -> None:
        """Subscribe to the robot's identity; `receive` returns it, and that of a robot that replaces this one."""
        await self._say("subscribe", ROBOT_TOPIC, type=TEXT_TYPE, queue_length=0)

    async def prepare(self) -> None:
        """Advertise commands and subscribe to their states and results."""
        await self._say("advertise", COMMAND_TOPIC, type=TEXT_TYPE)
        for topic in (STATUS_TOPIC, RESULT_TOPIC):
            await self._say("subscribe", topic, type=TEXT_TYPE, queue_length=0)

    async def send(self, text: str) -> None:
        """Publish a command."""
        await self._say("publish", COMMAND_TOPIC, msg={"data": text})

    async def receive(self) -> Report | RobotIdentity | str:
        """Return the next report, the identity of the robot, or the text of an error of the rosbridge itself."""
        while True:
            try:
                message = json.loads(await self._socket.recv())
            except (WebSocketException, ValueError, RecursionError) as error:
                raise RobotNotReached(url=self._url, reason=str(error)) from error
            found = _read(message, self._prefix) if isinstance(message, dict) else None
            if found is not None:
                return found

    async def _say(self, op: str, topic: str, **more: object) -> None:
        try:
            await self._socket.send(json.dumps({"op": op, "topic": self._prefix + topic, **more}))
        except WebSocketException as error:
            raise RobotNotReached(url=self._url, reason=str(error)) from error


@dataclass(frozen=True, slots=True)
class Rosbridge:
    """The address of the robot's rosbridge; `token` is sent to it if not empty, `namespace` precedes the topics."""

    url: str
    token: str = ""
    namespace: str = ""

    @property
    def where(self) -> str:
        """The address without credentials."""
        return where_of(self.url)

    @asynccontextmanager
    async def connected(self) -> AsyncIterator[RosbridgeLink]:
        """Connect; raises `RobotNotReached` if no rosbridge answers."""
        headers = {"Authorization": f"Bearer {self.token}"} if self.token else {}
        try:
            socket = await connect(
                self.url,
                additional_headers=headers,
                max_size=LONGEST,
                compression=None,
                ping_interval=_PING,
                ping_timeout=_PING,
            )
        except (OSError, ValueError, WebSocketException) as error:  # ValueError: an invalid port or name
            raise RobotNotReached(url=self.where, reason=str(error).replace(self.url, self.where)) from None
        async with socket:
            link = RosbridgeLink(socket, self.where, self.namespace.rstrip("/"))
            await link.ask()
            yield link


def _read(message: dict[str, Any], prefix: str) -> Report | RobotIdentity | str | None:
    """Return the content of a rosbridge message, None if it concerns neither steps nor the robot."""
    if message.get("op") == "status":
        return str(message.get("msg", "")) if message.get("level") == "error" else None
    try:
        text = str(message["msg"]["data"])
        data = json.loads(text)
        topic = message.get("topic")
        if topic == prefix + ROBOT_TOPIC:
            return RobotIdentity(str(data["name"]), str(data["journal"]))
        id_ = data["id"]
        if not isinstance(id_, str):
            return None
        if topic == prefix + RESULT_TOPIC:
            return Report(id_, ReportKind.RESULT, text)
        return Report(id_, ReportKind(data["state"]), text) if topic == prefix + STATUS_TOPIC else None
    except (KeyError, RecursionError, TypeError, ValueError):
        return None
