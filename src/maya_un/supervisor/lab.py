"""The connection of a supervisor: robots, their presence, and the steps sent to them.

A step without a result is published again after every reconnect, with the same id, which the robot's journal
recognises. So no step is lost or runs twice, whichever side ends or is disconnected.
"""

from __future__ import annotations

import asyncio
import json
import logging
import socket
from collections.abc import AsyncIterator, Callable, Iterable
from dataclasses import dataclass, replace
from random import Random
from types import TracebackType
from typing import Any
from uuid import uuid4

import aiomqtt
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from dmc41x3.i18n import phrase
from maya_un.coms.mqtt import SESSION, VERSION, Broker, BrokerClient, PublishRefused, correlation_id, topic
from maya_un.coms.selection import broker_of
from maya_un.coms.settings import from_environment, password_warning
from maya_un.coms.transport import first_to_end, keep
from maya_un.errors import BrokerRefused, MayaError, StepFailed
from maya_un.steps.text import StepEnd
from maya_un.supervisor.primitives import PrimitiveCommands
from maya_un.supervisor.step import Step, check, command_text, progress_of, result_of

ONLINE = "ONLINE"
"""A robot is connected and accepts commands."""

DEADLINE = 60.0
"""A step must start within this time [s]; later it is refused."""

_SHORT_SESSION = 300
"""The broker stores messages for a supervisor without a name for this time [s]."""

_NO_RETAINED = 2
"""Subscription option: do not send retained messages again."""

_EVERY_ROBOT, _EVERYTHING = "+", "#"
"""Instead of the name of a robot: the reports of all robots, and also the commands to them; no robot has these names.
"""

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Event:
    """A message that a robot published, as JSON data; `kind` is connection, progress or results.

    `retained` is True if the broker had stored it. `Supervisor.watch` yields events of further kinds for displays.
    """

    robot: str
    kind: str
    data: dict[str, Any]
    retained: bool = False


class Supervisor:
    """Sends steps to the robots of a broker while the block runs.

    `url` is the broker's, by default $MAYA_COMS_URL; credentials are those of `maya coms`, from the environment. A
    supervisor with a `name` has a session that outlives it: the broker stores results for it while it is disconnected.
    No two programs may use one name. Without one, displays show its steps under the user at the broker, or under the
    name of this computer. `deadline` is the time within which a step must start [s].

    It logs a warning if it sends the password to another computer without encryption. Entering raises
    `SupervisorsNotReached` if the broker does not answer; later it reconnects automatically. At the end of the block,
    every step without a result ends with `StepFailed`: its error says whether the step was sent.
    """

    def __init__(self, url: str | None = None, *, name: str | None = None, deadline: float = DEADLINE) -> None:
        settings = from_environment()
        settings = settings if url is None else replace(settings, supervisors=url)
        self._broker: Broker = broker_of(settings)
        warning = password_warning(settings)
        if warning is not None:
            _LOG.warning(warning)
        self.name = name or settings.user or socket.gethostname()
        self._identifier = f"maya-supervisor-{name or uuid4().hex}"
        self._session = SESSION if name else _SHORT_SESSION
        self.deadline = deadline
        self._failure: MayaError | None = None
        self._presence: dict[str, str] = {}
        self._steps: dict[str, Step] = {}
        self._unsent: dict[str, Step] = {}
        self._work = asyncio.Event()
        self._heard: set[str] = set()
        self._wanted: set[str] = set()
        self._watchers: set[Callable[[Event], None]] = set()
        self._displays: set[Callable[[Event], None]] = set()
        self._published: set[str] = set()
        self._running: asyncio.Task[None] | None = None
        self._closed = False

    async def __aenter__(self) -> Supervisor:
        self._closed = False
        ready: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def failed(error: MayaError) -> None:
            self._failure = error
            self._display("broker", code=error.code, error=str(error))
            if not ready.done():
                ready.set_exception(error)

        self._running = asyncio.create_task(keep(lambda: self._serve(ready), failed, Random()), name="supervisor")
        try:
            await first_to_end(asyncio.shield(self._running), ready)
        except BaseException:
            await self._close()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._close()

    async def _close(self) -> None:
        assert self._running is not None
        self._running.cancel()
        await asyncio.gather(self._running, return_exceptions=True)
        self._closed = True
        for step in tuple(self._steps.values()):
            self._give_up(step)

    def _give_up(self, step: Step) -> None:
        """End a step of which no result can come any more."""
        if step.id in self._published:
            reason, code = phrase("the program closed the connection before the result came"), "RESULT_UNKNOWN"
        else:
            reason, code = phrase("the program closed the connection before it sent the step"), "NOT_SENT"
        self._end(step, StepFailed(id=step.id, robot=step.robot, error=reason, error_code=code))

    @property
    def trouble(self) -> str | None:
        """The reason why the broker is not connected, None if it is."""
        return None if self._failure is None else str(self._failure)

    @property
    def robots(self) -> dict[str, str]:
        """The robots of the broker by name: ONLINE, OFFLINE or CONNECTION_BROKEN."""
        return dict(sorted(self._presence.items()))

    def robot(self, name: str) -> Robot:
        """Return the robot of this name, present or not; raises `InvalidValue` for an invalid name."""
        topic(name, "commands")
        return Robot(self, name)

    def send(self, id_: str, robot: str, text: str) -> Step:
        """Send a command unchanged; the robot's journal answers a repeated one."""
        step = self._steps.get(id_)
        if step is None:
            step = self._steps[id_] = self._unsent[id_] = Step(id_, robot, text)
            self._wanted.add(robot)
            self._work.set()
        if self._closed:
            self._give_up(step)
        return step

    async def watch(self, *, everything: bool = False) -> AsyncIterator[Event]:
        """Yield all messages that robots publish from now on, after the presence of each robot.

        With `everything`, yield also these kinds of events, for displays: `commands` are the commands that anybody
        sends to a robot. A `broker` has the `code` and the `error` that ended the connection. Both are None as soon as
        all messages are received, and the presence of each robot follows. A `refused` has a `topic` that the broker's
        rules forbid. A `removed` robot is one whose stored connection somebody deleted.
        """
        queue: asyncio.Queue[Event] = asyncio.Queue()
        watchers = self._displays if everything else self._watchers
        watchers.add(queue.put_nowait)
        if not everything:
            self._show_presence((queue.put_nowait,))
        self._wanted.add(_EVERYTHING if everything else _EVERY_ROBOT)
        self._work.set()
        try:
            while True:
                yield await queue.get()
        finally:
            watchers.discard(queue.put_nowait)

    def _show_presence(self, watchers: Iterable[Callable[[Event], None]]) -> None:
        for robot, state in self.robots.items():
            for watcher in watchers:
                watcher(Event(robot, "connection", {"connection": state}, retained=True))

    def _display(self, kind: str, robot: str = "", **data: Any) -> None:
        """Pass an event to those who watch everything."""
        for watcher in tuple(self._displays):
            watcher(Event(robot, kind, data))

    async def _serve(self, ready: asyncio.Future[None]) -> None:
        async with self._broker.connected(self._identifier, session=self._session) as client:
            await self._subscribe(client)
            self._failure = None
            self._unsent.update(self._steps)
            self._work.set()
            if not ready.done():
                ready.set_result(None)
            await first_to_end(self._receive(client), self._send(client))

    async def _subscribe(self, client: BrokerClient) -> None:
        """Subscribe, and read the presence of all robots: the second answer arrives after the retained messages."""
        where = f"{VERSION}/+/connection"
        self._heard.clear()
        self._check((where,), await client.subscribe(where))
        await client.subscribe(where, options=SubscribeOptions(retainHandling=_NO_RETAINED))
        for _ in range(len(client.messages)):
            self._take(client, await anext(client.messages))

    async def _receive(self, client: BrokerClient) -> None:
        async for message in client.messages:
            self._take(client, message)

    def _take(self, client: BrokerClient, message: aiomqtt.Message) -> None:
        event = _event_of(message)
        if event is None:
            self._forget(message)
        else:
            if event.kind != "commands":
                self._note(event)
            for watcher in (*(() if event.kind == "commands" else self._watchers), *self._displays):
                watcher(event)
        client.acknowledge(message)

    def _forget(self, message: aiomqtt.Message) -> None:
        """Forget a robot whose retained message a person has removed."""
        _, _, robot, kind = message.topic.value.split("/")
        if kind == "connection" and not message.payload:
            self._presence.pop(robot, None)
            self._display("removed", robot)

    def _note(self, event: Event) -> None:
        if event.kind == "connection":
            self._note_presence(event.robot, str(event.data.get("connection")))
            return
        step = self._steps.get(str(event.data.get("id")))
        if step is None or step.robot != event.robot:
            return
        progress, result = progress_of(event.data), result_of(event.data)
        if result is not None:
            if result.content is None or result.content == step.content:  # else it refuses a command of another program
                self._end(step, result)
        elif progress is not None:
            step.reported(progress)

    def _note_presence(self, robot: str, state: str) -> None:
        self._presence[robot] = state
        if state == ONLINE:  # a command sent before the broker knew the robot is lost
            self._unsent.update({id_: step for id_, step in self._steps.items() if step.robot == robot})
            self._work.set()

    def _end(self, step: Step, how: StepEnd | MayaError) -> None:
        step.ended(how)
        self._steps.pop(step.id, None)
        self._unsent.pop(step.id, None)
        self._published.discard(step.id)

    async def _send(self, client: BrokerClient) -> None:
        while True:
            await self._work.wait()
            self._work.clear()
            for name in self._wanted - self._heard:
                await self._follow(client, name)
                self._heard.add(name)
            for step in tuple(self._unsent.values()):
                # before the results of its robot are heard, its result would be missed; the next round sends it
                if step.id in self._unsent and step.robot in self._heard:
                    await self._publish(client, step)

    async def _follow(self, client: BrokerClient, name: str) -> None:
        """Subscribe to the reports of a robot: they may be lost with the connection, but results are acknowledged."""
        kinds = {"progress": 0, "results": 1} | ({"commands": 0} if name == _EVERYTHING else {})
        robot = _EVERY_ROBOT if name == _EVERYTHING else name
        topics = {f"{VERSION}/{robot}/{kind}": qos for kind, qos in kinds.items()}
        answers = await client.subscribe(list(topics.items()))
        if name == _EVERYTHING:
            self._display("broker", code=None, error=None)
            self._show_presence(self._displays)
        self._check(topics, answers)

    def _check(self, topics: Iterable[str], answers: Iterable[int | ReasonCode]) -> None:
        """Show the topics to which the broker refused a subscription."""
        for where, answer in zip(topics, answers, strict=True):
            if isinstance(answer, ReasonCode) and answer.is_failure:
                self._display("refused", topic=where)

    async def _publish(self, client: BrokerClient, step: Step) -> None:
        """Publish a step; it is published again if its robot connects meanwhile."""
        del self._unsent[step.id]
        self._published.add(step.id)
        try:
            await client.publish_checked(topic(step.robot, "commands"), step.text)
        except PublishRefused as error:
            self._end(step, BrokerRefused(where=self._broker.where, reason=str(error)))


class Robot(PrimitiveCommands):
    """One robot. Every method sends a step and returns it; await it for its result.

    Coordinates are metres. `deadline` is the time within which the step must start [s].
    """

    def __init__(self, lab: Supervisor, name: str) -> None:
        self._lab = lab
        self.name = name

    @property
    def connection(self) -> str | None:
        """ONLINE, OFFLINE or CONNECTION_BROKEN; None if the broker does not know the robot."""
        return self._lab.robots.get(self.name)

    def do(self, command: str, *, deadline: float | None = None, **args: float) -> Step:
        """Send a step; raises `UnknownName`, `InvalidRequest`, `InvalidValue` for one that every robot would refuse."""
        check(command, args)
        id_ = str(uuid4())
        until = self._lab.deadline if deadline is None else deadline
        text = command_text(id_, self.name, command, args, until, self._lab.name)
        return self._lab.send(id_, self.name, text)


def _event_of(message: aiomqtt.Message) -> Event | None:
    """Return the event in a message, None for other messages. A command without an id takes its correlation data."""
    _, _, robot, kind = message.topic.value.split("/")
    try:
        data = json.loads(message.payload)
        if b"\\" in message.payload or not message.payload.isascii():
            data = _writable(data)
    except (ValueError, RecursionError):
        return None
    if not isinstance(data, dict) or kind not in {"connection", "progress", "results", "commands"}:
        return None
    if kind == "commands" and data.get("id") is None:
        data["id"] = correlation_id(message)
    return Event(robot, kind, data, bool(message.retain))


def _writable(data: Any) -> Any:
    """Return JSON data with "?" for lone surrogates, which JSON may contain and UTF-8 cannot."""
    if isinstance(data, str):
        return data.encode(errors="replace").decode()
    if isinstance(data, list):
        return [_writable(one) for one in data]
    return {_writable(key): _writable(one) for key, one in data.items()} if isinstance(data, dict) else data
