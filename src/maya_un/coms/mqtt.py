"""Supervisors by an MQTT 5 broker: QoS 1, a persistent session, a last will.

    maya/v1/ROBOT/commands     commands, with an id in the text or in CorrelationData
    maya/v1/ROBOT/progress     a step is accepted or begins
    maya/v1/ROBOT/results      results; also at the command's ResponseTopic, with its CorrelationData
    maya/v1/ROBOT/connection   retained: ONLINE, OFFLINE, CONNECTION_BROKEN (the last will; words of VDA 5050)

A command is acknowledged to the broker when its result is with the broker, so that it comes again after a crash.
"""

from __future__ import annotations

import json
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from itertools import count
from socket import IPPROTO_TCP, TCP_NODELAY
from typing import Any
from urllib.parse import urlsplit

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from maya_un.coms.settings import where_of
from maya_un.coms.transport import Command, Kind, Report
from maya_un.errors import InvalidValue, SupervisorsNotReached

VERSION = "maya/v1"

_SESSION = 7 * 24 * 3600
"""The broker keeps commands for a robot that is away for so long [s]."""

_KEEPALIVE = 5
"""A silent connection ends after one and a half of this [s]."""

_PORTS = {"mqtt": 1883, "mqtts": 8883}


def topic(robot: str, name: str) -> str:
    """Return a topic of a robot; raises `InvalidValue` for a name that no topic can have."""
    if not robot or not robot.isprintable() or set(robot) & set("/+#"):
        raise InvalidValue(key="NAME", value=robot, reason="over MQTT it must not be empty or contain /, + or #")
    return f"{VERSION}/{robot}/{name}"


@dataclass(frozen=True, slots=True)
class Mqtt:
    """A broker at an mqtt:// or mqtts:// URL."""

    url: str
    user: str = ""
    password: str = ""
    default_command: str | None = None

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return where_of(self.url)

    @asynccontextmanager
    async def connected(self, robot: str) -> AsyncIterator[_Channel]:
        """Connect and subscribe; raises `SupervisorsNotReached`, `InvalidValue` for a name that no topic can have."""
        commands, connection = topic(robot, "commands"), topic(robot, "connection")
        client = self._client(robot, aiomqtt.Will(connection, _connection("CONNECTION_BROKEN"), 1, retain=True))
        try:
            async with client:
                await client.publish(connection, _connection("ONLINE"), 1, retain=True)
                await client.subscribe(commands, 1)
                try:
                    yield _Channel(client, robot, self.where)
                finally:
                    await client.publish(connection, _connection("OFFLINE"), 1, retain=True, timeout=1.0)
        except aiomqtt.MqttError as error:
            raise SupervisorsNotReached(where=self.where, reason=str(error)) from error

    def _client(self, robot: str, will: aiomqtt.Will) -> _Client:
        parts = urlsplit(self.url)
        properties = Properties(PacketTypes.CONNECT)
        properties.SessionExpiryInterval = _SESSION
        return _Client(
            parts.hostname or "",
            parts.port or _PORTS[parts.scheme],
            username=self.user or parts.username,
            password=self.password or parts.password,
            identifier=f"maya-coms-{robot}",
            protocol=aiomqtt.ProtocolVersion.V5,
            clean_start=False,
            properties=properties,
            will=will,
            keepalive=_KEEPALIVE,
            tls_context=ssl.create_default_context() if parts.scheme == "mqtts" else None,
            socket_options=[(IPPROTO_TCP, TCP_NODELAY, 1)],  # without it Nagle's algorithm adds 40 ms to each message
        )


class _Client(aiomqtt.Client):
    """Acknowledges messages when it is told to: aiomqtt has no public way, and paho below it has."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._client.manual_ack_set(on=True)

    def acknowledge(self, message: aiomqtt.Message) -> None:
        """Tell the broker that a message is dealt with."""
        self._client.ack(message.mid, message.qos)


def _connection(state: str) -> str:
    return json.dumps({"connection": state})


class _Channel:
    """A connection to the broker."""

    def __init__(self, client: _Client, robot: str, where: str) -> None:
        self._client = client
        self._robot = robot
        self._where = where
        self._numbers = count(1)
        self._unacknowledged: dict[str, aiomqtt.Message] = {}

    async def receive(self) -> Command:
        """Return the next command."""
        try:
            message = await anext(self._client.messages)
        except aiomqtt.MqttError as error:
            raise SupervisorsNotReached(where=self._where, reason=str(error)) from error
        key = str(next(self._numbers))
        self._unacknowledged[key] = message
        return Command(key, _bytes(message.payload), _correlation(message))

    async def send(self, report: Report) -> None:
        """Publish a report; acknowledge the command behind its result."""
        ended = report.kind is Kind.RESULT
        try:
            await self._client.publish(topic(self._robot, "results" if ended else "progress"), report.text, 1)
            message = self._unacknowledged.pop(report.key, None) if ended and report.key is not None else None
            if message is not None:
                await self._answer(message, report)
                self._client.acknowledge(message)
        except (aiomqtt.MqttError, ValueError) as error:
            raise SupervisorsNotReached(where=self._where, reason=str(error)) from error

    async def _answer(self, message: aiomqtt.Message, report: Report) -> None:
        """Publish a result where its command asks for it."""
        where = getattr(message.properties, "ResponseTopic", None)
        if where is None:
            return
        properties = Properties(PacketTypes.PUBLISH)
        correlation = getattr(message.properties, "CorrelationData", None)
        if correlation is not None:
            properties.CorrelationData = correlation
        await self._client.publish(where, report.text, 1, properties=properties)


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
