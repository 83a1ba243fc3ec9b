"""The number of stops and faults of a robot, for commands that wait before they begin.

After a stop, a fault or an emergency stop, no earlier command may begin. A command notes the number when it is
accepted, and compares it after each wait.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from maya_ros.graph.events import EventSource
from maya_un.errors import Stopped
from maya_un.events import Event, Trouble


class StoppedRobot(Protocol):
    """The part of a controller layer that reports what ends its motion."""

    @property
    def stops(self) -> int:
        """Number of stops and aborts so far; read from any thread."""
        ...

    @property
    def events(self) -> EventSource:
        """The source of its events."""
        ...


class Halts:
    """Counts the stops of `robot`, and the faults among the events that it hears."""

    def __init__(self, robot: StoppedRobot) -> None:
        self._robot = robot
        self._faults = 0

    @classmethod
    @contextmanager
    def of(cls, robot: StoppedRobot) -> Iterator[Halts]:
        """Yield the count of a robot; faults are counted while the block runs."""
        halts = cls(robot)
        with robot.events.listening(halts.hear):
            yield halts

    @property
    def count(self) -> int:
        """Number of stops and faults so far; read from any thread. A stop counts before the robot brakes."""
        return self._robot.stops + self._faults

    def require(self, count: int) -> None:
        """Raise `Stopped` if a stop or a fault came after the `count`."""
        if self.count != count:
            raise Stopped

    def hear(self, event: Event) -> None:
        """Take an event of the robot."""
        if isinstance(event, Trouble):
            self._faults += 1
