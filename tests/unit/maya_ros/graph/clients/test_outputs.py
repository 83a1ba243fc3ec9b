"""Digital outputs across a graph: a client of the controller layer of a twin, on one bus."""

from __future__ import annotations

import pytest

from maya_ros.graph.bus import Bus
from maya_un.config.files import parse
from maya_un.errors import InvalidValue
from maya_un.events import OutputCleared, OutputSet
from tests.graphs import controller_node, seen_from

CONFIG = parse({"controller": {"stream_rate": 10.0, "outputs": [2]}, "safety": {"guard_time": 0.0}})


async def test_output_is_switched_and_reported() -> None:
    bus = Bus()
    async with controller_node(bus, config=CONFIG) as twin, seen_from(bus, "robot_controller", CONFIG) as (_, client):
        events = twin.rig.controller.events
        for on, kind in ((True, OutputSet), (False, OutputCleared)):
            await client.output(2, on=on)
            record = twin.rig.controller.record
            assert record is not None
            assert record.output(2) is on
            told = [event for event in events.since(0) if isinstance(event, OutputSet | OutputCleared)][-1]
            assert (type(told), told.number) == (kind, 2)


async def test_output_that_the_configuration_lacks_is_refused() -> None:
    bus = Bus()
    async with controller_node(bus, config=CONFIG), seen_from(bus, "robot_controller", CONFIG) as (_, client):
        with pytest.raises(InvalidValue):
            await client.output(1, on=True)
        answer = await bus.node("other").call("/controller/output", {"number": 3, "on": True})
        assert (answer["success"], answer["message"][:6]) == (False, "4001: ")
