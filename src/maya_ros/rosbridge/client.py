"""What every concern of a session shares: the graph, the way out, who is told what."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Coroutine, Mapping
from enum import IntEnum
from typing import Any

from maya_ros.graph.protocol import Graph
from maya_ros.graph.table import TABLE, Row, type_of_topic
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.outgoing import MessageEncoder, shaped
from maya_ros.rosbridge.sending import Sender
from maya_un.errors import InvalidRequest, MayaError, UnknownInterface
from maya_un.http.log import written_down

Id = str | float | None

ROWS: Mapping[str, Row] = {row.name: row for row in TABLE}


class StatusLevel(IntEnum):
    """What a client is told by status messages: these and all graver ones."""

    none = 0
    error = 1
    warning = 2
    info = 3


class RosbridgeClient:
    """One client of the endpoint, as the concerns of its session see it. `language` is that of its sentences."""

    def __init__(self, graph: Graph, sender: Sender, press: MessageEncoder, language: str = "en") -> None:
        self.graph = graph
        self.sender = sender
        self.press = press
        self.level = StatusLevel.error
        self._language = language
        self._tasks: set[asyncio.Task[None]] = set()

    def say(self, message: Mapping[str, Any], compression: str = "none", fragment: int = 0, name: Id = None) -> None:
        """Send a message, as a picture and in pieces where that is wanted."""
        self.sender.answer(shaped(outgoing.text_of(message), compression, fragment, name))

    def tell(self, level: StatusLevel, text: str, name: Id = None, **more: object) -> None:
        """Tell a status that belongs to the message that the client calls `name`, if it wants such ones."""
        if level <= self.level:
            named = {} if name is None else {"id": name}
            self.say({"op": "status", **named, "level": level.name, "msg": text, **more})

    def words(self, error: MayaError) -> str:
        """Return what a client is told of an error: code and sentence."""
        return f"{error.code}: {error.text(self._language)}"

    def refuse(self, error: MayaError, name: Id = None) -> None:
        """Tell that a message was refused."""
        self.tell(StatusLevel.error, self.words(error), name, code=error.code)

    def spawn(self, work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
        """Have something done beside what else the client says; it ends with the session."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (defect := task.exception()) is not None:
            self.refuse(defect if isinstance(defect, MayaError) else written_down(defect))

    async def close(self) -> None:
        """End what is being done; returns when it has ended."""
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def type_of(self, topic: str) -> str:
        """Return the type that a topic has; raises `UnknownInterface` where nobody knows."""
        found = await self._asked(topic)
        if not found:
            raise UnknownInterface(form="topic", name=topic)
        return found

    def require(self, topic: str, kind: str) -> Awaitable[None] | None:
        """Raise `InvalidRequest` if a topic has another type than `kind`, or return a check that does."""
        found = self._known(topic)
        if found is None:
            return self._require(topic, kind)
        _check(topic, kind, found)
        return None

    async def _require(self, topic: str, kind: str) -> None:
        _check(topic, kind, await self._asked(topic))

    async def _asked(self, topic: str) -> str:
        found = self._known(topic)
        return (await self.graph.directory.topics()).get(topic, "") if found is None else found

    def _known(self, topic: str) -> str | None:
        return type_of_topic(topic) or self.graph.directory.topic_type(topic)


def _check(topic: str, kind: str, found: str) -> None:
    if found not in ("", kind):
        raise other_type(topic, found)


def other_type(topic: str, kind: str) -> InvalidRequest:
    """Return the error for a type that is not the topic's."""
    return InvalidRequest(key="type", reason=f"{topic} is a {kind}")
