"""The graph of ROS beside `maya up`: one bus with all layers of the robot, for rosbridge and for ROS 2 at once."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

from maya_ros.graph.access import Guest
from maya_ros.graph.bus import Bus
from maya_ros.ros1.rights import token_of_graph
from maya_ros.rosbridge import standalone
from maya_ros.rosbridge.standalone import configured
from maya_un.assembly import Stack
from maya_un.edges import EndpointOptions, Ros2Options
from maya_un.errors import MayaError, Ros2Missing
from maya_un.http import dates
from maya_un.http.bridge import Bridge

__all__ = ["configured", "endpoint"]

_log = logging.getLogger("maya_ros.edge")


@asynccontextmanager
async def endpoint(stack: Stack, bridge: Bridge, place: EndpointOptions, *, speed: float = 1.0) -> AsyncIterator[None]:
    """Serve `stack` over rosbridge, over ROS 2 or both while the block runs; see `maya_un.edges.Edge`.

    Raises `Ros2Missing` if ROS 2 is asked for and DDS is not installed.
    """
    async with AsyncExitStack() as held:
        bus = await held.enter_async_context(standalone.graph_of(stack, bridge, place.steps, speed=speed))
        if place.listener is not None:
            rosbridge = standalone.served(bus, bridge, place.listener, place.edge, dates.epoch)
            await held.enter_async_context(rosbridge)
        if place.ros2 is not None:
            await held.enter_async_context(in_ros2(bus, bridge, place.ros2))
        yield


@asynccontextmanager
async def in_ros2(bus: Bus, bridge: Bridge, options: Ros2Options) -> AsyncIterator[None]:
    """Offer a graph to ROS 2 while the block runs. Raises `Ros2Missing` if DDS is not installed."""
    try:
        from maya_ros.ros2.edge import dds_serving  # noqa: PLC0415 - an extra, and 10 MB that rosbridge does not need
    except ImportError as missing:
        raise Ros2Missing(name=str(missing.name)) from missing
    async with _signed_in(bridge) as guest, dds_serving(bus, guest, options.domain, options.namespace):
        yield


@asynccontextmanager
async def _signed_in(bridge: Bridge) -> AsyncIterator[Guest]:
    """Yield the guest that all programs of ROS 2 are; the rights of the graph's token follow each change."""
    guest, token = Guest("ros2"), token_of_graph() or None
    news = asyncio.Event()
    news.set()

    async def follow() -> None:
        while await news.wait():
            news.clear()
            try:
                await guest.introduce(bridge, token)
            except MayaError as refusal:
                _log.warning("programs of ROS 2 may only stop the robot: %s %s", refusal.code, refusal)

    end = bridge.heard_by(news.set)
    following = asyncio.create_task(follow(), name="rights of ROS 2")
    try:
        yield guest
    finally:
        end()
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)
