"""Events: numbered without gaps, in one order for everybody, late and slow readers included."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from dataclasses import MISSING, fields, replace
from string import Formatter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.i18n import LANGUAGES
from maya_un.errors import EventsForgotten
from maya_un.events import (
    DECLARED,
    Connected,
    Event,
    EventLog,
    FaultEntered,
    HomingBegun,
    HomingDone,
    HomingNeeded,
    LeaseChanged,
    LimitHit,
    MotionBegun,
    MotionEnded,
    PhaseBegun,
    StepAdvanced,
    UnknownEvent,
    event_of,
)
from tests.virtual_time import elapse


def log(clock: Callable[[], float] = lambda: 0.0) -> EventLog:
    return EventLog(clock)


async def take(count: int, events: AsyncIterator[Event]) -> list[int]:
    return [(await anext(events)).seq for _ in range(count)]


def test_numbers_start_at_one_and_have_no_gaps() -> None:
    events = log()
    assert [events.emit(MotionBegun()).seq for _ in range(4)] == [1, 2, 3, 4]
    assert (len(events), events.last) == (4, events.since(3)[0])


def test_before_the_first_event_there_is_none() -> None:
    assert (log().last, log().since(0)) == (None, [])


async def test_an_event_has_the_time_of_the_loop() -> None:
    events = log(asyncio.get_running_loop().time)
    await elapse(12.5)
    assert events.emit(HomingDone()).time == 12.5


@given(seq=st.integers(-3, 12), count=st.integers(0, 8))
def test_since_gives_exactly_those_numbered_above(seq: int, count: int) -> None:
    events = log()
    for _ in range(count):
        events.emit(StepAdvanced(1, 1, "home", "done"))
    assert [event.seq for event in events.since(seq)] == [n for n in range(1, count + 1) if n > seq]


def test_oldest_events_are_forgotten_and_their_reader_is_notified() -> None:
    events = EventLog(lambda: 0.0, kept=8)
    for _ in range(9):
        events.emit(StepAdvanced(1, 1, "home", "done"))
    assert (len(events), events.oldest, len(events.since(0))) == (9, 1, 9)
    events.emit(StepAdvanced(1, 1, "home", "done"))
    assert (len(events), events.oldest) == (10, 3)
    assert [event.seq for event in events.since(2)] == list(range(3, 11))
    with pytest.raises(EventsForgotten, match=r"after 1 .* oldest stored event is 3"):
        events.since(1)
    assert events.last == events.since(9)[0]


def test_memory_is_bounded() -> None:
    events = EventLog(lambda: 0.0, kept=80)
    for number in range(1, 1001):
        events.emit(StepAdvanced(1, 1, "home", "done"))
        assert number - 90 <= events.oldest - 1 <= max(0, number - 80)


async def test_reader_too_far_behind_is_notified() -> None:
    events = EventLog(lambda: 0.0, kept=8)
    reader = events.follow()
    events.emit(MotionBegun())
    assert await take(1, reader) == [1]
    for _ in range(20):
        events.emit(PhaseBegun("down"))
    with pytest.raises(EventsForgotten):
        await anext(reader)


def test_reader_of_all_events_gets_them_at_once() -> None:
    events, heard = log(), list[int]()
    events.heard_by(lambda event: heard.append(event.seq))
    events.emit(HomingBegun())
    assert heard == [1]


def test_past_event_cannot_be_changed() -> None:
    detail = log().emit(FaultEntered("cut", code=1001)).detail
    with pytest.raises(TypeError):
        detail["message"] = "none"  # type: ignore[index]


def test_an_event_reads_as_its_kind_and_details() -> None:
    assert str(log().emit(LimitHit("Hit.", code=2301, more={"axis": "b"}))) == "limit message=Hit. axis=b"
    assert str(log().emit(MotionEnded())) == "idle"


def test_detail_of_an_event_has_its_fields_in_order_without_missing_ones() -> None:
    step = StepAdvanced(7, 2, "pick cube", "running")
    assert json.dumps(dict(step.detail)) == '{"job": 7, "index": 2, "step": "pick cube", "state": "running"}'
    assert replace(step, attempt=2).detail["attempt"] == 2
    assert dict(LeaseChanged("offered", "", "", implicit=False, to="ana", by="ben").detail) == {
        "change": "offered", "holder": "", "source": "", "implicit": False, "to": "ana", "by": "ben",
    }  # fmt: skip


PLAIN = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()


@given(
    st.sampled_from(sorted(DECLARED)) | st.text(),
    st.dictionaries(st.sampled_from(["name", "state", "message", "seq", "code", "kind", "more"]) | st.text(), PLAIN),
)
def test_an_event_of_any_program_is_shown_with_its_kind_and_details(kind: str, detail: dict[str, object]) -> None:
    event = event_of(kind, detail, 2302, seq=3, time=1.5)
    declared = DECLARED.get(kind)
    own = set() if declared is None else {one.name for one in fields(declared)}
    said = {key: value for key, value in detail.items() if value is not None or key not in own}
    assert (event.seq, event.time, event.kind, event.code) == (3, 1.5, kind, 2302)
    assert {**detail, **event.detail} == detail
    assert said.items() <= event.detail.items() or isinstance(event, UnknownEvent)
    for language in ("en", "es"):
        assert event.report(language) or not kind.strip()
        assert event.narrated or event.narration(language) is None


def test_an_event_that_lacks_a_field_is_not_taken_for_a_declared_one() -> None:
    assert event_of("phase", {"primitive": "pick"}) == UnknownEvent("phase", more={"primitive": "pick"})
    assert event_of("phase", {"name": "down", "speed": 2}) == PhaseBegun("down", more={"speed": 2})


@pytest.mark.parametrize("event", DECLARED.values(), ids=DECLARED)
def test_every_declared_event_has_sentences_over_the_fields_that_it_always_has(event: type[Event]) -> None:
    always = {one.name for one in fields(event) if one.default is MISSING and one.default_factory is MISSING}
    sentences = [event.template(language) for language in LANGUAGES]
    named = [{name for _, name, _, _ in Formatter().parse(text) if name} for text in sentences]
    assert all(sentences)
    assert all(names == named[0] <= always for names in named)


async def test_late_reader_gets_missed_events_first() -> None:
    events = log()
    events.emit(Connected("sim"))
    events.emit(HomingNeeded())
    reader = events.follow(seq=1)
    first = await anext(reader)
    events.emit(HomingBegun())
    assert (first.seq, await take(1, reader)) == (2, [3])
    await reader.aclose()


async def test_events_before_the_first_read_are_not_lost() -> None:
    events = log()
    reader = events.follow()
    events.emit(Connected("sim"))
    assert await take(1, reader) == [1]
    await reader.aclose()


async def test_slow_reader_loses_nothing_and_slows_no_other() -> None:
    events = log()
    slow, quick = events.follow(), events.follow()
    events.emit(MotionBegun())
    assert (await take(1, slow), await take(1, quick)) == ([1], [1])
    for _ in range(1000):
        events.emit(PhaseBegun("down"))
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
    events.emit(MotionBegun())
    await elapse(1.0)
    assert not waiting.done()
    events.emit(MotionEnded())
    assert await waiting == [1, 2]
    await reader.aclose()


async def test_a_reader_that_left_gets_nothing_more() -> None:
    events = log()
    reader = events.follow()
    events.emit(MotionBegun())
    await take(1, reader)
    await reader.aclose()
    events.emit(MotionEnded())
    assert not events._waiting


def test_listener_gets_every_event_inside_its_block_at_once() -> None:
    events, heard = log(), list[int]()
    events.emit(Connected("sim"))
    with events.listening(lambda event: heard.append(event.seq)):
        events.emit(HomingBegun())
        assert heard == [2]
    events.emit(HomingDone())
    assert heard == [2]


def test_a_listener_is_gone_after_a_failure_in_its_block() -> None:
    events, heard = log(), list[int]()
    with pytest.raises(ValueError, match="later"), events.listening(lambda event: heard.append(event.seq)):
        raise ValueError("later")
    events.emit(MotionEnded())
    assert heard == []


async def test_readers_see_the_order_of_the_numbers_though_a_listener_emits() -> None:
    events = log()
    reader = events.follow()
    events.emit(Connected("sim"))
    await take(1, reader)

    def answer(event: Event) -> None:
        if isinstance(event, LimitHit):
            events.emit(FaultEntered(code=2301))

    with events.listening(answer):
        events.emit(LimitHit())
    assert await take(2, reader) == [2, 3]
    await reader.aclose()
