"""The ring keeps the newest, all of it, and never more than it may."""

from __future__ import annotations

import asyncio
import tracemalloc

import hypothesis.strategies as st
from hypothesis import given

from dmc41x3.wire.transcript import WirePiece
from maya_un.events import Event, MotionEnded
from maya_un.recorder.capture import EVENT_COST, STATE_COST, WIRE_COST, RecorderRing, WireDirection
from maya_un.values import Joints, Mode, Point, State
from tests.virtual_time import elapse

MOST = 20_000
SENT = WireDirection(1, "client")

steps = st.lists(
    st.tuples(
        st.sampled_from(("wire", "state", "event")), st.integers(0, 3_000), st.sampled_from((0.0, 0.01, 1.0, 7.0))
    ),
    max_size=120,
)


def state(time: float) -> State:
    no = (False, False, False)
    return State(
        time=time,
        mode=Mode.IDLE,
        homed=True,
        counts=(1, 2, 3),
        joints=Joints(0.1, 0.2, 0.3),
        point=Point(0.1, 0.2, 0.3),
        velocity=(0.1, 0.2, 0.3),
        moving=False,
        motors_on=no,
        forward_limit=no,
        reverse_limit=no,
        stop_code=(1, 1, 1),
        gripper_closed=False,
        progress=None,
        fault=None,
    )


@given(steps)
async def test_ring_keeps_the_newest_within_its_bounds(steps: list[tuple[str, int, float]]) -> None:
    ring = RecorderRing(30.0, MOST)
    came: list[tuple[float, object, int]] = []
    for number, (kind, length, pause) in enumerate(steps):
        await elapse(pause)
        now = asyncio.get_running_loop().time()
        if kind == "wire":
            data = bytes([number % 251]) * length
            ring.piece(SENT, data)
            came.append((now, WirePiece(now, 1, "client", data), length + WIRE_COST))
        elif kind == "state":
            ring.state(state(now))
            came.append((now, state(now), STATE_COST))
        else:
            event = MotionEnded(seq=number + 1, time=now)
            ring.event(event)
            came.append((now, event, EVENT_COST))
        assert ring.size <= MOST
    contents, kept = ring.contents(), came[len(came) - len(ring) :]
    things = [thing for _, thing, _ in kept]
    assert contents.wire == tuple(thing for thing in things if isinstance(thing, WirePiece))
    assert contents.states == tuple(thing for thing in things if isinstance(thing, State))
    assert contents.events == tuple(thing for thing in things if isinstance(thing, Event))
    assert ring.size == sum(cost for _, _, cost in kept)
    assert contents.dropped is (len(kept) < len(came))
    if contents.dropped:
        with_one_more = came[len(came) - len(ring) - 1 :]
        too_old = came[-1][0] - with_one_more[0][0] > 30.0
        largest = max(cost for _, _, cost in came)
        too_much = sum(cost for _, _, cost in with_one_more) > MOST - MOST // 64 - largest
        assert too_old or too_much, "it let go of something that there was room for"


async def test_expired_data_is_removed_with_the_next_write() -> None:
    ring = RecorderRing(10.0, 1_000_000)
    for second in range(30):
        ring.piece(SENT, b"TP\r")
        ring.state(state(float(second)))
        await elapse(1.0)
    times = [float(second) for second in range(19, 30)]
    assert [piece.time for piece in ring.contents().wire] == times
    assert [state.time for state in ring.contents().states] == times
    assert ring.contents().dropped
    assert ring.contents().whole == 19.0


async def test_ring_that_dropped_nothing_is_complete() -> None:
    await elapse(5.0)
    ring = RecorderRing(10.0, 1_000_000)
    await elapse(2.0)
    ring.piece(WireDirection(1, "client", "open"))
    contents = ring.contents()
    assert not contents.dropped
    assert contents.whole == 5.0
    assert contents.wire == (WirePiece(7.0, 1, "client", b"", "open"),)


async def test_entries_taken_before_can_be_sorted_out_later() -> None:
    ring = RecorderRing(10.0, 1_000_000)
    ring.piece(SENT, b"TP\r")
    entries = ring.entries()
    ring.state(state(0.0))
    assert ring.contents(entries).states == ()
    assert ring.contents().states == (state(0.0),)


async def test_memory_stays_below_its_count() -> None:
    """Real records and answers, kept by reference: Python's memory for them stays below the counted size."""
    most = 4 << 20
    ring = RecorderRing(1e9, most)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        for number in range(60_000):
            ring.piece(WireDirection(1, "controller"), bytes((number + place) & 0xFF for place in range(29)))
            if number % 4 == 0:
                ring.state(_fresh(float(number)))
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert ring.contents().dropped
    assert 0.4 * most < after - before <= most


def _fresh(time: float) -> State:
    """Return a state that shares no parts with others, as the controller makes them."""
    one = time + 1e6
    return State(
        time=one,
        mode=Mode.MOVING,
        homed=True,
        counts=(int(one), int(one) + 1, int(one) + 2),
        joints=Joints(one + 0.1, one + 0.2, one + 0.3),
        point=Point(one + 0.4, one + 0.5, one + 0.6),
        velocity=(one + 0.7, one + 0.8, one + 0.9),
        moving=True,
        motors_on=(one > 0.0, one > 1.0, one > 2.0),
        forward_limit=(one < 0.0, one < 1.0, one < 2.0),
        reverse_limit=(one < 0.0, one < 1.0, one < 2.0),
        stop_code=(int(one) % 2, 1, 1),
        gripper_closed=False,
        progress=None,
        fault=None,
    )
