"""MQTT as a transport, with a client instead of a broker."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Any, cast

import aiomqtt
import pytest
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from maya_un.coms.mqtt import Broker, BrokerClient, _MqttChannel, correlation_id
from maya_un.coms.transport import Report, ReportKind
from maya_un.errors import SupervisorsNotReached

COMMANDS, RESULTS = "maya/v1/MAYA/commands", "maya/v1/MAYA/results"


def message(text: bytes = b'{"command": "home"}', **properties: object) -> aiomqtt.Message:
    """Return a command as it comes from a broker."""
    given = Properties(PacketTypes.PUBLISH)
    for name, value in properties.items():
        setattr(given, name, value)
    return aiomqtt.Message(COMMANDS, text, 1, False, 1, given)


class Client:
    """Delivers one message, and records what it publishes and acknowledges; a broker cuts it at the topics `cut`."""

    def __init__(self, one: aiomqtt.Message, cut: str | None = None) -> None:
        self.done: list[str] = []
        self._one = one
        self._cut = cut

    @property
    async def messages(self) -> AsyncIterator[aiomqtt.Message]:
        yield self._one

    async def publish_checked(self, where: str, text: str, properties: Properties | None = None) -> bool:
        del text, properties
        self.done.append(where)
        if where == self._cut:
            raise aiomqtt.MqttError("Unexpected disconnection")
        return True

    def acknowledge(self, one: aiomqtt.Message) -> None:
        assert one is self._one
        self.done.append("acknowledged")


async def end(client: Client) -> None:
    """Receive the command and send its result."""
    channel = _MqttChannel(cast("BrokerClient", client), "MAYA", Broker("mqtt://lab"))
    command = await channel.receive()
    await channel.send(Report("1", ReportKind.RESULT, "{}", command.key))


async def test_connection_limits_what_a_broker_sends(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[Any]()
    monkeypatch.setattr(BrokerClient, "__init__", lambda _, *__, **options: asked.append(options["properties"]))
    Broker("mqtt://lab")._client("name", None, 60)
    assert (asked[0].MaximumPacketSize, asked[0].ReceiveMaximum) == (1 << 20, 1000)


async def test_a_response_topic_that_cuts_the_link_does_not_cut_it_again() -> None:
    client = Client(message(ResponseTopic="bad"), "bad")
    with pytest.raises(SupervisorsNotReached):
        await end(client)
    assert client.done == [RESULTS, "acknowledged", "bad"]


@pytest.mark.parametrize(
    ("where", "answered"),
    [("answers", True), ("a" + "/" * 199, True), ("a" + "/" * 200, False), ("", False), (COMMANDS, False)],
)
async def test_result_has_no_response_topic_at_which_a_broker_cuts(where: str, answered: bool) -> None:
    client = Client(message(ResponseTopic=where))
    await end(client)
    assert client.done == [RESULTS, "acknowledged", *([where] if answered else [])]


@pytest.mark.parametrize(
    ("data", "id_"),
    [(b"7", "7"), (b"c" * 200, "c" * 200), (b"c" * 201, None), (b"", None), (b"\n", None), (b"\xff", None)],
)
def test_correlation_data_is_an_id_only_if_a_robot_takes_it(data: bytes, id_: str | None) -> None:
    assert correlation_id(message(CorrelationData=data)) == id_


def test_message_without_correlation_data_has_no_id() -> None:
    assert correlation_id(message()) is None
