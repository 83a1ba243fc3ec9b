"""A client of the controller layer counts stops, and a stop ends a sequence of commands."""

from __future__ import annotations

import asyncio
from contextlib import suppress

import pytest

from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import cancel_on_stop
from maya_un.errors import Busy, FollowingError, Stopped
from maya_un.events import EventLog, MotionStopped
from maya_un.service.direct import HeldJogs
from tests.graphs import controller_node, seen_from
from tests.unit.controller.bench import FAR
from tests.virtual_time import elapse


def log() -> EventLog:
    return EventLog(asyncio.get_running_loop().time)


async def work(ends: list[str], error: Exception | None = None) -> None:
    try:
        await elapse(10.0)
    except asyncio.CancelledError:
        await elapse(2.0)
        ends.append("at rest")
        raise
    if error is not None:
        raise error
    ends.append("done")


async def test_without_a_stop_every_command_runs() -> None:
    ends: list[str] = []
    await cancel_on_stop(log(), work(ends))
    assert ends == ["done"]


async def test_a_stop_ends_it_at_rest() -> None:
    events, ends = log(), list[str]()
    request = asyncio.ensure_future(cancel_on_stop(events, work(ends)))
    await elapse(1.0)
    events.emit(MotionStopped())
    events.emit(MotionStopped())
    await asyncio.wait({request})
    assert isinstance(request.exception(), Stopped)
    assert ends == ["at rest"]


async def test_cancel_before_a_stop_is_a_cancel() -> None:
    events, ends = log(), list[str]()
    request = asyncio.ensure_future(cancel_on_stop(events, work(ends)))
    await elapse(1.0)
    request.cancel()
    await elapse(1.0)
    events.emit(MotionStopped())
    await asyncio.wait({request})
    assert request.cancelled()
    assert ends == ["at rest"]


async def test_its_own_errors_are_raised() -> None:
    with pytest.raises(FollowingError):
        await cancel_on_stop(log(), work([], FollowingError(axis="b")))


async def test_earlier_stop_does_not_matter() -> None:
    events, ends = log(), list[str]()
    events.emit(MotionStopped())
    await cancel_on_stop(events, work(ends))
    assert ends == ["done"]


async def test_client_counts_stops_but_not_the_end_of_what_it_cancels() -> None:
    bus = Bus()
    async with controller_node(bus, homed=True), seen_from(bus, "client") as (_, controller):
        counted: list[int] = []
        for end in ("cancel", "stop"):
            motion = asyncio.ensure_future(controller.move(FAR))
            await elapse(1.0)
            assert motion.cancel() if end == "cancel" else await controller.stop()
            await asyncio.wait({motion})
            assert end == "cancel" or isinstance(motion.exception(), Stopped)
            counted.append(controller.stops)
        assert counted[0] == 0 < counted[1]


@pytest.mark.parametrize("first", ["cancel", "stop"])
async def test_client_counts_a_stop_of_another_one_during_its_cancel(first: str) -> None:
    """They come in either order; the layer reports one end for both."""
    bus = Bus()
    async with (
        controller_node(bus, homed=True),
        seen_from(bus, "client") as (_, controller),
        seen_from(bus, "another") as (_, another),
    ):
        motion = asyncio.ensure_future(controller.move(FAR))
        await elapse(1.0)
        if first == "cancel":
            motion.cancel()
            await another.stop()
        else:
            await another.stop()
            motion.cancel()
        await asyncio.wait({motion})
        assert controller.stops > 0


async def test_refused_motion_does_not_make_a_later_cancel_a_stop() -> None:
    bus = Bus()
    async with controller_node(bus, homed=True), seen_from(bus, "client") as (_, controller):
        motion = asyncio.ensure_future(controller.move(FAR))
        await elapse(1.0)
        with pytest.raises(Busy):
            await controller.move(FAR)
        motion.cancel()
        await asyncio.wait({motion})
        assert controller.stops == 0


@pytest.mark.parametrize("stopped_by", ["itself", "another"])
async def test_stop_over_the_graph_ends_a_press_that_turns(stopped_by: str) -> None:
    bus = Bus()
    async with (
        controller_node(bus, homed=True) as node,
        seen_from(bus, "client") as (_, controller),
        seen_from(bus, "another") as (_, another),
    ):
        jogs = HeldJogs(controller)
        for _ in range(5):
            await jogs.hold("b", 1, 1.0, press="p")
            await elapse(0.2)
        turned = asyncio.ensure_future(jogs.hold("b", -1, 1.0, press="p"))
        await elapse(0.1)
        await (controller if stopped_by == "itself" else another).stop()
        await asyncio.wait({turned})
        for _ in range(15):
            await elapse(0.2)
            with suppress(Stopped):
                await jogs.hold("b", -1, 1.0, press="p")
        assert not node.rig.controller.state.moving
        await jogs.release("p")


async def test_held_jog_turns_over_the_graph() -> None:
    """It cancels its motion for another direction, which must not look like a stop."""
    bus = Bus()
    async with controller_node(bus, homed=True), seen_from(bus, "client") as (_, controller):
        jogs = HeldJogs(controller)
        for direction in (1, -1):
            for _ in range(10):
                await jogs.hold("b", direction, 1.0, press="p")
                await elapse(0.2)
            assert (await jogs.hold("b", direction, 1.0, press="p")).moving
        await jogs.release("p")
