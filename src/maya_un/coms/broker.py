"""A connection to an MQTT 5 broker, as robots and supervisors use it: a persistent session, no delay, TLS."""

from __future__ import annotations

import ssl
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from socket import IPPROTO_TCP, TCP_NODELAY
from typing import Any
from urllib.parse import urlsplit

import aiomqtt
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode

from maya_un.coms.settings import where_of
from maya_un.errors import InvalidValue, SupervisorsNotReached

VERSION = "maya/v1"

SESSION = 7 * 24 * 3600
"""The broker keeps messages for a client that is away for so long [s]."""

_KEEPALIVE = 5
"""A silent connection ends after one and a half of this [s]."""

_PORTS = {"mqtt": 1883, "mqtts": 8883}


def topic(robot: str, name: str) -> str:
    """Return a topic of a robot; raises `InvalidValue` for a name that no topic can have."""
    if not robot or not robot.isprintable() or set(robot) & set("/+#"):
        raise InvalidValue(key="NAME", value=robot, reason="over MQTT it must not be empty or contain /, + or #")
    return f"{VERSION}/{robot}/{name}"


@dataclass(frozen=True, slots=True)
class Credentials:
    """The credentials for a broker: user and password, or a client certificate with its key (files in PEM).

    `authority` is a file in PEM with the certificates that sign the broker's, "" for those of the system.
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
    """The broker does not carry a message: its rules forbid it, or no message can have that topic."""


class BrokerClient(aiomqtt.Client):
    """A client that acknowledges messages when it is told to, and learns that the broker refused one.

    aiomqtt has no public way to either; paho below it has. One publish at a time.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._client.manual_ack_set(on=True)
        self._answer: ReasonCode | None = None

    def acknowledge(self, message: aiomqtt.Message) -> None:
        """Tell the broker that a message is dealt with."""
        self._client.ack(message.mid, message.qos)

    async def publish_checked(
        self, where: str, text: str, properties: Properties | None = None, *, retain: bool = False
    ) -> bool:
        """Publish with QoS 1; return whether anybody subscribes. Raises `PublishRefused`."""
        self._answer = None
        try:
            await self.publish(where, text, 1, retain, properties)
        except ValueError as error:
            raise PublishRefused(f"no message can have the topic {where!r}: {error}") from error
        answer = self._answer
        if answer is not None and answer.is_failure:
            raise PublishRefused(f"it refuses messages on {where}: {answer.getName()}")
        return answer is None or answer.value != _NOBODY

    def _on_publish(self, client: Any, userdata: Any, mid: int, reason_code: ReasonCode, properties: Any) -> None:
        self._answer = reason_code
        super()._on_publish(client, userdata, mid, reason_code, properties)


_NOBODY = 16
"""The reason code of MQTT 5 for a message that nobody subscribes to."""


@dataclass(frozen=True, slots=True)
class Broker:
    """A broker at an mqtt:// or mqtts:// URL."""

    url: str
    credentials: Credentials = Credentials()

    @property
    def where(self) -> str:
        """Its address without credentials."""
        return where_of(self.url)

    @asynccontextmanager
    async def connected(
        self, identifier: str, will: aiomqtt.Will | None = None, session: int = SESSION
    ) -> AsyncIterator[BrokerClient]:
        """Connect and go on with the session of this name, which ends `session` seconds after the connection.

        Raises `SupervisorsNotReached`.
        """
        with self.reached():
            async with self._client(identifier, will, session) as client:
                yield client

    @contextmanager
    def reached(self) -> Iterator[None]:
        """Turn errors of the connection into `SupervisorsNotReached`."""
        try:
            yield
        except aiomqtt.MqttError as error:
            raise SupervisorsNotReached(where=self.where, reason=str(error)) from error

    def _client(self, identifier: str, will: aiomqtt.Will | None, session: int) -> BrokerClient:
        parts = urlsplit(self.url)
        shown = self.credentials
        properties = Properties(PacketTypes.CONNECT)
        properties.SessionExpiryInterval = session
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
