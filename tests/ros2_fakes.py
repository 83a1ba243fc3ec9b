"""DDS in tests: it keeps what is sent, and hands over requests as the reading thread does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from maya_ros.ros2.dds import Counts
from tests.virtual_time import elapse, turn


class FakeWriter:
    """Keeps what is sent; `read` is for tests to set."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.read = False
        self.sent: list[Mapping[str, Any]] = []

    def send(self, message: Mapping[str, Any], **_: int) -> None:
        """Keep a message."""
        self.sent.append(message)

    def send_made(self, make: Callable[[], Mapping[str, Any]]) -> None:
        """Keep a message that is made."""
        self.sent.append(make())


class FakeDds:
    """A graph on DDS without DDS."""

    def __init__(self) -> None:
        self.counts = Counts()
        self.writers: dict[str, FakeWriter] = {}
        self._heard: dict[str, Callable[[Any], None]] = {}
        self._kinds: dict[str, Any] = {}

    def publisher(self, _node: str, topic: str, _kind: Any, _quality: Any) -> FakeWriter:
        """Return the writer of a topic."""
        return self.writers.setdefault(topic, FakeWriter(topic))

    def subscription(self, _node: str, topic: str, kind: Any, _quality: Any, heard: Callable[[Any], None]) -> None:
        """Keep who reads a topic."""
        self._heard[topic], self._kinds[topic] = heard, kind

    def service(self, _node: str, name: str, kinds: Any, heard: Callable[[Any], None]) -> FakeWriter:
        """Keep who serves a service, and return the writer of its responses."""
        self._heard[name], self._kinds[name] = heard, kinds[0]
        return self.writers.setdefault(name, FakeWriter(name))

    def announce(self) -> None:
        """Announce nothing."""

    def give(self, name: str, message: Mapping[str, Any]) -> None:
        """Hand over a sample of a topic or a request."""
        sample = self._kinds[name].sample(message)
        sample.__dict__.update(guid=1, seq=1)
        self._heard[name](sample)

    def ask(self, action: str, part: str, message: Mapping[str, Any]) -> None:
        """Hand over a request of an action."""
        self.give(f"{action}/_action/{part}", message)

    def told(self, action: str, part: str) -> list[Mapping[str, Any]]:
        """Return what was sent by a part of an action."""
        return self.writers[f"{action}/_action/{part}"].sent


async def rest(time: float = 0.0) -> None:
    """Let the loop do what is ready, and what that makes ready, for some time [s]."""
    if time:
        await elapse(time)
    for _ in range(20):
        await turn()
