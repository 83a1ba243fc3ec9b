"""MQTT as a transport, with a client instead of a broker."""

from __future__ import annotations

import aiomqtt
import pytest
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from maya_un.coms.mqtt import correlation_id

COMMANDS = "maya/v1/MAYA/commands"


def message(text: bytes = b'{"command": "home"}', **properties: object) -> aiomqtt.Message:
    """Return a command as it comes from a broker."""
    given = Properties(PacketTypes.PUBLISH)
    for name, value in properties.items():
        setattr(given, name, value)
    return aiomqtt.Message(COMMANDS, text, 1, False, 1, given)


@pytest.mark.parametrize(
    ("data", "id_"),
    [(b"7", "7"), (b"c" * 200, "c" * 200), (b"c" * 201, None), (b"", None), (b"\n", None), (b"\xff", None)],
)
def test_correlation_data_is_an_id_only_if_a_robot_takes_it(data: bytes, id_: str | None) -> None:
    assert correlation_id(message(CorrelationData=data)) == id_


def test_message_without_correlation_data_has_no_id() -> None:
    assert correlation_id(message()) is None
