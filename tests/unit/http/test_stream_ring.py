"""The newest events, kept once for all readers."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from maya_un.http.stream.hub import EventRing


def filled(last: int, count: int, *, most: int = 1000, most_bytes: int = 10_000) -> EventRing:
    """Return a ring behind event `last` to which so many frames `<number>` were added."""
    ring = EventRing(last, most, most_bytes)
    for number in range(last + 1, last + 1 + count):
        ring.add(b"<%d>" % number)
    return ring


def test_an_empty_ring_begins_behind_the_last_event() -> None:
    ring = EventRing(41)
    assert (ring.first, ring.last) == (42, 41)
    assert ring.reaches(41)
    assert not ring.reaches(40)
    assert ring.after(41, 100) == (41, b"")


def test_events_are_in_order_after_any_available_number() -> None:
    ring = filled(10, 3)
    assert ring.after(10, 1000) == (13, b"<11><12><13>")
    assert ring.after(12, 1000) == (13, b"<13>")


def test_one_read_is_bounded_and_the_next_goes_on_there() -> None:
    ring = filled(0, 5)
    assert ring.after(0, 4) == (2, b"<1><2>")
    assert ring.after(2, 4) == (4, b"<3><4>")
    assert ring.after(4, 4) == (5, b"<5>")


def test_readers_that_are_equally_far_get_the_very_same_bytes() -> None:
    ring = filled(0, 5)
    assert ring.after(1, 1000)[1] is ring.after(1, 1000)[1]


def test_later_event_is_not_hidden_by_an_earlier_read() -> None:
    ring = filled(0, 1)
    assert ring.after(0, 1000) == (1, b"<1>")
    ring.add(b"<2>")
    assert ring.after(0, 1000) == (2, b"<1><2>")


def test_oldest_events_are_dropped_beyond_the_count() -> None:
    ring = filled(0, 5, most=3)
    assert (ring.first, ring.last) == (3, 5)
    assert ring.reaches(2)
    assert not ring.reaches(1)
    assert ring.after(2, 1000) == (5, b"<3><4><5>")


def test_oldest_events_are_dropped_beyond_the_size() -> None:
    ring = filled(0, 5, most_bytes=7)
    assert ring.after(ring.first - 1, 1000) == (5, b"<4><5>")


@given(
    steps=st.lists(st.one_of(st.integers(1, 4), st.just(0)), max_size=60),
    most=st.integers(1, 8),
    chunk=st.integers(1, 20),
)
def test_reader_gets_every_event_once_in_order_or_learns_it_is_late(steps: list[int], most: int, chunk: int) -> None:
    ring, seen, got, added = EventRing(0, most), 0, b"", 0
    for step in steps:
        for _ in range(step):
            added += 1
            ring.add(b"<%d>" % added)
        if not ring.reaches(seen):
            assert added - seen > most
            return
        if step == 0:
            seen, frames = ring.after(seen, chunk)
            got += frames
    assert got == b"".join(b"<%d>" % number for number in range(1, seen + 1))
