from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

from maya_ros.graph import types
from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.events import ControllerCondition, ReportedEvent
from maya_ros.graph.table import EVENT, SENSORS
from maya_ros.ros1.sensing import SensedController
from maya_un.config import Config, Units
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.values import Joints, Mode, State
from tests.virtual_time import elapse

CONFIG = Config()
JOINTS = Joints(0.5, 1.7, 1.6)
STROKES = ((0.0, 2.0), (0.6, 2.2), (0.6, 2.25))


def raw(**fields: Any) -> dict[str, Any]:
    counts = Units.of(CONFIG).to_counts(JOINTS)
    return {**types.default(SENSORS.type), "position": list(counts), "gripper_closed": True, **fields}


def event(word: str, mode: Mode, *, homed: bool) -> dict[str, Any]:
    standing = ControllerCondition(
        mode, homed=homed, moving=False, gripper_closed=False, strokes=STROKES if homed else None
    )
    return {"data": ReportedEvent(word, standing).text()}


@asynccontextmanager
async def sensed() -> AsyncIterator[tuple[SensedController, BusNode]]:
    bus = Bus()
    box = bus.node("box")
    layer = SensedController(CONFIG)
    async with layer.listening(bus.node("sensor_converter")):
        yield layer, box


async def publish(box: BusNode, topic: str, kind: str, message: dict[str, Any]) -> None:
    box.advertise(topic, kind).publish(message)
    await elapse(0.01)


async def test_before_homing_the_counts_say_nothing_about_lengths() -> None:
    async with sensed() as (layer, box):
        await publish(box, EVENT.name, EVENT.type, event("not_homed", Mode.NOT_HOMED, homed=False))
        await publish(box, SENSORS.name, SENSORS.type, raw(moving=[False, True, False], motor_off=[True, False, False]))
        state = layer.state
        assert (state.joints, state.point, state.mode, state.moving) == (None, None, Mode.NOT_HOMED, True)
        assert (state.counts, state.motors_on) == (Units.of(CONFIG).to_counts(JOINTS), (False, True, True))
        assert state.gripper_closed


async def test_once_homed_they_are_joints_and_a_place_in_the_measured_workspace() -> None:
    async with sensed() as (layer, box):
        await publish(box, EVENT.name, EVENT.type, event("homed", Mode.IDLE, homed=True))
        await publish(box, SENSORS.name, SENSORS.type, raw(velocity=[0.0, 45000.0, 0.0]))
        state = layer.state
        expected = Units.of(CONFIG).to_joints(Units.of(CONFIG).to_counts(JOINTS))
        assert (state.joints, state.point) == (expected, Mechanism.of(CONFIG).fk(expected))
        assert state.velocity == (0.0, 0.045, 0.0)
        workspace = Workspace.of(CONFIG)
        a, b, c = STROKES
        assert layer.workspace == replace(workspace, boom=a, line_b=b, line_c=c)


async def test_lines_that_cannot_meet_have_no_place() -> None:
    async with sensed() as (layer, box):
        await publish(box, EVENT.name, EVENT.type, event("homed", Mode.IDLE, homed=True))
        await publish(box, SENSORS.name, SENSORS.type, raw(position=[0, 100_000, 100_000]))
        assert layer.state.joints is not None
        assert layer.state.point is None


async def test_unknown_event_sends_nothing() -> None:
    async with sensed() as (layer, box):
        await publish(box, EVENT.name, EVENT.type, event("homed", Mode.IDLE, homed=True))
        await publish(box, EVENT.name, EVENT.type, {"data": "hello"})
        await publish(box, SENSORS.name, SENSORS.type, raw())
        assert layer.state.homed


async def test_new_subscriber_gets_current_measurements_newest_first() -> None:
    async with sensed() as (layer, box):
        seen: list[State] = []

        async def watch() -> None:
            async for state in layer.watch():
                seen.append(state)
                await elapse(1.0)

        watching = asyncio.ensure_future(watch())
        await elapse(0.5)
        assert seen == []
        for count in range(3):
            await publish(box, SENSORS.name, SENSORS.type, raw(position=[count, 0, 0]))
        await elapse(3.0)
        watching.cancel()
        await asyncio.wait({watching})
        assert [state.counts[0] for state in seen] == [0, 2]
