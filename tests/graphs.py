"""Floors apart on a bus, in virtual time: twin and controller, robot, process, each a node of its own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass

from maya_un.config import Config
from maya_un.graph.bus import Bus, BusNode
from maya_un.graph.clients.controller import GraphController
from maya_un.graph.doors.controller import ControllerDoor
from maya_un.graph.doors.sensors import SensorsDoor
from maya_un.testing.rig import Rig, rig
from maya_un.values import Point
from maya_un.virtual.maya.start import Start


@dataclass
class Below:
    """The controller floor behind its doors, as the node hw_simulator."""

    rig: Rig
    bus: Bus
    node: BusNode

    async def dies(self) -> None:
        """End the node as a kill does."""
        self.node.close()
        await asyncio.sleep(0)


@asynccontextmanager
async def below(
    bus: Bus, *, config: Config | None = None, parts: Mapping[str, Point] | None = None, start: Start | None = None
) -> AsyncIterator[Below]:
    """Open the controller floor of a twin on a bus."""
    node = bus.node("hw_simulator")
    async with (
        rig(config, parts=parts, start=start, live=True) as bench,
        ControllerDoor(bench.controller).open(node),
        SensorsDoor(bench.controller, bench.controller.config).open(node),
    ):
        yield Below(bench, bus, node)


@asynccontextmanager
async def seen_from(
    bus: Bus, name: str, config: Config | None = None
) -> AsyncIterator[tuple[BusNode, GraphController]]:
    """Give a node and the controller floor as it sees it, connected."""
    node = bus.node(name)
    async with GraphController.on(node, Config() if config is None else config) as controller:
        await controller.connected()
        yield node, controller
    node.close()
