"""Only one command at a time, and its feedback."""

from __future__ import annotations

import asyncio

import pytest

from maya_ros.graph.protocol import GoalRefused, Message
from maya_ros.graph.servers.tasks import FEEDBACK_RATE, ActionProgress, ActionSlot
from maya_un.errors import Busy, EndNotReached, NotHomed, Stopped
from maya_un.events import EventLog, GripperOpened, HomingBegun, MotionBegun, PhaseBegun
from tests.virtual_time import elapse


def course(told: list[Message], *, ticks: bool = False, speed: float = 1.0) -> ActionProgress:
    return ActionProgress(told.append, lambda phase: {"phase": phase}, ticks=ticks, speed=speed)


async def test_phases_are_published_as_they_begin_and_not_after_the_end() -> None:
    told = list[Message]()
    events = EventLog(asyncio.get_running_loop().time)
    going = course(told)
    with events.listening(going.hear):
        events.emit(GripperOpened())
        assert not going.begun
        events.emit(HomingBegun())
        events.emit(PhaseBegun(name="seek b"))
        going.close()
        events.emit(MotionBegun())
    going.enter("late")
    await elapse(5.0)
    assert told == [{"phase": "homing"}, {"phase": "seek b"}]


@pytest.mark.parametrize("speed", [1.0, 20.0])
async def test_feedback_is_published_ten_times_a_second_to_subscribers(speed: float) -> None:
    told = list[Message]()
    going = course(told, ticks=True, speed=speed)
    going.enter("one")
    await elapse(0.95 * speed)
    going.enter("two")
    await elapse(0.95 * speed)
    going.close()
    assert len(told) == pytest.approx(2 * FEEDBACK_RATE, abs=1)
    assert {message["phase"] for message in told} == {"one", "two"}


async def test_one_at_a_time() -> None:
    slot, never = ActionSlot(), asyncio.Event()

    async def work() -> None:
        await never.wait()

    first = asyncio.ensure_future(slot.do("first", work, course([])))
    await elapse(0.0)
    assert slot.doing == "first"
    with pytest.raises(Busy, match="first"):
        await slot.do("second", work, course([]))
    assert slot.doing == "first"
    never.set()
    await first
    await slot.free()
    assert slot.doing == ""


@pytest.mark.parametrize(
    ("error", "begun", "raised"),
    [
        (NotHomed(command="maya home"), False, GoalRefused),
        (NotHomed(command="maya home"), True, NotHomed),
        (Stopped(), False, Stopped),
        (EndNotReached(axis="a", distance="1 count"), False, EndNotReached),
    ],
)
async def test_error_before_the_start_is_a_refusal(error: Exception, begun: bool, raised: type[Exception]) -> None:
    slot, going = ActionSlot(), course([])

    async def work() -> None:
        if begun:
            going.enter("x")
        raise error

    with pytest.raises(raised):
        await slot.act("work", work, going)
    await slot.free()
