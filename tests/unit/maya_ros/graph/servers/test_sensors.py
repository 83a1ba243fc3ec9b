"""Measurements on a bus, from a twin that moves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass, field

import pytest

from maya_ros.graph import types
from maya_ros.graph.bus import Bus
from maya_ros.graph.protocol import Message
from maya_ros.graph.servers.sensors import SensorServer, raw_message
from maya_ros.graph.table import TABLE
from maya_un.config import Config
from maya_un.testing.rig import Rig, rig
from maya_un.values import Point
from tests.unit.controller.bench import FAR, homed
from tests.virtual_time import elapse

CUBE = Point(0.5, 1.1, 0.4)


@dataclass
class Scene:
    parts: Mapping[str, Point] = field(default_factory=lambda: {"cube": CUBE})
    carried: str | None = None


@dataclass
class Heard:
    """Received messages, by topic, with their times."""

    rig: Rig
    bus: Bus
    messages: dict[str, list[Message]] = field(default_factory=dict[str, list[Message]])

    def listen(self, *topics: str) -> None:
        rows = {row.name: row for row in TABLE}
        for name in topics:
            node = self.bus.node("somebody")
            node.subscribe(name, rows[name].type, self.messages.setdefault(name, []).append)


@asynccontextmanager
async def sensing(
    *, scene: Scene | None = None, speed: float = 1.0, robot: Callable[..., AbstractAsyncContextManager[Rig]] = homed
) -> AsyncIterator[Heard]:
    fast = Config().model_copy(update={"controller": Config().controller.model_copy(update={"stream_rate": 50.0})})
    bus = Bus()
    async with robot(fast, live=True) as layer:
        server = SensorServer(
            layer.controller, fast, raw=lambda: layer.controller.record, scene=scene, clock=lambda: 7.0, speed=speed
        )
        async with server.open(bus.node("hw_simulator")):
            yield Heard(layer, bus)


async def test_position_is_not_published_before_homing() -> None:
    async with sensing(robot=rig) as heard:
        heard.listen("/maya_position", "/joint_states", "/hardware_sensor")
        await elapse(1.0)
        assert heard.messages["/maya_position"] == heard.messages["/joint_states"] == []
        raw = heard.messages["/hardware_sensor"]
        assert len(raw) == pytest.approx(50, abs=5)
        record = heard.rig.controller.record
        assert record is not None
        assert raw[-1] == types.conform("maya_controller/RawSensorData", raw_message(record, Config(), 7.0))
        assert raw[-1]["header"]["stamp"] == {"secs": 7, "nsecs": 0}


async def test_fast_clock_does_not_raise_the_rate_of_measurements() -> None:
    async with sensing(speed=10.0) as heard:
        heard.listen("/hardware_sensor")
        await elapse(10.0)  # of the twin, which is one second of the listener
        assert 48 <= len(heard.messages["/hardware_sensor"]) <= 53


async def test_homed_robot_publishes_its_position_and_markers() -> None:
    async with sensing(scene=Scene()) as heard:
        heard.listen("/maya_position", "/joint_states", "/maya_markers")
        task = asyncio.ensure_future(heard.rig.controller.move(FAR))
        await elapse(3.0)
        state = heard.rig.controller.state
        assert state.point is not None
        assert state.joints is not None
        joints = heard.messages["/joint_states"][-1]
        assert joints["name"][:3] == ["a", "b", "c"]
        assert joints["position"][:3] == pytest.approx(list(state.joints), abs=1e-6)
        assert joints["velocity"][0] != 0.0
        place = heard.messages["/maya_position"][-1]
        assert (place["x"], place["y"], place["z"]) == pytest.approx(tuple(state.point), abs=1e-6)
        assert len(heard.messages["/maya_position"]) == pytest.approx(150, rel=0.15)
        drawn = heard.messages["/maya_markers"]
        assert {"lines", "workspace"} <= {marker["ns"] for marker in drawn[0]["markers"]}
        assert any("part" in marker["ns"] for marker in drawn[0]["markers"])
        assert len(drawn) == 1  # frames move, and what is tied to them needs no message
        await task


async def test_new_subscriber_gets_every_marker() -> None:
    async with sensing() as heard:
        heard.listen("/maya_markers")
        await elapse(1.0)
        whole = len(heard.messages["/maya_markers"][0]["markers"])
        late = list[Message]()
        heard.bus.node("late").subscribe("/maya_markers", "", late.append)
        await elapse(1.0)
        assert len(late[-1]["markers"]) == whole


async def test_late_subscriber_gets_the_last_position() -> None:
    async with sensing() as heard:
        await elapse(0.1)
        heard.listen("/maya_position")
        await elapse(0.0)
        assert len(heard.messages["/maya_position"]) == 1


async def test_without_a_source_of_raw_data_there_is_no_such_topic() -> None:
    bus = Bus()
    async with rig() as layer, SensorServer(layer.controller, Config()).open(bus.node("sensor_converter")):
        published = (await bus.directory.nodes())["/sensor_converter"].publishes
        assert set(published) == {"/maya_position", "/joint_states", "/maya_markers"}
    assert await bus.directory.topics() == {}
