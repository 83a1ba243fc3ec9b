"""The way of states, events and the queue from a service to its readers, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest

from maya_un.errors import Busy, LeaseHeld, LeaseLost, NotAllowed
from maya_un.events import JobAdvanced, QueueChanged, StepAdvanced
from maya_un.http.stream.hub import HEARTBEAT, Batch, EventRing, StreamHub, StreamReader, StreamSource
from maya_un.http.stream.topics import CAN, MOTION, PERIOD, QUEUE, TABLE, Audience
from maya_un.service.access.operations import LOCAL, Caller, Role
from tests.streaming import Watched
from tests.unit.http.frames import messages
from tests.virtual_time import elapse


async def soon() -> None:
    """Let everything be done that waits for nothing."""
    await elapse(1e-6)


class Ear:
    """Receives a reader's frames; it can stop taking them."""

    def __init__(self) -> None:
        self.on_room: Callable[[], None] | None = None
        self.full = False
        self.writes: list[bytes] = []

    def write(self, frames: bytes) -> None:
        assert not self.full, "more was written than is taken"
        self.writes.append(frames)

    def take_again(self) -> None:
        """Take frames again after a time of taking none."""
        self.full = False
        assert self.on_room is not None
        self.on_room()

    @property
    def heard(self) -> list[dict[str, Any]]:
        """All messages."""
        return messages(b"".join(self.writes))

    @property
    def numbers(self) -> list[int]:
        """Numbers of the events."""
        return [message["event"]["seq"] for message in self.heard if message["type"] == "event"]

    @property
    def counts(self) -> list[int]:
        """The count in the states."""
        return [message["state"]["counts"][0] for message in self.heard if message["type"] == "state"]

    @property
    def modes(self) -> list[str]:
        """Modes of the queue."""
        return [message["queue"]["mode"] for message in self.heard if message["type"] == "queue"]


class Scene:
    """A service, its tap and the hub, in one loop; notes the readers that fell too far behind."""

    def __init__(self, watched: Watched, hub: StreamHub, tap: StreamSource, batches: list[Batch]) -> None:
        self.watched = watched
        self.hub = hub
        self.tap = tap
        self.batches = batches
        self.lost: list[Ear] = []

    def reader(self) -> tuple[Ear, StreamReader]:
        """Return a new reader."""
        ear = Ear()
        return ear, StreamReader(ear, self.hub.ring, lambda: self.lost.append(ear))

    def following(self, since: int | None = None) -> tuple[Ear, StreamReader]:
        """Return a new reader of the events above `since`."""
        ear, reader = self.reader()
        reader.seen = self.hub.ring.last if since is None else since
        self.hub.send_events(reader)
        return ear, reader


@asynccontextmanager
async def scene(*, speed: float = 1.0, most: int = 1000, before: int = 0) -> AsyncIterator[Scene]:
    """Let a tap look at a service with so many events before, for readers at most `most` events behind."""
    watched = Watched(speed=speed)
    watched.happen(before)
    hub, batches, loop = StreamHub(watched.run, EventRing(before, most)), list[Batch](), asyncio.get_running_loop()

    def hand_over(batch: Batch) -> None:
        batches.append(batch)
        loop.call_soon(hub.take, batch)

    tap = StreamSource(watched.service, hand_over, speed)
    hub.open(tap)
    task = loop.create_task(tap.run(before))
    try:
        await elapse(0.001)
        yield Scene(watched, hub, tap, batches)
    finally:
        hub.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_current_state_is_sent_at_once_and_new_ones_when_published() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show_states(reader, 10.0)
        assert ear.counts == [0]
        await elapse(5.0)
        here.watched.count()
        await soon()
        assert ear.counts == [0, 1]


async def test_states_are_throttled_and_the_last_one_is_always_sent() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show_states(reader, 5.0)
        for _ in range(1000):
            here.watched.count()
            await elapse(0.01)
        assert 50 <= len(ear.counts) <= 57  # 10 s at 5 Hz, a tenth oftener at most
        assert ear.counts == sorted(set(ear.counts))
        await elapse(1.0)
        assert ear.counts[-1] == 1000


async def test_states_at_the_requested_rate_are_sent_unthrottled() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show_states(reader, 20.0)
        for early in (0.0, 0.002, -0.002, 0.001, 0.0, -0.003, 0.003) * 20:
            await elapse(0.05 + early)
            shown = here.watched.count()
            await soon()
            assert ear.counts[-1] == shown


async def test_unchanged_state_is_sent_as_a_slow_heartbeat_only() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show_states(reader, 50.0)
        before = len(here.batches)
        for _ in range(250):
            await elapse(0.1)
            here.watched.show()
        assert ear.counts == [0] * 3  # at once, and after 10 and 20 s
        assert len(here.batches) == before, "the loops were bothered with nothing new"
        assert ear.heard[1]["state"]["time"] == pytest.approx(HEARTBEAT, abs=0.2)


async def test_state_that_changes_back_is_sent_in_its_final_form() -> None:
    async with scene() as here:
        slow_ear, slow = here.reader()
        fast_ear, fast = here.reader()
        here.hub.show_states(slow, 0.5)
        here.hub.show_states(fast, 100.0)
        for number in (1, 0, 1, 2, 1, 0) * 30:
            await elapse(0.37)
            here.watched.show(counts=(number, 0, 0))
        await elapse(3.0)
        assert (slow_ear.counts[-1], fast_ear.counts[-1]) == (0, 0)


async def test_readers_at_one_rate_get_the_very_same_bytes() -> None:
    async with scene() as here:
        ears: list[Ear] = []
        for _ in range(3):
            ear, reader = here.reader()
            ears.append(ear)
            here.hub.show_states(reader, 30.0)
            here.hub.send_events(reader)
            reader.seen = 0
        await elapse(1.0)
        here.watched.count()
        here.watched.happen(3)
        await soon()
        for number in range(-2, 0):
            assert len({id(ear.writes[number]) for ear in ears}) == 1
        assert len(here.batches[-1].events) == 3


async def test_a_rate_can_be_changed_and_states_ended() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show_states(reader, 1.0)
        here.hub.show_states(reader, 10.0)
        await elapse(1.0)
        here.watched.count()
        await elapse(0.11)
        here.watched.count()
        await soon()
        assert ear.counts == [0, 0, 1, 2]
        here.hub.show_states(reader, None)
        here.watched.count()
        await elapse(60.0)
        assert ear.counts == [0, 0, 1, 2]


async def test_a_reader_that_is_behind_gets_the_newest_state_and_all_events() -> None:
    async with scene() as here:
        ear, reader = here.following()
        here.hub.show_states(reader, 100.0)
        ear.full = True
        for _ in range(50):
            here.watched.count()
            here.watched.happen()
            await elapse(0.1)
        assert (ear.counts, ear.numbers) == ([0], [])
        ear.take_again()
        assert (ear.counts, ear.numbers) == ([0, 50], list(range(1, 51)))


async def test_one_that_takes_little_at_a_time_loses_no_event() -> None:
    async with scene() as here:
        ear, _ = here.following()

        def write(frames: bytes) -> None:
            ear.writes.append(frames)
            ear.full = True

        ear.write = write
        for _ in range(40):
            here.watched.happen(70, text="x" * 300)  # more than one write holds
            await elapse(0.01)
            ear.take_again()
        while ear.numbers[-1] < 2800:
            ear.take_again()
        assert ear.numbers == list(range(1, 2801))


async def test_reader_too_far_behind_is_dropped_alone() -> None:
    async with scene(most=10) as here:
        slow, _ = here.following()
        well, _ = here.following()
        slow.full = True
        here.watched.happen(10)
        await soon()
        assert here.lost == []
        here.watched.happen()
        await soon()
        assert here.lost == [slow]
        here.watched.happen(5)
        await soon()
        assert (here.lost, slow.numbers) == ([slow], [])
        assert well.numbers == list(range(1, 17))


async def test_events_continue_after_the_last_seen_one() -> None:
    async with scene(before=7) as here:
        here.watched.happen(5)
        await soon()
        ear, _ = here.following(since=9)
        here.watched.happen()
        await soon()
        assert ear.numbers == [10, 11, 12, 13]


async def test_known_event_is_not_sent_again() -> None:
    async with scene() as here:
        ear, _ = here.following(since=2)  # published by another way, faster than by the tap
        here.watched.happen(3)
        await soon()
        assert ear.numbers == [3]


async def test_events_of_one_turn_are_sent_together() -> None:
    async with scene() as here:
        ear, _ = here.following()
        before = len(here.batches)
        here.watched.happen(500)
        here.watched.count()
        await soon()
        assert len(here.batches) == before + 1
        assert ear.numbers == list(range(1, 501))


async def test_the_queue_is_shown_now_and_when_it_changes_but_not_oftener_than_it_should() -> None:
    async with scene(speed=50.0) as here:
        ear, reader = here.reader()
        here.hub.show(reader, QUEUE, wanted=True)
        await elapse(PERIOD * 50.0)
        assert ear.modes == ["running"]
        for number in range(100):
            here.watched.shown = {"mode": f"{number}"}
            here.watched.happen(event=StepAdvanced(1, 1, "home", "done"))
            await elapse(0.5)
        assert here.watched.views <= 12  # 50 s of a clock that runs 50 times as fast
        await elapse(PERIOD * 50.0)
        assert ear.modes[-1] == "99"


async def test_queue_is_read_only_for_subscribers() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.watched.happen(event=JobAdvanced(1, "sort", "done", "ana"))
        await elapse(1.0)
        assert here.watched.views == 0
        here.hub.show(reader, QUEUE, wanted=True)
        await elapse(1.0)
        here.hub.show(reader, QUEUE, wanted=False)
        here.watched.shown = {"mode": "paused"}
        here.watched.happen(event=JobAdvanced(1, "sort", "done", "ana"))
        await elapse(1.0)
        assert (here.watched.views, ear.modes) == (1, ["running"])
        here.hub.show(reader, QUEUE, wanted=True)
        await elapse(1.0)
        assert ear.modes == ["running", "paused"]


async def test_a_queue_that_looks_the_same_is_not_shown_again() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show(reader, QUEUE, wanted=True)
        for _ in range(5):
            await elapse(1.0)
            here.watched.happen(event=QueueChanged("paused", "stop", "ana"))
        await elapse(1.0)
        assert (here.watched.views, ear.modes) == (6, ["running"])


async def test_prediction_without_an_event_is_sent_soon() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show(reader, QUEUE, wanted=True)
        await elapse(1.0)
        here.watched.shown = {"mode": "predicted"}
        await elapse(2.5)
        assert ear.modes == ["running", "predicted"]


async def test_late_subscriber_gets_the_queue_at_once() -> None:
    async with scene() as here:
        _, first = here.reader()
        here.hub.show(first, QUEUE, wanted=True)
        await elapse(1.0)
        ear, second = here.reader()
        here.hub.show(second, QUEUE, wanted=True)
        assert (ear.modes, here.watched.views) == (["running"], 1)


async def test_one_that_left_gets_nothing_any_more() -> None:
    async with scene() as here:
        ear, reader = here.following()
        here.hub.show_states(reader, 10.0)
        here.hub.show(reader, QUEUE, wanted=True)
        await elapse(1.0)
        before = len(ear.writes)
        here.hub.leave(reader)
        here.watched.count()
        here.watched.happen(3, event=QueueChanged("paused", "stop", "ana"))
        await elapse(60.0)
        assert len(ear.writes) == before


async def test_motion_is_shown_when_another_move_is_under_way() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show(reader, MOTION, wanted=True)
        await elapse(1.0)
        nothing = {"type": "motion", "motion": {"began": None, "path": [], "next": None}}
        assert ear.heard == [nothing]
        here.watched.count()
        await elapse(1.0)
        assert here.watched.looks == 1
        here.watched.move = object()
        here.watched.count()
        await elapse(1.0)
        assert here.watched.looks == 2
        assert ear.heard == [nothing]  # the same is not sent again


async def test_table_is_shown_when_the_gripper_changes_without_an_event() -> None:
    async with scene() as here:
        ear, reader = here.reader()
        here.hub.show(reader, TABLE, wanted=True)
        for closed in (False, False, True, True, False):
            here.watched.show(gripper_closed=closed)
            await elapse(0.3)
        assert [message["table"]["holding"] for message in ear.heard] == [False, True, False]
        assert ear.heard[0]["table"] == {"source": "believed", "parts": {}, "carried": None, "holding": False}


VIC, ANA = Caller("vic", Role.VIEWER), Caller("ana", Role.OPERATOR)


def asking(here: Scene, caller: Caller, language: str = "en") -> tuple[Ear, StreamReader]:
    """Return a new reader of what a caller may do."""
    ear, reader = here.reader()
    here.hub.address(reader, Audience(caller, language))
    here.hub.show(reader, CAN, wanted=True)
    return ear, reader


def codes(ear: Ear, action: str) -> list[int]:
    """Return the codes with which an action would be refused, 0 if it is allowed."""
    actions = [message["can"]["actions"][action] for message in ear.heard]
    return [0 if refusal is None else refusal["code"] for refusal in actions]


async def test_every_caller_is_told_what_that_caller_may_do() -> None:
    async with scene() as here:
        operator, _ = asking(here, replace(ANA, implicit=True))
        viewer, _ = asking(here, VIC)
        here.watched.show(homed=True)
        await elapse(1.0)
        assert (codes(operator, "jog"), codes(viewer, "jog")) == ([0], [NotAllowed.code])
        here.watched.running = 7
        here.watched.count()
        await elapse(1.0)
        assert codes(operator, "jog") == [0, Busy.code]
        assert operator.heard[-1]["can"]["actions"]["jog"]["message"] == str(Busy(doing="job 7"))
        assert len(viewer.heard) == 1, "the same was sent again"


async def test_rights_are_computed_once_for_each_caller_and_change_of_the_facts() -> None:
    async with scene() as here:
        for caller in (VIC, VIC, replace(ANA)):
            asking(here, caller)
        asking(here, VIC, "es")
        await elapse(1.0)
        here.watched.forecasts.clear()
        for _ in range(600):
            here.watched.count()
            await elapse(0.1)
        assert here.watched.forecasts == []
        here.watched.show(homed=True)
        await elapse(1.0)
        assert sorted(here.watched.forecasts) == ["ana", "vic"]


async def test_reason_is_in_the_language_of_the_reader() -> None:
    async with scene() as here:
        ears = [asking(here, VIC, language)[0] for language in ("en", "es")]
        await elapse(1.0)
        english, spanish = (ear.heard[0]["can"]["actions"]["jog"]["message"] for ear in ears)
        assert "viewer" in english
        assert english != spanish


async def test_reader_whose_rights_change_gets_the_new_ones() -> None:
    async with scene() as here:
        ear, reader = asking(here, VIC)
        here.watched.show(homed=True)
        await elapse(1.0)
        lease = here.watched.access.lease.take("ana", "lab").id
        await elapse(1.0)
        here.hub.address(reader, Audience(replace(ANA, lease=lease), "en"))
        await elapse(1.0)
        assert codes(ear, "jog") == [NotAllowed.code, 0]
        here.watched.access.lease.release(lease, "ana")
        await elapse(1.0)
        assert codes(ear, "jog") == [NotAllowed.code, 0, LeaseLost.code]
        here.hub.leave(reader)
        here.watched.forecasts.clear()
        here.watched.show(homed=False)
        await elapse(1.0)
        assert here.watched.forecasts == []


async def test_time_that_passes_is_no_change_of_rights() -> None:
    async with scene() as here:
        here.watched.access.lease.take("ben", "lab", patience=1000.0)
        ear, _ = asking(here, ANA)
        for _ in range(60):
            await elapse(1.0)
            here.watched.count()
        assert codes(ear, "jog") == [LeaseHeld.code]


async def test_a_tap_of_a_service_that_fails_ends_with_its_error() -> None:
    class Invisible(Watched):
        def view(self) -> dict[str, Any]:
            raise AssertionError("the queue cannot be seen")

    tap = StreamSource(Invisible().service, lambda _: None)
    tap.topics[QUEUE].wanted = frozenset({LOCAL})
    with pytest.raises(ExceptionGroup) as failed:
        await tap.run(0)
    assert "cannot be seen" in str(failed.value.exceptions[0])
