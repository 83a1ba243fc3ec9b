"""An observer of everything that crosses a broker: plain paho, none of our code but the schemas that it checks."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import jsonschema
import paho.mqtt.client as mqtt
from paho.mqtt.enums import CallbackAPIVersion

from maya_un.coms.schemas import SCHEMAS
from tests.system.brokers import Broker, disconnect

VALIDATORS = {kind: jsonschema.Draft202012Validator(schema) for kind, schema in SCHEMAS.items()}
"""Of the messages on a topic, by the last word of the topic."""


class Seen(NamedTuple):
    """A message on a topic of a robot; `kind` is the last word of the topic."""

    robot: str
    kind: str
    data: dict[str, Any]


class Observer:
    """Collects what crosses, in order."""

    def __init__(self, broker: Broker) -> None:
        self.seen: list[Seen] = []
        self.faults: list[str] = []
        self._changed = threading.Condition()
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
        self._client.on_message = self._on_message
        self._client.on_connect = self._on_connect
        subscribed = threading.Event()
        self._client.on_subscribe = lambda *_: subscribed.set()
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()
        assert subscribed.wait(30.0)

    def _on_connect(self, *_: object) -> None:
        self._client.subscribe("maya/v1/#", 1)

    def _on_message(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        _, _, robot, kind = message.topic.split("/")
        with self._changed:
            try:
                data = json.loads(message.payload)
                VALIDATORS[kind].validate(data)
                self.seen.append(Seen(robot, kind, data))
            except (ValueError, KeyError, jsonschema.ValidationError) as error:
                self.faults.append(f"{message.topic}: {message.payload!r}: {error}")
            self._changed.notify_all()

    def until(self, holds: Callable[[list[Seen]], bool], within: float = 120.0) -> None:
        """Wait until a condition holds for what was seen."""
        until = time.monotonic() + within
        with self._changed:
            assert self._changed.wait_for(lambda: holds(self.seen), until - time.monotonic()), self.seen[-5:]

    def commands(self) -> dict[str, dict[str, Any]]:
        """Return the commands by id; two of one id with different content fail."""
        found: dict[str, dict[str, Any]] = {}
        for seen in self.seen:
            if seen.kind == "commands":
                assert found.setdefault(seen.data["id"], seen.data) == seen.data
        return found

    def executions(self) -> dict[str, set[str]]:
        """Return the dates at which each step began, by id."""
        found: dict[str, set[str]] = {}
        for seen in self.seen:
            if seen.kind == "progress" and seen.data["state"] == "executing":
                found.setdefault(seen.data["id"], set()).add(seen.data["date"])
        return found

    def results(self) -> dict[str, dict[str, Any]]:
        """Return the results by id; two of one id with different content fail."""
        found: dict[str, dict[str, Any]] = {}
        for seen in self.seen:
            if seen.kind == "results":
                assert found.setdefault(seen.data["id"], seen.data) == seen.data
        return found

    def close(self) -> None:
        """Disconnect."""
        disconnect(self._client)


@contextmanager
def observing(broker: Broker) -> Iterator[Observer]:
    """Observe while the block runs; afterwards everything must have been as the schemas say."""
    one = Observer(broker)
    try:
        yield one
    finally:
        one.close()
    assert one.faults == []
