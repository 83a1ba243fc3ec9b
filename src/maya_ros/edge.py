"""The graph of ROS beside `maya up`: one bus with all layers of the robot, for rosbridge and for ROS 2 at once."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager

from maya_ros.graph import urdf
from maya_ros.graph.bus import Bus
from maya_ros.graph.halts import Halts
from maya_ros.graph.servers.tasks import Clock
from maya_ros.graph.table import CLOCK
from maya_ros.ros1.rights import graph_guest
from maya_ros.ros2 import needed
from maya_ros.ros2.robot import RobotInterface
from maya_ros.rosbridge import standalone
from maya_ros.rosbridge.standalone import configured, timer_of
from maya_un.assembly.stack import Stack
from maya_un.edges import EndpointOptions, Ros2Options
from maya_un.http import dates
from maya_un.http.bridge import Bridge

__all__ = ["configured", "endpoint"]


@asynccontextmanager
async def endpoint(stack: Stack, bridge: Bridge, place: EndpointOptions, *, speed: float = 1.0) -> AsyncIterator[None]:
    """Serve `stack` over rosbridge, over ROS 2 or both while the block runs; see `maya_un.edges.Edge`.

    Raises `Ros2Missing` if ROS 2 is asked for and DDS is not installed.
    """
    async with AsyncExitStack() as held:
        scaled = place.ros2 is not None and speed != 1.0
        now = await held.enter_async_context(scaled_clock(bridge, speed)) if scaled else dates.epoch
        bus = await held.enter_async_context(standalone.graph_of(stack, bridge, place.steps, speed=speed, now=now))
        if place.listener is not None:
            rosbridge = standalone.served(bus, bridge, place.listener, place.edge, now)
            await held.enter_async_context(rosbridge)
        if place.ros2 is not None:
            await held.enter_async_context(in_ros2(bus, bridge, place.ros2, stack, scaled=scaled))
        yield


@asynccontextmanager
async def in_ros2(
    bus: Bus, bridge: Bridge, options: Ros2Options, stack: Stack, *, scaled: bool = False
) -> AsyncIterator[None]:
    """Offer a graph to ROS 2 while the block runs. Raises `Ros2Missing` if DDS or xacro is not installed.

    `scaled` is whether the clock of the stack is not real time.
    """
    with needed():
        # an extra, and 10 MB that rosbridge does not need
        from maya_ros.ros2.edge import NODE, dds_serving  # noqa: PLC0415

        description = await asyncio.to_thread(urdf.describe, stack.config)
    async with _counted(bridge, stack) as halts, graph_guest(bridge, NODE) as guest:
        robot = RobotInterface(description, timer_of(stack), lambda: stack.controller.state.joints, halts, scaled)
        node = bus.node(NODE, lambda: guest.caller)
        try:
            async with dds_serving(node, guest, options, bus.now, robot):
                yield
        finally:
            node.close()


@asynccontextmanager
async def _counted(bridge: Bridge, stack: Stack) -> AsyncIterator[Halts]:
    """Yield the count of stops and faults; its listener is added and removed in the loop of the stack."""
    counting = ExitStack()

    async def begin() -> Halts:
        return counting.enter_context(Halts.of(stack.controller))

    async def end() -> None:
        counting.close()

    halts = await bridge.within(begin)
    try:
        yield halts
    finally:
        await bridge.within(end)


@asynccontextmanager
async def scaled_clock(bridge: Bridge, speed: float) -> AsyncIterator[Clock]:
    """Yield the robot's time as a date, while its clock runs `speed` times as fast as real time [s since the epoch].

    It begins with the present date. The robot's loop, which alone may read its clock, notes it 100 times a second.
    """
    began = now = dates.epoch()

    async def note() -> None:
        nonlocal now
        loop = asyncio.get_running_loop()
        start = loop.time()
        while True:
            now = began + loop.time() - start
            await asyncio.sleep(speed / CLOCK.rate)

    noting = asyncio.create_task(bridge.within(note), name="clock of the graph")
    try:
        yield lambda: now
    finally:
        noting.cancel()
        await asyncio.gather(noting, return_exceptions=True)
