"""Events: numbered without gaps, in one order for everybody, late and slow readers included."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import EventsForgotten
from maya_un.events import Event, EventLog, Kind
from tests.virtual_time import elapse


def log(clock: Callable[[], float] = lambda: 0.0) -> EventLog:
    return EventLog(clock)


async def take(count: int, events: AsyncIterator[Event]) -> list[int]:
    return [(await anext(events)).seq for _ in range(count)]


def test_numbers_start_at_one_and_have_no_gaps() -> None:
    events = log()
    assert [events.emit(Kind.MOVING).seq for _ in range(4)] == [1, 2, 3, 4]
    assert (len(events), events.last) == (4, events.since(3)[0])


def test_before_the_first_there_is_none() -> None:
    assert (log().last, log().since(0)) == (None, [])


async def test_an_event_has_the_time_of_the_loop() -> None:
    events = log(asyncio.get_running_loop().time)
    await elapse(12.5)
    assert events.emit(Kind.HOMED).time == 12.5


@given(seq=st.integers(-3, 12), count=st.integers(0, 8))
def test_since_gives_exactly_those_numbered_above(seq: int, count: int) -> None:
    events = log()
    for _ in range(count):
        events.emit(Kind.STEP)
    assert [event.seq for event in events.since(seq)] == [n for n in range(1, count + 1) if n > seq]


def test_the_oldest_are_forgotten_and_whoever_asks_for_them_is_told() -> None:
    events = EventLog(lambda: 0.0, kept=8)
    for _ in range(9):
        events.emit(Kind.STEP)
    assert (len(events), events.oldest, len(events.since(0))) == (9, 1, 9)
    events.emit(Kind.STEP)
    assert (len(events), events.oldest) == (10, 3)
    assert [event.seq for event in events.since(2)] == list(range(3, 11))
    with pytest.raises(EventsForgotten, match=r"above 1 .* oldest that is kept is 3"):
        events.since(1)
    assert events.last == events.since(9)[0]


def test_memory_is_bounded() -> None:
    events = EventLog(lambda: 0.0, kept=80)
    for number in range(1, 1001):
        events.emit(Kind.STEP)
        assert number - 90 <= events.oldest - 1 <= max(0, number - 80)


async def test_a_reader_that_falls_too_far_behind_is_told() -> None:
    events = EventLog(lambda: 0.0, kept=8)
    reader = events.follow()
    events.emit(Kind.MOVING)
    assert await take(1, reader) == [1]
    for _ in range(20):
        events.emit(Kind.PHASE)
    with pytest.raises(EventsForgotten):
        await anext(reader)


def test_who_hears_everything_hears_it_at_once() -> None:
    events, heard = log(), list[int]()
    events.heard_by(lambda event: heard.append(event.seq))
    events.emit(Kind.HOMING)
    assert heard == [1]


def test_what_happened_cannot_be_changed() -> None:
    detail = log().emit(Kind.FAULT, 1001, reason="cut").detail
    with pytest.raises(TypeError):
        detail["reason"] = "none"  # type: ignore[index]


def test_an_event_reads_as_its_kind_and_details() -> None:
    assert str(log().emit(Kind.LIMIT, 2301, axis="b", side="forward")) == "limit axis=b side=forward"
    assert str(log().emit(Kind.IDLE)) == "idle"


async def test_a_late_reader_gets_first_what_it_missed() -> None:
    events = log()
    events.emit(Kind.CONNECTED)
    events.emit(Kind.NOT_HOMED)
    reader = events.follow(seq=1)
    first = await anext(reader)
    events.emit(Kind.HOMING)
    assert (first.seq, await take(1, reader)) == (2, [3])
    await reader.aclose()


async def test_what_happens_before_the_first_read_is_not_lost() -> None:
    events = log()
    reader = events.follow()
    events.emit(Kind.CONNECTED)
    assert await take(1, reader) == [1]
    await reader.aclose()


async def test_a_slow_reader_loses_nothing_and_slows_nobody() -> None:
    events = log()
    slow, quick = events.follow(), events.follow()
    events.emit(Kind.MOVING)
    assert (await take(1, slow), await take(1, quick)) == ([1], [1])
    for _ in range(1000):
        events.emit(Kind.PHASE)
    assert await take(1000, quick) == list(range(2, 1002))
    await elapse(60.0)
    assert await take(1000, slow) == list(range(2, 1002))
    await slow.aclose()
    await quick.aclose()


async def test_a_waiting_reader_is_woken_by_the_next_event() -> None:
    events = log()
    reader = events.follow()
    waiting = asyncio.ensure_future(take(2, reader))
    await elapse(1.0)
    events.emit(Kind.MOVING)
    await elapse(1.0)
    assert not waiting.done()
    events.emit(Kind.IDLE)
    assert await waiting == [1, 2]
    await reader.aclose()


async def test_a_reader_that_left_gets_nothing_more() -> None:
    events = log()
    reader = events.follow()
    events.emit(Kind.MOVING)
    await take(1, reader)
    await reader.aclose()
    events.emit(Kind.IDLE)
    assert not events._waiting


def test_a_listener_hears_every_event_inside_its_block_at_once() -> None:
    events, heard = log(), list[int]()
    events.emit(Kind.CONNECTED)
    with events.listening(lambda event: heard.append(event.seq)):
        events.emit(Kind.HOMING)
        assert heard == [2]
    events.emit(Kind.HOMED)
    assert heard == [2]


def test_a_listener_is_gone_after_a_failure_in_its_block() -> None:
    events, heard = log(), list[int]()
    with pytest.raises(ValueError, match="later"), events.listening(lambda event: heard.append(event.seq)):
        raise ValueError("later")
    events.emit(Kind.IDLE)
    assert heard == []


async def test_readers_see_the_order_of_the_numbers_though_a_listener_emits() -> None:
    events = log()
    reader = events.follow()
    events.emit(Kind.CONNECTED)
    await take(1, reader)

    def answer(event: Event) -> None:
        if event.kind is Kind.LIMIT:
            events.emit(Kind.FAULT, 2301)

    with events.listening(answer):
        events.emit(Kind.LIMIT)
    assert await take(2, reader) == [2, 3]
    await reader.aclose()
