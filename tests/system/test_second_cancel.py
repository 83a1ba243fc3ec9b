"""Many cancels at random instants, at every place that waits for moving axes: each returns with the axes at rest."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import cast

import pytest

from maya_ros.graph.outcome import call_service, run_action
from maya_ros.graph.protocol import Message
from maya_ros.graph.table import MOVE, Kind, Layer, Row
from maya_un.http.bridge import Bridge
from maya_un.process.lease import ControlLease
from maya_un.robot.primitives.move import MoveJoints
from maya_un.service.access.operations import LOCAL, Operation
from maya_un.service.direct import DirectCommands
from maya_un.service.service import Gate, Service
from tests.campaign import Campaign
from tests.graphs import LayerNodes, layer_nodes
from tests.unit.controller.bench import FAR
from tests.virtual_time import elapse

pytestmark = pytest.mark.system

LAG = 3e-4
"""The axes may still follow a reference that rests by so much [rad, m, m]."""

GO = Row("/go", Kind.SERVICE, "std_srvs/Trigger", Layer.CONTROLLER, "move", (), ())


def by_controller(layers: LayerNodes) -> Awaitable[object]:
    return layers.controller_node.rig.controller.move(FAR)


def by_direct(layers: LayerNodes) -> Awaitable[object]:
    return DirectCommands(layers.process, layers.robot, layers.controller_node.rig.controller, lambda: None).move(FAR)


def gate(layers: LayerNodes) -> Gate:
    return Gate(
        cast("Service", layers.controller_node.rig.controller),
        ControlLease(layers.controller_node.rig.controller.events),
    )


def by_gate(layers: LayerNodes) -> Awaitable[object]:
    return gate(layers).call(LOCAL, Operation.COMMAND, lambda _: by_controller(layers))


def by_bridge(layers: LayerNodes) -> Awaitable[object]:
    service = cast("Service", layers.controller_node.rig.controller)
    bridge = Bridge(asyncio.get_running_loop(), service, gate=gate(layers))
    return bridge.carry(LOCAL, Operation.COMMAND, lambda _: by_controller(layers))


async def _answer(layers: LayerNodes) -> Message:
    await by_controller(layers)
    return {"success": True, "message": ""}


def by_service_of_the_bus(layers: LayerNodes) -> Awaitable[object]:
    node = layers.bus.node("server")
    node.serve(GO.name, GO.type, lambda _: _answer(layers))
    return layers.bus.node("client").call(GO.name, {}, GO.type)


def by_service_asked(layers: LayerNodes) -> Awaitable[object]:
    node = layers.bus.node("server")
    node.serve(GO.name, GO.type, lambda _: _answer(layers))
    return call_service(layers.bus.node("client"), GO, {})


def by_action_of_the_bus(layers: LayerNodes) -> Awaitable[object]:
    return layers.bus.node("client").do(MOVE.name, MOVE.type, FAR._asdict())


def by_action_asked(layers: LayerNodes) -> Awaitable[object]:
    return run_action(layers.bus.node("client"), MOVE, FAR._asdict())


def by_controller_over_the_graph(layers: LayerNodes) -> Awaitable[object]:
    return layers.controller.move(FAR)


def by_robot_over_the_graph(layers: LayerNodes) -> Awaitable[object]:
    return layers.robot.run(MoveJoints(FAR))


PLACES: dict[str, Callable[[LayerNodes], Awaitable[object]]] = {
    work.__name__.removeprefix("by_"): work
    for work in (
        by_controller,
        by_direct,
        by_gate,
        by_bridge,
        by_service_of_the_bus,
        by_service_asked,
        by_action_of_the_bus,
        by_action_asked,
        by_controller_over_the_graph,
        by_robot_over_the_graph,
    )
}


@pytest.mark.parametrize("place", PLACES)
async def test_command_cancelled_many_times_returns_with_the_axes_at_rest(place: str, campaign: Campaign) -> None:
    for case in range(campaign.size(ci=4, long=200)):
        rng = campaign.rng(case)
        async with layer_nodes() as layers:
            work = asyncio.ensure_future(_whole(PLACES[place](layers)))
            await elapse(rng.uniform(0.0, 20.0))
            for _ in range(rng.randint(2, 6)):
                work.cancel()
                await elapse(rng.choice((0.0, rng.uniform(0.0, 0.1))))
            with suppress(asyncio.CancelledError):
                await work
            assert work.cancelled()
            before = _joints(layers)
            await elapse(5.0)
            assert _joints(layers) == pytest.approx(before, abs=LAG)


async def _whole(work: Awaitable[object]) -> object:
    return await work


def _joints(layers: LayerNodes) -> tuple[float, ...]:
    layers.controller_node.rig.virtual.sync()
    return layers.mechanics.true_joints()
