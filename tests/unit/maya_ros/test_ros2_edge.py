"""The topics of a graph on DDS, without DDS."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

pytest.importorskip("cyclonedds", reason="there is no DDS for this machine")

from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Message
from maya_ros.graph.table import SPEED, STEP_RESULT
from maya_ros.ros2.demand import LOOK
from maya_ros.ros2.edge import Ros2Edge
from maya_un.service.access.operations import ROS
from tests.ros2_fakes import FakeDds, rest


class Insider(Guest):
    """A guest with the access of `ROS`."""

    def __init__(self) -> None:
        super().__init__("ros2")
        self._caller = ROS


@asynccontextmanager
async def on_dds(bus: Bus) -> AsyncIterator[FakeDds]:
    """Offer a graph on DDS while the block runs."""
    dds = FakeDds()
    edge = Ros2Edge(bus.node("ros2"), Insider(), dds, bus.now)  # pyright: ignore[reportArgumentType]
    await edge.look()
    yield dds
    await edge.close()


async def test_newest_message_of_a_topic_counts_while_the_loop_is_busy() -> None:
    bus, heard = Bus(), list[Message]()
    bus.node("hw_simulator").subscribe(SPEED.name, SPEED.type, heard.append, queue_size=SPEED.queue_size)
    async with on_dds(bus) as dds:
        for value in (1.0, 0.5, 0.1):
            dds.give(SPEED.name, {"data": value})
        await rest()
        assert (heard, dds.counts.displaced) == ([{"data": 0.1}], 2)
        dds.give(SPEED.name, {"data": 0.7})
        await rest()
        dds.give(SPEED.name, {"data": 0.8})
        await rest()
        assert heard[1:] == [{"data": 0.7}, {"data": 0.8}]


async def test_result_of_a_step_waits_for_a_reader() -> None:
    bus = Bus()
    results = bus.node("firebase_bridge").advertise(STEP_RESULT.name, STEP_RESULT.type)
    async with on_dds(bus) as dds:
        await rest()
        assert results.readers == 0
        dds.writers[STEP_RESULT.name].read = True
        await rest(2 * LOOK)
        assert results.readers == 1
        results.publish({"data": "1"})
        await rest()
        assert dds.writers[STEP_RESULT.name].sent == [{"data": "1"}]
        dds.writers[STEP_RESULT.name].read = False
        await rest(2 * LOOK)
        assert results.readers == 0
