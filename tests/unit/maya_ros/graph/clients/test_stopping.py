"""A sequence of commands ends at a stop between two of them."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.outcome import cancel_on_stop
from maya_un.errors import FollowingError, Stopped
from maya_un.events import EventLog, MotionStopped
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
