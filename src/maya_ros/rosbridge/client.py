"""One client as all parts of its session use it: the graph, status messages, and sending in turns.

Answers are always sent. Messages of topics are sent as fast as the client takes them.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from enum import IntEnum
from typing import Any, Protocol

from dmc41x3.i18n import phrase
from maya_ros.graph.protocol import Graph
from maya_ros.graph.table import TABLE, Row, type_of_topic
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.limits import ANSWERS_OWED, AT_ONCE, LONGEST_TURN, OWED
from maya_ros.rosbridge.outgoing import MessageEncoder, shaped
from maya_un.errors import InvalidRequest, MayaError, StreamLagging, UnknownInterface
from maya_un.http.log import written_down

Step = Callable[[], bool]
"""Carries out one message of a client; returns whether another can be carried out now."""


class MessageScheduler:
    """Carries out messages of all clients in turn, one of each, a limited number per turn of the loop.

    The work of a message also runs in turns of the loop: if too many messages started in one turn, each step of another
    client's stop would wait for all of them. `clock` returns the time [s], normally the running loop's.
    """

    def __init__(self, clock: Callable[[], float] | None = None) -> None:
        self._loop = asyncio.get_running_loop()
        self._clock = clock or self._loop.time
        self._waiting: deque[Step] = deque()
        self._left = 0
        self._until = 0.0
        self._running = False

    def give(self, step: Step) -> None:
        """Call `step` repeatedly until it returns false, now and in later turns."""
        self._waiting.append(step)
        if not self._running:
            self._begin()
        self._work()

    def _begin(self) -> None:
        self._running = True
        self._left = AT_ONCE
        self._until = self._clock() + LONGEST_TURN
        self._loop.call_soon(self._end)

    def _work(self) -> None:
        while self._waiting and self._left:
            self._left -= 1
            step = self._waiting.popleft()
            if step():
                self._waiting.append(step)
            if self._clock() >= self._until:
                self._left = 0

    def _end(self) -> None:
        """Start the next turn, if messages wait."""
        self._running = False
        if self._waiting:
            self._begin()
            self._work()


class SenderWire(Protocol):
    """The part of a wire that a sender needs: `on_room` is called when the wire is no longer `full`."""

    on_room: Callable[[], None] | None

    @property
    def full(self) -> bool:
        """Whether nothing more should be written now."""
        ...

    def write(self, frames: bytes) -> None:
        """Send whole frames without waiting."""
        ...

    def end(self, code: int, reason: str) -> None:
        """Close the connection."""
        ...


class Backlog:
    """Waiting messages of one topic for a slow client: the newest `most`."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.size = 0
        self._frames: deque[bytes] = deque()

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frames: bytes) -> int:
        """Add a message, and return the change of the total size [bytes]."""
        before = self.size
        self._frames.append(frames)
        self.size += len(frames)
        while len(self._frames) > self.most:
            self.pop()
        return self.size - before

    def pop(self) -> bytes:
        """Remove and return the oldest message."""
        frames = self._frames.popleft()
        self.size -= len(frames)
        return frames


class Sender:
    """Sends messages to one client, and never waits for it."""

    def __init__(self, outlet: SenderWire) -> None:
        self._outlet = outlet
        self._answers: deque[bytes] = deque()
        self._answers_size = 0
        self._behind: dict[Backlog, None] = {}
        self._owed = 0
        outlet.on_room = self._go_on

    @property
    def owed(self) -> int:
        """Size of the topic messages that wait for this client [bytes]."""
        return self._owed

    def answer(self, frames: bytes) -> None:
        """Send an answer; disconnect a client that does not read answers."""
        if not self._outlet.full:
            self._outlet.write(frames)
            return
        self._answers.append(frames)
        self._answers_size += len(frames)
        if self._answers_size > ANSWERS_OWED:
            self._answers.clear()
            self._answers_size = 0
            self._outlet.end(StreamLagging.code, "answers are not read")

    def send(self, backlog: Backlog, frames: bytes) -> None:
        """Send a message of a topic now, or when the client can take it, unless newer messages have displaced it."""
        if not self._behind and not self._outlet.full:
            self._outlet.write(frames)
            return
        self._owed += backlog.add(frames)
        self._behind[backlog] = None
        while self._owed > OWED:
            self._drop()

    def forget(self, backlog: Backlog) -> None:
        """Drop the waiting messages of a topic."""
        if backlog in self._behind:
            del self._behind[backlog]
            self._owed -= backlog.size

    def _drop(self) -> None:
        fullest = max(self._behind, key=lambda one: one.size)
        self._owed -= len(fullest.pop())
        if not fullest:
            del self._behind[fullest]

    def _go_on(self) -> None:
        """Send what waits, answers first, then one message of each topic in turn."""
        while self._answers and not self._outlet.full:
            frames = self._answers.popleft()
            self._answers_size -= len(frames)
            self._outlet.write(frames)
        while self._behind and not self._outlet.full:
            backlog = next(iter(self._behind))
            del self._behind[backlog]
            frames = backlog.pop()
            self._owed -= len(frames)
            if backlog:
                self._behind[backlog] = None
            self._outlet.write(frames)


Id = str | float | None

ROWS: Mapping[str, Row] = {row.name: row for row in TABLE}


class StatusLevel(IntEnum):
    """Least severe level of the status messages that a client gets."""

    none = 0
    error = 1
    warning = 2
    info = 3


class RosbridgeClient:
    """One client of the endpoint, as the parts of its session use it. `language` is that of its sentences."""

    def __init__(self, graph: Graph, sender: Sender, press: MessageEncoder, language: str = "en") -> None:
        self.graph = graph
        self.sender = sender
        self.press = press
        self.level = StatusLevel.error
        self._language = language
        self._tasks: set[asyncio.Task[None]] = set()

    def say(self, message: Mapping[str, Any], compression: str = "none", fragment: int = 0, name: Id = None) -> None:
        """Send a message, as a picture and in fragments if requested."""
        self.sender.answer(shaped(outgoing.text_of(message), compression, fragment, name))

    def tell(self, level: StatusLevel, text: str, name: Id = None, **more: object) -> None:
        """Send a status for the message that the client calls `name`, if the client wants this level."""
        if level <= self.level:
            named = {} if name is None else {"id": name}
            self.say({"op": "status", **named, "level": level.name, "msg": text, **more})

    def words(self, error: MayaError) -> str:
        """Return the text of an error for the client: code and sentence."""
        return f"{error.code}: {error.text(self._language)}"

    def refuse(self, error: MayaError, name: Id = None) -> None:
        """Send the error of a refused message."""
        self.tell(StatusLevel.error, self.words(error), name, code=error.code)

    def spawn(self, work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
        """Start a task beside later messages of the client; the task ends with the session."""
        task = asyncio.get_running_loop().create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (defect := task.exception()) is not None:
            self.refuse(defect if isinstance(defect, MayaError) else written_down(defect))

    async def close(self) -> None:
        """Cancel all tasks, and return when they have ended."""
        tasks = tuple(self._tasks)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def type_of(self, topic: str) -> str:
        """Return the type of a topic; raises `UnknownInterface` if it is unknown."""
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
    """Return the error for a type other than that of the topic."""
    return InvalidRequest(key="type", reason=phrase("the topic {name} carries {kind}", name=topic, kind=kind))
