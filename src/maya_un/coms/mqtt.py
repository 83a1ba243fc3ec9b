"""Supervisors by an MQTT 5 broker: QoS 1, a persistent session, a last will.

    maya/v1/ROBOT/commands     commands, with an id in the text or in CorrelationData
    maya/v1/ROBOT/progress     a step is accepted or begins
    maya/v1/ROBOT/results      results; also at the command's ResponseTopic, with its CorrelationData
    maya/v1/ROBOT/connection   retained: ONLINE, OFFLINE, CONNECTION_BROKEN (the last will; words of VDA 5050)

A command is acknowledged to the broker when its result is with the broker, so that it comes again after a crash.
"""

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from itertools import count
from typing import Any
from uuid import uuid4

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.subscribeoptions import SubscribeOptions

from maya_un.coms.broker import VERSION, Broker, BrokerClient, PublishRefused, topic
from maya_un.coms.transport import Report, ReportKind, SupervisorCommand
from maya_un.errors import SessionTakenOver
from maya_un.server import dates


@dataclass(slots=True)
class Mqtt:
    """The supervisors of a broker. `session` differs between robots with one name and grows with time."""

    broker: Broker
    default_command: str | None = None
    session: str = field(default_factory=lambda: f"{dates.epoch():020.6f} {uuid4().hex}")
    needs_journal: bool = False
    _was_online: bool = False

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return self.broker.where

    @asynccontextmanager
    async def connected(self, robot: str, journal: str) -> AsyncIterator[_MqttChannel]:
        """Connect and subscribe; raises `SupervisorsNotReached`, `InvalidValue` for a name that no topic can have.

        If a second robot connects under this name, the first one raises `SessionTakenOver` when it connects again. Not
        every broker says why it closed a connection, so a robot checks who is online before it connects again. An
        earlier session does not count: after a crash the broker may still report that of this robot's last run.
        """
        del journal
        commands, connection = topic(robot, "commands"), topic(robot, "connection")
        if self._was_online:
            await self._require_sole(robot, connection)
        will = aiomqtt.Will(connection, _connection("CONNECTION_BROKEN"), 1, retain=True)
        async with self.broker.connected(f"maya-coms-{robot}", will) as client:
            await client.subscribe(commands, options=_AS_THEY_COME)
            await client.publish_checked(connection, _connection("ONLINE", self.session), retain=True)
            self._was_online = True
            try:
                yield _MqttChannel(client, robot, self.broker)
            finally:
                await client.publish(connection, _connection("OFFLINE"), 1, retain=True, timeout=1.0)

    async def _require_sole(self, robot: str, connection: str) -> None:
        """Raise `SessionTakenOver` if a later robot is online under this name."""
        async with self.broker.connected(f"maya-look-{uuid4().hex}", session=0) as client:
            with self.broker.reached():
                for _ in range(2):  # the answer to the second comes after the retained message
                    await client.subscribe(connection)
                while len(client.messages):
                    found = _presence(await anext(client.messages))
                    if found.get("connection") == "ONLINE" and str(found.get("session", "")) > self.session:
                        raise SessionTakenOver(where=self.where, name=robot)


_AS_THEY_COME = SubscribeOptions(qos=1, retainHandling=SubscribeOptions.RETAIN_DO_NOT_SEND)
"""Without retained commands: they would come at each connect, and nothing moves because the robot connects."""


def _connection(state: str, session: str | None = None) -> str:
    return json.dumps({"connection": state} | ({} if session is None else {"session": session}))


def _presence(message: aiomqtt.Message) -> dict[str, Any]:
    """Return the data of a message about a robot's connection, {} if it is not a JSON object."""
    with suppress(ValueError, RecursionError):
        found = json.loads(_bytes(message.payload))
        if isinstance(found, dict):
            return found
    return {}


class _MqttChannel:
    """A connection to the broker."""

    def __init__(self, client: BrokerClient, robot: str, broker: Broker) -> None:
        self._client = client
        self._robot = robot
        self._broker = broker
        self._numbers = count(1)
        self._unacknowledged: dict[str, aiomqtt.Message] = {}

    async def receive(self) -> SupervisorCommand:
        """Return the next command."""
        with self._broker.reached():
            message = await anext(self._client.messages)
        key = str(next(self._numbers))
        self._unacknowledged[key] = message
        return SupervisorCommand(key, _bytes(message.payload), _correlation(message))

    async def send(self, report: Report) -> None:
        """Publish a report; acknowledge the command behind its result."""
        ended = report.kind is ReportKind.RESULT
        with self._broker.reached():
            await self._client.publish_checked(topic(self._robot, "results" if ended else "progress"), report.text)
            message = self._unacknowledged.pop(report.key, None) if ended and report.key is not None else None
            if message is not None:
                await self._answer(message, report)
                self._client.acknowledge(message)

    async def _answer(self, message: aiomqtt.Message, report: Report) -> None:
        """Publish a result where its command asks for it, but not on topics of robots: it could pass for theirs."""
        where = getattr(message.properties, "ResponseTopic", None)
        if where is None or where.startswith(f"{VERSION}/"):
            return
        properties = Properties(PacketTypes.PUBLISH)
        correlation = getattr(message.properties, "CorrelationData", None)
        if correlation is not None:
            properties.CorrelationData = correlation
        with suppress(PublishRefused):  # the result is on the robot's own topic
            await self._client.publish_checked(where, report.text, properties)


def _bytes(payload: object) -> bytes:
    if isinstance(payload, bytes | bytearray):
        return bytes(payload)
    return b"" if payload is None else str(payload).encode()


def _correlation(message: aiomqtt.Message) -> str | None:
    """Return the correlation data of a message as an id, None if it has none that can be one."""
    found = getattr(message.properties, "CorrelationData", None)
    try:
        text = found.decode() if isinstance(found, bytes) else ""
    except UnicodeDecodeError:
        return None
    return text if text.isprintable() and text else None
