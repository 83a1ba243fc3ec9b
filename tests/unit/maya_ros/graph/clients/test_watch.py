"""The client of a controller layer joins its topics: late subscribers, servers that restart, invalid messages."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from math import inf, nan

import pytest

from maya_ros.graph.bus import Bus, BusNode
from maya_ros.graph.clients.watch import SETTLES, SILENT, ControllerWatch
from maya_ros.graph.diagnostics import array, controller
from maya_ros.graph.events import REFUSED, ControllerCondition, ReportedEvent, Strokes
from maya_ros.graph.table import DIAGNOSTICS, EVENT, JOINTS, POSITION
from maya_un.config import Config, Units
from maya_un.controller.homing import homed_pose
from maya_un.errors import NodeGone
from maya_un.events import Connected, Disconnected, Event, HomingNeeded, LimitHit
from maya_un.values import Joints, Mode, Notice, Point
from tests.virtual_time import elapse, turn

STROKES: Strokes = ((0.0, 2.09), (0.575, 2.2), (0.565, 2.25))
IDLE = ControllerCondition(Mode.IDLE, homed=True, moving=False, gripper_closed=False, strokes=STROKES)


@dataclass
class Teller:
    """A controller node with scripted messages."""

    bus: Bus
    watch: ControllerWatch
    config: Config = field(default_factory=Config)

    def __post_init__(self) -> None:
        self.starts()

    def starts(self) -> None:
        self.node = self.bus.node("hw_simulator")
        self._events = self.node.advertise(EVENT.name, EVENT.type, latch=True)
        self._health = self.node.advertise(DIAGNOSTICS.name, DIAGNOSTICS.type)
        self.senses(self.node)

    def senses(self, node: BusNode) -> None:
        self._joints = node.advertise(JOINTS.name, JOINTS.type)
        self._point = node.advertise(POSITION.name, POSITION.type, latch=True)

    def places(self, point: Point) -> None:
        self._point.publish(point._asdict())

    def is_well(self) -> None:
        state = replace(self.watch.state, mode=Mode.IDLE)
        self._health.publish(array([controller(state)], 0.0))

    def goes_blind(self) -> None:
        self._joints.close()
        self._point.close()

    async def says(self, word: str, standing: ControllerCondition, code: int = 0, **detail: object) -> None:
        await self.says_text(ReportedEvent(word, standing, code, detail).text())

    async def says_text(self, text: str) -> None:
        self._events.publish({"data": text})
        await turn()
        await turn()

    async def measures(self, joints: Joints, *names: str) -> None:
        self._joints.publish({"name": names or ("c", "b", "a"), "position": joints[::-1], "velocity": (0.3, 0.2, 0.1)})
        self._point.publish({"x": 0.1, "y": 0.2, "z": 0.3})
        await turn()
        await turn()


@asynccontextmanager
async def watched() -> AsyncIterator[Teller]:
    bus = Bus()
    watch = ControllerWatch(bus.node("robot_controller"), Config(), 1.0)
    try:
        yield Teller(bus, watch)
    finally:
        await watch.close()


def kinds(watch: ControllerWatch) -> list[type[Event]]:
    return [type(event) for event in watch.events.since(0)]


def place() -> Joints:
    units = Units.of(Config())
    return units.to_joints(units.to_counts(homed_pose(Config())))


async def test_state_is_disconnected_before_the_first_message() -> None:
    async with watched() as teller:
        state = teller.watch.state
        assert (state.mode, state.homed, state.joints, state.motors_on) == (
            Mode.DISCONNECTED,
            False,
            None,
            (False,) * 3,
        )
        assert not teller.watch.there


async def test_state_is_joined_from_three_topics() -> None:
    async with watched() as teller:
        await teller.says("idle", replace(IDLE, override=0.5, gripper_closed=True))
        await teller.measures(place())
        state = teller.watch.state
        assert (state.mode, state.homed, state.gripper_closed, state.override) == (Mode.IDLE, True, True, 0.5)
        assert state.joints == place()
        assert state.counts == Units.of(Config()).to_counts(place())
        assert (state.point, state.velocity) == (Point(0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
        workspace = teller.watch.workspace
        assert (workspace.boom, workspace.line_b, workspace.line_c) == STROKES


async def test_joints_are_unknown_before_homing() -> None:
    async with watched() as teller:
        await teller.says("not_homed", replace(IDLE, mode=Mode.NOT_HOMED, homed=False, strokes=None))
        await teller.measures(place())
        assert (teller.watch.state.joints, teller.watch.state.point) == (None, None)


async def test_homed_robot_counts_as_such_when_its_position_is_known() -> None:
    async with watched() as teller:
        for _ in range(2):
            await teller.says("homed", IDLE)
            assert (teller.watch.state.mode, teller.watch.state.homed) == (Mode.NOT_HOMED, False)
            await teller.measures(place())
            assert (teller.watch.state.mode, teller.watch.state.homed) == (Mode.IDLE, True)
            await teller.says("not_homed", replace(IDLE, mode=Mode.NOT_HOMED, homed=False, strokes=None))


async def test_late_subscriber_knows_all_from_the_last_event() -> None:
    async with watched() as teller:
        fault = Notice(2301, "limit switch b")
        await teller.says("limit", replace(IDLE, mode=Mode.FAULT, fault=fault), 2301, message="limit switch b")
        late = ControllerWatch(teller.bus.node("process_controller"), Config(), 1.0)
        await turn()
        await turn()
        assert (late.state.mode, late.state.fault, late.state.homed) == (Mode.FAULT, fault, True)
        assert [type(event) for event in late.events.since(0)] == [Connected, LimitHit]
        await late.close()


async def test_equal_strokes_leave_the_workspace_as_it_is() -> None:
    async with watched() as teller:
        await teller.says("homed", IDLE)
        before = teller.watch.workspace
        await teller.says("moving", replace(IDLE, mode=Mode.MOVING))
        assert teller.watch.workspace is before


@pytest.mark.parametrize("text", ["", "idle", "idle {}", 'dance {"mode":"idle"}', "idle [1]", 'idle {"mode":"asleep"}'])
async def test_nonsense_of_anybody_changes_nothing(text: str) -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        before = teller.watch.state
        await teller.says_text(text)
        assert teller.watch.state is before


async def test_joints_of_something_else_are_not_those_of_the_robot() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await teller.measures(place())
        await teller.measures(Joints(1.0, 1.0, 1.0), "left_wheel", "right_wheel", "a")
        assert teller.watch.state.joints == place()


async def test_invalid_positions_change_nothing() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await teller.measures(place())
        before = teller.watch.state
        await teller.measures(Joints(nan, 1.5, 1.5))
        await teller.measures(Joints(0.5, inf, 1.5))
        teller.places(Point(nan, 0.2, 0.3))
        await turn()
        assert (teller.watch.state.joints, teller.watch.state.point) == (before.joints, before.point)


async def test_strokes_with_which_nothing_is_reachable_change_nothing() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await teller.measures(place())
        before = teller.watch.workspace
        await teller.says("fault", replace(IDLE, mode=Mode.FAULT, strokes=((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))))
        assert teller.watch.state.mode is Mode.IDLE
        assert teller.watch.workspace is before


async def test_hanging_node_counts_as_disconnected_until_it_continues() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await elapse(3 * SILENT)
        assert teller.watch.there, "nobody is missed who never told how he is"
        teller.is_well()
        await elapse(SILENT - 0.5)
        assert teller.watch.there
        await elapse(1.0)
        assert not teller.watch.there
        assert teller.watch.state.mode is Mode.DISCONNECTED
        last = teller.watch.events.since(0)[-1]
        assert (type(last), last.code) == (Disconnected, NodeGone.code)
        assert "hw_simulator" in str(last.detail["message"])
        teller.is_well()
        await elapse(0.3)
        assert teller.watch.there
        await teller.measures(place())
        assert (teller.watch.state.mode, kinds(teller.watch)[-1]) == (Mode.IDLE, Connected)


async def test_refusal_is_no_event_but_reports_the_status() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        known = len(teller.watch.events)
        await teller.says(REFUSED, replace(IDLE, override=0.2), 2104, request="/controller/command")
        assert len(teller.watch.events) == known
        assert teller.watch.state.override == 0.2


async def test_a_detail_may_be_called_as_it_likes() -> None:
    async with watched() as teller:
        await teller.says_text(ReportedEvent("moving", IDLE, 0, {"kind": "x", "code": "y", "to": "there"}).text())
        last = teller.watch.events.last
        assert last is not None
        assert dict(last.detail) == {"kind": "x", "code": "y", "to": "there"}


async def test_node_that_leaves_is_missed_and_a_new_one_is_accepted() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await teller.measures(place())
        teller.node.close()
        await elapse(0.3)
        state, last = teller.watch.state, teller.watch.events.last
        assert (state.mode, state.joints) == (Mode.DISCONNECTED, None)
        assert last is not None
        assert (type(last), last.code) == (Disconnected, NodeGone.code)
        await elapse(60.0)
        assert len(kinds(teller.watch)) == 3
        teller.starts()
        await teller.says("not_homed", replace(IDLE, mode=Mode.NOT_HOMED, homed=False, strokes=None))
        assert kinds(teller.watch)[3:] == [Connected, HomingNeeded]
        assert (teller.watch.state.mode, teller.watch.state.joints) == (Mode.NOT_HOMED, None)


async def test_layer_without_sensors_counts_as_disconnected_until_they_return() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        await teller.measures(place())
        teller.goes_blind()
        await elapse(0.3)
        state, last = teller.watch.state, teller.watch.events.last
        assert (state.mode, state.homed, state.joints) == (Mode.DISCONNECTED, True, None)
        assert last is not None
        assert (type(last), last.code) == (Disconnected, NodeGone.code)
        await teller.says("stopped", IDLE)
        assert teller.watch.state.mode is Mode.DISCONNECTED
        teller.senses(teller.bus.node("sensor_converter"))
        await elapse(0.3)
        await teller.measures(place())
        assert (teller.watch.state.mode, teller.watch.state.joints) == (Mode.IDLE, place())
        assert kinds(teller.watch)[-1] is Connected


async def test_end_of_a_command_is_awaited_until_it_shows() -> None:
    async with watched() as teller:
        await teller.says("moving", replace(IDLE, mode=Mode.MOVING, moving=True))
        settling = asyncio.ensure_future(teller.watch.settled())
        for _ in range(3):
            await teller.measures(place())
        assert not settling.done(), "it still says that it moves"
        await teller.says("idle", IDLE)
        await settling
        settling = asyncio.ensure_future(teller.watch.settled())
        await teller.measures(place())
        assert not settling.done(), "what comes first may have been measured before"
        await teller.measures(place())
        await settling


async def test_silent_node_is_not_awaited_for_ever() -> None:
    async with watched() as teller:
        await teller.says("idle", IDLE)
        began = asyncio.get_running_loop().time()
        await teller.watch.settled()
        assert asyncio.get_running_loop().time() - began == pytest.approx(SETTLES)


async def test_unchanged_position_makes_no_new_state() -> None:
    """At rest the position is published fifty times a second."""
    async with watched() as teller:
        await teller.says("idle", IDLE)
        teller.places(Point(0.1, 0.2, 0.3))
        await turn()
        await turn()
        before = teller.watch.state
        teller.places(Point(0.1, 0.2, 0.3))
        await turn()
        await turn()
        assert teller.watch.state is before
        teller.places(Point(0.1, 0.2, 0.4))
        await turn()
        await turn()
        assert teller.watch.state is not before
