"""Supervisors by an MQTT 5 broker: QoS 1, a persistent session, a last will, TLS.

    maya/v1/ROBOT/commands     commands, with an id in the text or in CorrelationData
    maya/v1/ROBOT/progress     a step is accepted or begins
    maya/v1/ROBOT/results      results; also at the command's ResponseTopic, with its CorrelationData
    maya/v1/ROBOT/connection   retained: ONLINE, OFFLINE, CONNECTION_BROKEN (the last will; words of VDA 5050)

A command is acknowledged only after the broker has its result, so the broker delivers the command again after a crash.
"""

from __future__ import annotations

import json
import ssl
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field
from itertools import count
from socket import IPPROTO_TCP, TCP_NODELAY
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from dmc41x3.i18n import phrase
from maya_un.coms.settings import where_of
from maya_un.coms.transport import Report, ReportKind, SupervisorCommand
from maya_un.errors import InvalidValue, SessionTakenOver, SupervisorsNotReached
from maya_un.http import dates
from maya_un.steps.text import as_id

VERSION = "maya/v1"

SESSION = 7 * 24 * 3600
"""The broker stores messages for a disconnected client for this time [s]."""

_LONGEST = 1 << 20
"""The broker sends no longer message [bytes]. The longest result has 0.4 MB: it repeats names of its command, escaped.
"""

_MOST_AT_ONCE = 1000
"""The broker sends at most this number of messages that are not acknowledged: the capacity of a robot's queue of steps.
"""

_KEEPALIVE = 5
"""Keepalive interval [s]; a silent connection ends after one and a half intervals."""

_MOST_LEVELS = 200
"""Maximum number of levels of a topic in mosquitto."""

_PORTS = {"mqtt": 1883, "mqtts": 8883}


def topic(robot: str, name: str) -> str:
    """Return a topic of a robot; raises `InvalidValue` for a name that is invalid in a topic."""
    if not robot or not robot.isprintable() or set(robot) & set("/+#"):
        raise InvalidValue(key="NAME", value=robot, reason="over MQTT it must not be empty or contain /, + or #")
    return f"{VERSION}/{robot}/{name}"


@dataclass(frozen=True, slots=True)
class Credentials:
    """The credentials for a broker: user and password, or a client certificate with its key (files in PEM).

    `authority` is a file in PEM with the certificates that sign the broker's certificate, "" for those of the system.
    """

    user: str = ""
    password: str = ""
    authority: str = ""
    certificate: str = ""
    key: str = ""

    def tls(self) -> ssl.SSLContext:
        """Return the TLS context; raises `InvalidValue` for a file that cannot be used."""
        try:
            context = ssl.create_default_context(cafile=self.authority or None)
            if self.certificate:
                context.load_cert_chain(self.certificate, self.key or None)
        except (OSError, ValueError) as error:
            files = ", ".join(filter(None, (self.authority, self.certificate, self.key)))
            raise InvalidValue(key="TLS", value=files, reason=str(error)) from error
        return context


class PublishRefused(aiomqtt.MqttError):
    """The broker rejects a message: its rules forbid it, or the topic is invalid."""


class BrokerClient(aiomqtt.Client):
    """A client with manual acknowledgement, whose publish raises an error if the broker refused the message.

    aiomqtt has no public interface for either; paho below it has. Publish one message at a time.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._client.manual_ack_set(on=True)
        self._answer: ReasonCode | None = None

    def acknowledge(self, message: aiomqtt.Message) -> None:
        """Acknowledge a handled message to the broker."""
        self._client.ack(message.mid, message.qos)

    async def publish_checked(
        self, where: str, text: str, properties: Properties | None = None, *, retain: bool = False
    ) -> bool:
        """Publish with QoS 1; return whether the topic has a subscriber. Raises `PublishRefused`."""
        self._answer = None
        try:
            await self.publish(where, text, 1, retain, properties)
        except ValueError as error:
            raise PublishRefused(
                phrase("no message can have the topic {where!r}: {error}", where=where, error=error)
            ) from error
        answer = self._answer
        if answer is not None and answer.is_failure:
            raise PublishRefused(
                phrase("it refuses messages on {where}: {answer}", where=where, answer=answer.getName())
            )
        return answer is None or answer.value != _NOBODY

    def _on_publish(self, client: Any, userdata: Any, mid: int, reason_code: ReasonCode, properties: Any) -> None:
        self._answer = reason_code
        super()._on_publish(client, userdata, mid, reason_code, properties)


_NOBODY = 16
"""The reason code of MQTT 5 for a message without subscribers."""


@dataclass(frozen=True, slots=True)
class Broker:
    """A broker at an mqtt:// or mqtts:// URL."""

    url: str
    credentials: Credentials = Credentials()

    @property
    def where(self) -> str:
        """The address without credentials."""
        return where_of(self.url)

    @asynccontextmanager
    async def connected(
        self, identifier: str, will: aiomqtt.Will | None = None, session: int = SESSION
    ) -> AsyncIterator[BrokerClient]:
        """Connect and resume the session of this name, which expires `session` seconds after the connection.

        Raises `SupervisorsNotReached`.
        """
        with self.reached():
            async with self._client(identifier, will, session) as client:
                yield client

    @contextmanager
    def reached(self) -> Iterator[None]:
        """Convert errors of the connection into `SupervisorsNotReached`."""
        try:
            yield
        except (aiomqtt.MqttError, UnicodeError) as error:  # a host, user or password that cannot be encoded
            raise SupervisorsNotReached(where=self.where, reason=str(error)) from error

    def _client(self, identifier: str, will: aiomqtt.Will | None, session: int) -> BrokerClient:
        parts = urlsplit(self.url)
        shown = self.credentials
        properties = Properties(PacketTypes.CONNECT)
        properties.SessionExpiryInterval = session
        properties.MaximumPacketSize = _LONGEST
        properties.ReceiveMaximum = _MOST_AT_ONCE
        return BrokerClient(
            parts.hostname or "",
            parts.port or _PORTS[parts.scheme],
            username=shown.user or parts.username,
            password=shown.password or parts.password,
            identifier=identifier,
            protocol=aiomqtt.ProtocolVersion.V5,
            clean_start=False,
            properties=properties,
            will=will,
            keepalive=_KEEPALIVE,
            tls_context=shown.tls() if parts.scheme == "mqtts" else None,
            socket_options=[(IPPROTO_TCP, TCP_NODELAY, 1)],  # without it Nagle's algorithm adds 40 ms to each message
        )


@dataclass(slots=True)
class Mqtt:
    """The supervisors of a broker. `session` names one run: later ones sort after it, and no two robots share one."""

    broker: Broker
    default_command: str | None = None
    session: str = field(default_factory=lambda: f"{dates.epoch():020.6f} {uuid4().hex}")
    needs_journal: bool = False
    _was_online: bool = False

    @property
    def where(self) -> str:
        """The address without credentials."""
        return self.broker.where

    @asynccontextmanager
    async def connected(self, robot: str, journal: str) -> AsyncIterator[_MqttChannel]:
        """Connect and subscribe; raises `SupervisorsNotReached`, `InvalidValue` for a name that is invalid in a topic.

        If a second robot connects under this name, the first one raises `SessionTakenOver` when it connects again. Not
        every broker reports why it closed a connection, so a robot checks who is online before it connects again. At
        the first connect it does not check: after a crash the broker may still report the session of this robot's last
        run.
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
                for _ in range(2):  # the answer to the second subscription arrives after the retained message
                    await client.subscribe(connection)
                while len(client.messages):
                    found = _presence(await anext(client.messages))
                    if found.get("connection") == "ONLINE" and str(found.get("session", "")) > self.session:
                        raise SessionTakenOver(where=self.where, name=robot)


_AS_THEY_COME = SubscribeOptions(qos=1, retainHandling=SubscribeOptions.RETAIN_DO_NOT_SEND)
"""No retained commands: the broker would send them at each connect, and connecting must not move the robot."""


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
        return SupervisorCommand(key, _bytes(message.payload), correlation_id(message))

    async def send(self, report: Report) -> None:
        """Publish a report; after a result, acknowledge its command."""
        ended = report.kind is ReportKind.RESULT
        with self._broker.reached():
            await self._client.publish_checked(topic(self._robot, "results" if ended else "progress"), report.text)
            message = self._unacknowledged.pop(report.key, None) if ended and report.key is not None else None
            if message is not None:
                self._client.acknowledge(message)  # first: a broker may end the connection because of the ResponseTopic
                await self._answer(message, report)

    async def _answer(self, message: aiomqtt.Message, report: Report) -> None:
        """Publish a result at its command's ResponseTopic."""
        where = getattr(message.properties, "ResponseTopic", None)
        if where is None or not _may_answer_at(where):
            return
        properties = Properties(PacketTypes.PUBLISH)
        correlation = getattr(message.properties, "CorrelationData", None)
        if correlation is not None:
            properties.CorrelationData = correlation
        with suppress(PublishRefused):  # the result is on the robot's own topic
            await self._client.publish_checked(where, report.text, properties)


def _may_answer_at(where: str) -> bool:
    """Return whether a result may have this ResponseTopic.

    On a robot's topic it could mislead. At an empty topic, or one with too many levels, brokers end the connection.
    """
    return where != "" and where.count("/") < _MOST_LEVELS and not where.startswith(f"{VERSION}/")


def _bytes(payload: object) -> bytes:
    if isinstance(payload, bytes | bytearray):
        return bytes(payload)
    return b"" if payload is None else str(payload).encode()


def correlation_id(message: aiomqtt.Message) -> str | None:
    """Return the correlation data of a message as an id, None if it has none that is a valid id."""
    found = getattr(message.properties, "CorrelationData", None)
    try:
        text = found.decode() if isinstance(found, bytes) else ""
    except UnicodeDecodeError:
        return None
    return as_id(text)
