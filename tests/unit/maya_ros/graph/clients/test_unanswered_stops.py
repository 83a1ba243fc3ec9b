"""Stops that are not answered: without a master goals are cancelled; a node that hangs is named, and stops later."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.clients.controller import GraphController
from maya_ros.graph.clients.watch import SILENT
from maya_ros.graph.diagnostics import array
from maya_ros.graph.diagnostics import controller as diagnosed
from maya_ros.graph.events import ControllerCondition, ReportedEvent, Strokes
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.table import ABORT, DIAGNOSTICS, EVENT, FOLLOW, GRIPPER, HOME, JOINTS, MOVE, STOP, Row
from maya_un.cli.quick import SERVICE_TIMEOUT
from maya_un.config import Config
from maya_un.errors import NodeGone, NotConnected
from maya_un.values import Mode
from tests.virtual_time import elapse

STROKES: Strokes = ((0.0, 2.09), (0.575, 2.2), (0.565, 2.25))


@pytest.mark.parametrize("row", [HOME, MOVE, FOLLOW], ids=lambda row: row.name)
async def test_unanswered_stop_cancels_the_motion(row: Row) -> None:
    bus, stopped = Bus(), asyncio.Event()

    async def act(_: Message, feedback: Feedback) -> Message:
        feedback({})
        try:
            await asyncio.Event().wait()
        finally:
            stopped.set()
        return {}

    served = bus.node("hw_simulator").act(row.name, row.type, act)
    goal = asyncio.create_task(bus.node("somebody").do(row.name, row.type, {}))
    await elapse(0.1)
    async with GraphController.on(bus.node("process_controller"), Config()) as controller:
        assert not stopped.is_set()
        await controller.stop()
        await elapse(0.1)
        assert stopped.is_set()
        await goal
        served.close()
        await elapse(0.1)
        with pytest.raises(NotConnected):
            await controller.stop()
    await elapse(5.0)


class Frozen:
    """A controller node that hangs from the beginning, and its requests when it continues."""

    def __init__(self, bus: Bus) -> None:
        node = bus.node("hw_simulator")
        self.goes_on = asyncio.Event()
        self.done: list[str] = []
        standing = ControllerCondition(Mode.IDLE, homed=True, moving=False, gripper_closed=False, strokes=STROKES)
        node.advertise(EVENT.name, EVENT.type, latch=True).publish(
            {"data": ReportedEvent("idle", standing, 0, {}).text()}
        )
        node.advertise(JOINTS.name, JOINTS.type)
        self._health = node.advertise(DIAGNOSTICS.name, DIAGNOSTICS.type)
        for row in (STOP, ABORT, GRIPPER):
            node.serve(row.name, row.type, lambda _, name=row.name: self._answer(name))

    def is_well(self, controller: GraphController) -> None:
        self._health.publish(array([diagnosed(controller.state, "sim")], 0.0))

    async def _answer(self, name: str) -> Message:
        await self.goes_on.wait()
        self.done.append(name)
        return {"success": True, "message": ""}


@pytest.mark.parametrize("speed", [1.0, 50.0])
@pytest.mark.parametrize("stop", ["stop", "abort"])
async def test_hanging_node_is_named_in_time_and_stops_when_it_continues(stop: str, speed: float) -> None:
    bus, loop = Bus(), asyncio.get_running_loop()
    async with GraphController.on(bus.node("process_controller"), Config(), speed=speed) as controller:
        frozen = Frozen(bus)
        await controller.connected()
        began = loop.time()
        for _ in range(2):
            with pytest.raises(NodeGone, match="hw_simulator"):
                await getattr(controller, stop)()
        assert loop.time() - began < 2.0 * 0.75 * SERVICE_TIMEOUT * speed
        frozen.goes_on.set()
        await elapse(0.1)
        assert frozen.done == [f"/controller/{stop}"] * 2


async def test_abandoned_stop_is_still_sent() -> None:
    bus = Bus()
    async with GraphController.on(bus.node("process_controller"), Config()) as controller:
        frozen = Frozen(bus)
        await controller.connected()
        asking = asyncio.create_task(controller.stop())
        await elapse(0.1)
        asking.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asking
        frozen.goes_on.set()
        await elapse(0.1)
        assert frozen.done == [STOP.name]


async def test_command_ends_when_its_node_hangs_and_does_not_run_later() -> None:
    bus, loop = Bus(), asyncio.get_running_loop()
    async with GraphController.on(bus.node("process_controller"), Config()) as controller:
        frozen = Frozen(bus)
        await controller.connected()
        frozen.is_well(controller)
        began = loop.time()
        with pytest.raises(NodeGone, match="hw_simulator"):
            await controller.gripper(open_=True)
        assert loop.time() - began == pytest.approx(SILENT, abs=0.3)
        assert frozen.done == []
        frozen.goes_on.set()
        await elapse(0.1)
        assert frozen.done == []
