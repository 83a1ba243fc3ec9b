"""Rights to take the lease, to offer it and to take it back."""

from __future__ import annotations

from math import inf, nan
from typing import cast

import pytest

from maya_un.errors import InvalidValue, LeaseHeld, LeaseLost, LeaseNeeded, MayaError, NotAllowed, UnknownName
from maya_un.process.process import Process
from maya_un.schema.people import LONGEST
from maya_un.service.access.operations import LOCAL, Caller, Role
from maya_un.service.queueing import QueueService
from tests.authentication import CallerRegistry, caller_registry, somebody
from tests.virtual_time import elapse

SAM, TOM = somebody(Role.STUDENT, "sam"), somebody(Role.STUDENT, "tom")
OLGA, OTTO = somebody(Role.OPERATOR, "olga"), somebody(Role.OPERATOR, "otto")
ROOT = somebody(Role.ADMIN, "root")


async def lab() -> CallerRegistry:
    """Return a service with every user in it."""
    made = caller_registry()
    await made.people.add("root", "admin")
    for caller in (SAM, TOM, OLGA, OTTO):
        await made.people.add(caller.name, caller.role.word)
    await made.people.add("vera", "viewer")
    return made


async def holding(owner: CallerRegistry, by: Caller, **how: object) -> Caller:
    """Take the lease and return the caller who shows it."""
    taken = await owner.leasing.take(by, **how)  # pyright: ignore[reportArgumentType] - note, patience, force
    return somebody(by.role, by.name, taken.id)


def driver(owner: CallerRegistry) -> str:
    holder = owner.access.lease.holder
    return "" if holder is None else holder.name


async def test_operator_takes_a_free_lease_and_a_student_does_not() -> None:
    owner = await lab()
    with pytest.raises(NotAllowed):
        await owner.leasing.take(SAM)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(SAM, force=True)
    await owner.leasing.take(OLGA)
    with pytest.raises(LeaseHeld):
        await owner.leasing.take(OTTO)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(OTTO, force=True)
    await owner.leasing.take(ROOT, force=True)
    assert driver(owner) == "root"


async def test_student_drives_with_a_lent_lease_until_an_operator_takes_it() -> None:
    owner = await lab()
    await owner.leasing.offer("sam", OLGA)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(TOM)
    sam = await holding(owner, SAM)
    with pytest.raises(NotAllowed):
        await owner.leasing.offer("tom", sam)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(TOM, force=True)
    with pytest.raises(LeaseHeld):
        await owner.leasing.take(OTTO)
    await owner.leasing.take(OTTO, force=True)
    assert driver(owner) == "otto"
    with pytest.raises(LeaseLost):
        await owner.leasing.renew(sam)


async def test_a_lent_lease_is_handed_on_by_any_operator() -> None:
    owner = await lab()
    await owner.leasing.offer("sam", OLGA)
    await holding(owner, SAM)
    await owner.leasing.offer("tom", OTTO)
    await owner.leasing.take(TOM)
    assert driver(owner) == "tom"


async def test_lease_of_another_operator_cannot_be_offered() -> None:
    owner = await lab()
    olga = await holding(owner, OLGA)
    with pytest.raises(NotAllowed):
        await owner.leasing.offer("sam", OTTO)
    await owner.leasing.offer("sam", OLGA)  # she is who she is, whichever of her terminals holds it
    await owner.leasing.offer("sam", olga)
    await owner.leasing.offer("sam", ROOT)
    await owner.leasing.take(SAM)
    assert driver(owner) == "sam"


async def test_own_lease_is_taken_again_by_force() -> None:
    owner = await lab()
    await owner.leasing.offer("sam", OLGA)
    first = await holding(owner, SAM)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(SAM)
    await holding(owner, SAM, force=True)
    with pytest.raises(LeaseLost):
        await owner.leasing.renew(first)
    with pytest.raises(NotAllowed):
        await owner.leasing.take(TOM, force=True)
    await owner.leasing.take(OLGA, force=True)


async def test_running_job_does_not_let_a_student_take_the_lease() -> None:
    owner = await lab()
    with owner.access.lease.driving("sam", "job 1"):
        for force in (False, True):
            with pytest.raises(NotAllowed):
                await owner.leasing.take(SAM, force=force)
        await owner.leasing.take(OLGA)


@pytest.mark.parametrize("name", ["nobody", "vera", "", "local", "ros", "SAM"])
async def test_lease_is_offered_to_anyone_who_may_drive(name: str) -> None:
    owner = await lab()
    with pytest.raises(UnknownName, match="olga, otto, root, sam, tom"):
        await owner.leasing.offer(name, OLGA)
    with pytest.raises(UnknownName, match="no users"):
        await caller_registry().leasing.offer(name, LOCAL)


async def test_every_caller_sees_the_driver_and_only_he_that_it_is_himself() -> None:
    owner = await lab()
    empty = await owner.leasing.view(SAM)
    assert (empty.holder, empty.expires_in, empty.yours) == ("", None, False)
    olga = await holding(owner, OLGA, note="aligning", patience=30.0)
    await elapse(4.0)
    await owner.leasing.ask(SAM)
    await owner.leasing.offer("tom", olga)
    seen = await owner.leasing.view(SAM)
    assert (seen.holder, seen.source, seen.since, seen.note) == ("olga", "10.0.0.1", 4.0, "aligning")
    assert (seen.expires_in, seen.asked_by, seen.offered_to, seen.yours) == (26.0, "sam", "tom", False)
    assert (await owner.leasing.view(olga)).yours
    assert not (await owner.leasing.view(somebody(Role.STUDENT, "sam", olga.lease))).yours
    assert not (await owner.leasing.view(OLGA)).yours


async def test_lease_of_another_caller_is_refused() -> None:
    owner = await lab()
    olga = await holding(owner, OLGA)
    thief = somebody(Role.ADMIN, "root", olga.lease)
    for request in (owner.leasing.renew, owner.leasing.release):
        with pytest.raises(LeaseHeld):
            await request(thief)
    with pytest.raises(LeaseHeld):
        await owner.leasing.renew(ROOT)
    await owner.leasing.release(olga)
    with pytest.raises(LeaseNeeded):
        await owner.leasing.release(ROOT)


async def test_held_jogs_stop_when_the_lease_changes_or_ends() -> None:
    owner = await lab()
    olga = await holding(owner, OLGA)
    owner.halts.clear()
    for _ in range(5):
        await owner.leasing.renew(olga)
    assert owner.halts == []
    await elapse(11.0)
    assert owner.halts == ["halt"]
    olga = await holding(owner, OLGA)
    owner.halts.clear()
    await owner.leasing.offer("sam", olga)
    assert owner.halts == []
    await owner.leasing.take(SAM)
    assert owner.halts == ["halt"]
    await owner.leasing.take(ROOT, force=True)
    assert owner.halts == ["halt", "halt"]


@pytest.mark.parametrize("patience", [0.0, 0.5, -1.0, LONGEST + 1.0, inf, nan])
async def test_patience_has_its_bounds(patience: float) -> None:
    owner = await lab()
    with pytest.raises(InvalidValue):
        await owner.leasing.take(OLGA, patience=patience)
    assert driver(owner) == ""


@pytest.mark.parametrize("note", ["x" * 201, "a\nb", "\x1b[31m"])
async def test_a_note_is_one_line(note: str) -> None:
    owner = await lab()
    with pytest.raises(MayaError):
        await owner.leasing.take(OLGA, note=note)


async def test_the_local_user_needs_no_ceremony_and_may_have_it() -> None:
    owner = caller_registry()
    taken = await owner.leasing.take(LOCAL, note="calibrating")
    assert (taken.holder, taken.note, taken.expires_in) == ("local", "calibrating", 10.0)
    with owner.access.lease.driving("local", "local", direct=True):
        assert driver(owner) == "local"


async def test_students_job_waits_for_approval_unless_the_lease_was_lent() -> None:
    owner = await lab()
    lease = owner.access.lease
    queue = QueueService(cast("Process", None), lease)
    assert (queue.proposes(SAM), queue.proposes(OLGA)) == (True, False)
    with lease.driving("sam", "job 1"):
        assert queue.proposes(SAM)
    await owner.leasing.offer("sam", OLGA)
    assert queue.proposes(SAM)
    await owner.leasing.take(SAM)
    assert (queue.proposes(SAM), queue.proposes(TOM), queue.proposes(OLGA)) == (False, True, False)
    await elapse(11.0)
    assert queue.proposes(SAM)
