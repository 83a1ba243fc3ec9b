"""The control lease, case by case; tests/properties/test_lease.py has any order of all of them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded
from maya_un.events import EventLog
from maya_un.process.lease import LINGER, OFFER, ControlLease, LeaseUse
from maya_un.schema.people import PATIENCE
from tests.virtual_time import elapse, turn


@asynccontextmanager
async def leased(speed: float = 1.0) -> AsyncIterator[tuple[ControlLease, EventLog]]:
    events = EventLog(asyncio.get_running_loop().time)
    lease = ControlLease(events, speed)
    try:
        yield lease, events
    finally:
        lease.close()


def changes(events: EventLog) -> list[str]:
    """Return the end of the lease, with its next holder."""
    return [f"{event.detail['change']} {event.detail['holder']}".strip() for event in events.since(0)]


def held_by(lease: ControlLease) -> str:
    return "" if lease.holder is None else lease.holder.name


async def test_second_caller_learns_the_holder() -> None:
    async with leased() as (lease, events):
        ann = lease.take("ann", "10.0.0.1", note="calibrating")
        await elapse(7.0)
        with pytest.raises(LeaseHeld) as refusal:
            lease.take("bob", "10.0.0.2")
        assert refusal.value.details == {"holder": "ann", "since": "7 s"}
        lease.release(ann.id, "ann")
        assert lease.take("bob", "10.0.0.2").name == "bob"
        assert changes(events) == ["taken ann", "released", "taken bob"]


async def test_it_ends_when_it_is_not_renewed() -> None:
    async with leased() as (lease, events):
        ann = lease.take("ann", "")
        for _ in range(5):
            await elapse(PATIENCE - 0.5)
            lease.renew(ann.id, "ann")
        await elapse(PATIENCE - 0.01)
        assert held_by(lease) == "ann"
        assert lease.expires_in == pytest.approx(0.01)
        await elapse(0.02)
        assert held_by(lease) == ""
        assert changes(events) == ["taken ann", "expired"]
        with pytest.raises(LeaseLost) as refusal:
            lease.renew(ann.id, "ann")
        assert refusal.value.details == {"reason": "expired"}


async def test_grace_time_is_real_time_with_a_fast_clock() -> None:
    async with leased(speed=50.0) as (lease, _):
        lease.take("ann", "", patience=4.0)
        await elapse(4.0 * 50.0 - 1.0)
        assert lease.expires_in == pytest.approx(0.02)
        assert lease.held_for == pytest.approx(3.98)
        await elapse(2.0)
        assert held_by(lease) == ""


async def test_a_lease_is_good_for_its_holder_only() -> None:
    async with leased() as (lease, _):
        ann = lease.take("ann", "")
        with pytest.raises(LeaseHeld, match="ann"):
            lease.renew(ann.id, "bob")
        with pytest.raises(LeaseHeld, match="ann"):
            lease.release(ann.id, "bob")
        assert ann.id not in repr(ann)


@pytest.mark.parametrize("shown", ["x", "ñ", "\udcff", "0" * 10_000])
async def test_invalid_lease_is_lost(shown: str) -> None:
    async with leased() as (lease, _):
        with pytest.raises(LeaseLost):
            lease.require(shown, "ann")
        lease.take("bob", "")
        with pytest.raises(LeaseLost):
            lease.require(shown, "ann")


async def test_missing_lease_is_needed_or_held_by_another() -> None:
    async with leased() as (lease, _):
        with pytest.raises(LeaseNeeded):
            lease.require("", "ann")
        lease.take("bob", "")
        with pytest.raises(LeaseHeld):
            lease.require("", "ann")


async def test_an_offer_is_taken_from_the_holder_within_a_minute() -> None:
    async with leased() as (lease, events):
        ann = lease.take("ann", "", patience=1e3)
        lease.offer("sam", "ann")
        with pytest.raises(LeaseHeld):
            lease.take("bob", "")
        sam = lease.take("sam", "")
        assert (sam.lender, lease.offered_to) == ("ann", None)
        assert changes(events) == ["taken ann", "offered ann", "handed over sam"]
        with pytest.raises(LeaseLost) as refusal:
            lease.require(ann.id, "ann")
        assert refusal.value.details == {"reason": "handed over"}


async def test_an_offer_lapses() -> None:
    async with leased() as (lease, _):
        lease.take("ann", "", patience=1e3)
        lease.offer("sam", "ann")
        await elapse(OFFER + 0.1)
        assert lease.offered_to is None
        with pytest.raises(LeaseHeld):
            lease.take("sam", "")


async def test_offer_survives_the_departure_of_its_holder() -> None:
    async with leased() as (lease, _):
        ann = lease.take("ann", "")
        lease.offer("sam", "ann")
        lease.release(ann.id, "ann")
        assert lease.take("sam", "").lender == "ann"


async def test_force_takes_it_from_anyone_and_ends_his_motion() -> None:
    async with leased() as (lease, events):
        ann = lease.take("ann", "")
        by_lease, direct = lease.driving("ann", "", ann.id), lease.driving("ann", "", direct=True)
        with by_lease as command, direct as other, lease.driving("ann", "job 1") as job:
            lease.take("root", "", force=True)
            assert (command.lost, other.lost, job.lost) == ("broken", "broken", "")
        assert held_by(lease) == "root"
        assert changes(events) == ["taken ann", "broken root"]


async def test_lost_command_is_cancelled_once() -> None:
    async with leased() as (lease, _):
        ended: list[str] = []

        async def jog() -> None:
            try:
                await elapse(100.0)
            finally:
                await elapse(3.0)
                ended.append(f"{asyncio.get_running_loop().time():.0f}")

        ann = lease.take("ann", "")
        task = asyncio.ensure_future(jog())
        await turn()
        with lease.driving("ann", "", ann.id) as drive:
            drive.carry(task)
            await asyncio.wait({task})
            assert drive.lost == "expired"
        assert (task.cancelled(), ended) == (True, ["13"])


async def test_something_carried_after_the_loss_is_cancelled_too() -> None:
    task = asyncio.ensure_future(elapse(1.0))
    drive = LeaseUse("ann", lease="x")
    drive.lose("expired")
    drive.carry(task)
    await asyncio.wait({task})
    assert task.cancelled()


async def test_caller_without_a_lease_drives_for_one_command() -> None:
    async with leased() as (lease, events):
        with lease.driving("local", "local", direct=True):
            assert lease.holder is not None
            assert (lease.holder.implicit, lease.expires_in) == (True, None)
            with pytest.raises(LeaseHeld):
                lease.take("ann", "")
            with pytest.raises(LeaseHeld), lease.driving("ros", "ros", direct=True):
                pass
            assert not lease.may_begin("ros")
            assert lease.may_begin("local")
        assert lease.may_begin("ros")
        lease.take("ann", "")
        assert changes(events) == ["taken local", "taken ann"]


async def test_consecutive_commands_are_one_drive() -> None:
    async with leased() as (lease, events):
        for _ in range(20):
            with lease.driving("local", "local"):
                await elapse(0.1)
            await elapse(LINGER - 0.1)
        assert held_by(lease) == "local"
        await elapse(0.2)
        assert changes(events) == ["taken local", "released"]


async def test_commands_of_one_name_overlap_and_the_last_ends_the_drive() -> None:
    async with leased() as (lease, events):
        with lease.driving("local", "local"):
            with lease.driving("local", "local"):
                await elapse(1.0)
            await elapse(10.0)
            assert held_by(lease) == "local"
        await elapse(LINGER + 0.1)
        assert changes(events) == ["taken local", "released"]


async def test_job_keeps_its_owner_driving_when_the_lease_expires() -> None:
    async with leased() as (lease, events):
        ann = lease.take("ann", "")
        with lease.driving("ann", "job 1") as job:
            await elapse(PATIENCE + 0.1)
            assert held_by(lease) == "ann"
            assert not lease.may_begin("bob")
            with pytest.raises(LeaseLost):
                lease.require(ann.id, "ann")
            assert not job.lost
        assert changes(events) == ["taken ann", "expired", "taken ann"]
        assert lease.take("bob", "").name == "bob"


async def test_taking_the_lease_takes_over_the_job() -> None:
    async with leased() as (lease, events):
        with lease.driving("ann", "job 1") as job:
            with pytest.raises(LeaseNeeded):
                lease.require("", "bob")
            bob = lease.take("bob", "")
            assert not lease.may_begin("ann")
            with lease.driving("bob", "", bob.id, direct=True):
                assert held_by(lease) == "bob"
            lease.release(bob.id, "bob")
            assert held_by(lease) == "ann"
            assert not job.lost
        assert changes(events) == ["taken ann", "taken bob", "released", "taken ann"]


async def test_direct_command_outlives_its_lease_beside_the_job_of_another() -> None:
    async with leased() as (lease, _):
        with lease.driving("ann", ""):
            held = lease.take("bob", "")
            with lease.driving("bob", "", direct=True) as command:
                lease.release(held.id, "bob")
                assert (command.lost, held_by(lease)) == ("", "bob")
                with pytest.raises(LeaseHeld):
                    lease.take("ann", "")
            assert held_by(lease) == "ann"


async def test_without_a_lease_no_command_runs_beside_a_job() -> None:
    async with leased() as (lease, _):
        with lease.driving("ann", "job 1"):
            with pytest.raises(LeaseHeld), lease.driving("ros", "ros", direct=True):
                pass
            assert not lease.may_begin("bob")


async def test_offer_is_taken_during_a_job_and_survives_its_start() -> None:
    async with leased() as (lease, _):
        lease.offer("sam", "olga")
        with lease.driving("ann", "job 1") as job:
            assert lease.offered_to == "sam"
            assert lease.take("sam", "").lender == "olga"
            assert not job.lost


async def test_own_lease_is_taken_again_only_by_force_and_stays_lent() -> None:
    async with leased() as (lease, events):
        lease.offer("sam", "olga")
        lease.take("sam", "laptop")
        with pytest.raises(LeaseHeld, match="sam"):
            lease.take("sam", "desk")
        assert lease.take("sam", "desk", force=True).lender == "olga"
        assert changes(events) == ["offered", "handed over sam", "taken sam"]


async def test_caller_who_may_no_longer_drive_loses_it() -> None:
    async with leased() as (lease, events):
        lease.offer("ann", "olga")
        lease.drop("ann", "removed")
        assert lease.offered_to is None
        lease.take("ann", "")
        lease.drop("bob", "removed")
        assert held_by(lease) == "ann"
        lease.drop("ann", "removed")
        assert changes(events) == ["offered", "taken ann", "removed"]


async def test_requests_for_the_lease_are_reported_once_a_minute() -> None:
    async with leased() as (lease, events):
        for _ in range(100):
            lease.ask("sam")
        lease.ask("bob")
        assert lease.asked_by == "bob"
        assert [event.detail["by"] for event in events.since(0)] == ["sam", "bob"]
        await elapse(OFFER + 1.0)
        assert lease.asked_by is None


async def test_every_listener_is_notified_even_when_one_fails() -> None:
    async with leased() as (lease, _):
        told: list[str] = []
        unseen: list[object] = []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: unseen.append(context["exception"]))

        def failing(_why: str) -> None:
            raise ZeroDivisionError

        lease.on_change.extend([failing, told.append])
        lease.release(lease.take("ann", "").id, "ann")
        assert told == ["taken", "released"]
        assert [type(defect) for defect in unseen] == [ZeroDivisionError, ZeroDivisionError]


async def test_notified_caller_may_drive_at_once() -> None:
    """The queue begins the next job where the lease was given back."""
    async with leased() as (lease, events):
        drives: list[LeaseUse] = []

        def begin(why: str) -> None:
            if why == "released" and lease.may_begin("queue"):
                block = lease.driving("queue", "job 2")
                drives.append(block.__enter__())

        lease.on_change.append(begin)
        ann = lease.take("ann", "")
        lease.release(ann.id, "ann")
        assert (held_by(lease), len(drives)) == ("queue", 1)
        assert changes(events) == ["taken ann", "released", "taken queue"]


async def test_driven_work_may_be_a_future() -> None:
    async with leased() as (lease, _):
        told: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        ann = lease.take("ann", "")
        with lease.driving("ann", "", ann.id) as drive:
            drive.carry(told)
            lease.take("root", "", force=True)
            assert told.cancelled()
