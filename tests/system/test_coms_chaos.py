"""The campaign of tests/system/coms_chaos.py over MQTT.

The supervisor is plain paho; it sends a command again until it has its result, as every client of a broker must that
may lose what it stored.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from tests.campaign import Campaign
from tests.system import coms_chaos
from tests.system.brokers import Broker, broker, disconnect

pytestmark = [pytest.mark.system, pytest.mark.timeout(3600)]


class Supervisor(coms_chaos.Supervisor):
    """Sends commands, each again until it has a result; `given` holds every text of a result by its key."""

    def __init__(self, broker: Broker) -> None:
        super().__init__()
        self.given: dict[str, set[str]] = {}
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, "supervisor", protocol=mqtt.MQTTv5)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_message = self._on_message
        self._client.on_connect = self._on_connect
        self._client.connect("127.0.0.1", broker.port, clean_start=True)
        self._client.loop_start()

    def _on_connect(self, *_: object) -> None:
        self._client.subscribe([("maya/v1/MAYA/results", 1), ("maya/v1/MAYA/progress", 1)])
        self.send_again()

    def _on_message(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        if message.topic.endswith("results"):
            key = json.loads(message.payload)["id"].removeprefix("id ")
            self.given.setdefault(key, set()).add(message.payload.decode())
        self.notice()

    def write(self, key: str) -> None:
        """Publish a command."""
        self._client.publish("maya/v1/MAYA/commands", json.dumps(self.sent[key]), 1)

    def send_again(self) -> None:
        """Publish all that has no result once more."""
        for key in self.unanswered:
            self.write(key)

    def wait(self, patience: float = 5.0) -> bool:
        """Wait until something is reported; if nothing is, send again."""
        found = super().wait(patience)
        if not found:
            self.send_again()
        return found

    def results(self) -> list[tuple[str, dict[str, Any]]]:
        """Return every result; a broker may deliver the same text twice."""
        return [(key, json.loads(text)) for key, texts in tuple(self.given.items()) for text in tuple(texts)]

    def close(self) -> None:
        """Disconnect."""
        disconnect(self._client)


@pytest.mark.waits("about 35 s of twenty failures with waits of up to 5 s, as the broker lives in real time")
def test_no_command_is_lost_and_none_runs_twice(campaign: Campaign, tmp_path: Path) -> None:
    with broker(tmp_path) as one:
        server = coms_chaos.Server(one.port, one.kill, one.start)
        with coms_chaos.world(server, tmp_path, "mqtt://127.0.0.1:{port}") as there:
            lab = Supervisor(one)
            try:
                coms_chaos.disturb(campaign, there, lab, (2, lambda: there.end_server(one.end)))
            finally:
                lab.close()
        coms_chaos.judge(there, lab)
