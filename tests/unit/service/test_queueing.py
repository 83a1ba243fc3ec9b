"""The queue in the service: owners of jobs, rights of students, valid words."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from maya_un.errors import AnswerNeeded, InvalidRequest, InvalidValue, JobChanged, NotAllowed, NotFound, WrongState
from maya_un.process.journal.protocol import Filter, JobOptions
from maya_un.schema.encoding import to_data
from maya_un.schema.jobs import JobLine, QueueMode, TaskState
from maya_un.service.access.operations import LOCAL, Caller, Role
from maya_un.service.service import Service
from tests.queues import PICK_AND_PLACE, Machine, QueueBench, job
from tests.virtual_time import elapse

ANA = Caller("ana", Role.STUDENT, "lab")
BEN = Caller("ben", Role.STUDENT, "lab")
EVA = Caller("eva", Role.OPERATOR, "lab")
HOME = {"name": "home", "steps": ["home"]}
LONG = 1000.0


@asynccontextmanager
async def opened_service(machine: Machine | None = None) -> AsyncIterator[tuple[QueueBench, Service]]:
    async with (machine or Machine()).running() as layer:
        yield layer, Service(layer.process, layer.robot, layer.controller, layer.controller.config)


async def test_students_job_is_a_proposal_until_an_operator_releases_it() -> None:
    async with opened_service() as (_, service):
        await service.submit(HOME, by=ANA)
        (shown,) = await service.history.page(Filter())
        assert (shown.state, shown.proposal, shown.owner, shown.source) == (TaskState.HELD, True, "ana", "lab")
        with pytest.raises(NotAllowed):
            await service.queue.release(1, by=ANA)
        released = await service.queue.release(1, by=EVA)
        assert (released.approved_by, released.proposal) == ("eva", True)
        assert (await service.wait(1)).state is TaskState.DONE


async def test_student_with_the_lease_queues_like_others() -> None:
    async with opened_service() as (_, service):
        service.access.lease.take("ana", "lab", patience=LONG)
        accepted = await service.submit(HOME, by=ANA)
        assert (await service.wait(accepted.id)).line.proposal is False


async def test_students_change_and_cancel_their_own_jobs() -> None:
    async with opened_service() as (_, service):
        await service.submit(HOME, by=ANA)
        for request in (
            lambda: service.queue.change(1, {"notes": "x"}, by=BEN),
            lambda: service.queue.hold(1, by=BEN),
            lambda: service.cancel(1, by=BEN),
            lambda: service.queue.move(1, to="first", by=ANA),
        ):
            with pytest.raises(NotAllowed):
                await request()
        assert (await service.queue.change(1, {"notes": "night"}, by=ANA)).notes == "night"
        assert (await service.cancel(1, by=ANA)).state is TaskState.CANCELLED


async def test_student_cannot_approve_his_own_simultaneous_change() -> None:
    async with opened_service() as (layer, service):
        await service.queue.pause(EVA)
        await service.submit(HOME, by=ANA)
        await service.queue.release(1, by=EVA)
        await service.queue.hold(1, by=ANA)
        layer.journal.slow = 0.5
        changing = asyncio.create_task(service.queue.change(1, {"job": {"steps": [{"gripper": "open"}]}}, by=ANA))
        await elapse(0.1)
        with pytest.raises(NotAllowed):
            await service.queue.release(1, by=ANA)
        changed = await changing
        assert (changed.state, changed.approved_by) == (TaskState.HELD, "")


async def test_approved_job_is_a_proposal_again_after_a_students_change() -> None:
    async with opened_service() as (_, service):
        await service.queue.pause(EVA)
        await service.submit(HOME, by=ANA)
        await service.queue.release(1, by=EVA)
        changed = await service.queue.change(1, {"job": {"steps": ["home", "home"]}}, by=ANA)
        assert (changed.state, changed.proposal, changed.approved_by) == (TaskState.HELD, True, "")
        again = await service.queue.change(1, {"notes": "fine"}, by=EVA)
        assert (again.state, again.steps) == (TaskState.HELD, 2)


async def test_words_that_are_not_understood_are_refused() -> None:
    async with opened_service() as (_, service):
        await service.submit(HOME, options=JobOptions(held=True))
        with pytest.raises(InvalidValue, match="one of after step, now"):
            await service.queue.pause(when="soon")
        with pytest.raises(InvalidRequest):
            await service.queue.move(1)
        with pytest.raises(InvalidRequest):
            await service.queue.move(1, before=1, to="last")
        with pytest.raises(InvalidValue, match="one of first, last"):
            await service.queue.move(1, to="middle")
        with pytest.raises(NotFound):
            await service.queue.hold(9)
        with pytest.raises(NotFound):
            await service.queue.recover("resume")
        with pytest.raises(InvalidValue, match="priority"):
            await service.submit(HOME, options=JobOptions(priority=500))


async def test_the_queue_is_paused_stepped_and_cleared() -> None:
    async with opened_service() as (layer, service):
        view = await service.queue.pause(EVA)
        assert (view.mode, view.by, view.reason) == (QueueMode.PAUSED, "eva", "asked")
        for _ in range(3):
            await service.submit(HOME)
        await service.queue.step(EVA)
        await elapse(LONG)
        assert layer.controller.names() == ["home"]
        moved = await service.queue.move(3, before=2)
        assert (moved.position, moved.id) == (1, 3)
        cleared = await service.queue.clear(EVA)
        assert cleared.counts == {}
        resumed = await service.queue.resume(EVA)
        assert resumed.mode is QueueMode.RUNNING


async def test_rerun_job_of_a_student_is_a_proposal() -> None:
    async with opened_service() as (_, service):
        await service.wait((await service.submit(HOME)).id)
        again = await service.queue.again(1, by=ANA)
        assert (again.id, again.state, again.proposal) == (2, TaskState.HELD, True)
        assert (await service.queue.again(1, from_step=1)).state in {TaskState.QUEUED, TaskState.RUNNING}
        with pytest.raises(WrongState):
            await service.queue.again(2)


async def test_interrupted_job_is_recovered_through_the_service() -> None:
    machine = Machine()
    layer = await machine.started()
    await layer.process.submit(job("home", "home"))
    await layer.until(1, 1)
    await machine.kill(layer)
    async with opened_service(machine) as (_, service):
        with pytest.raises(AnswerNeeded):
            await service.queue.resume()
        view = service.queue.view()
        assert view.recovery is not None
        assert to_data(view)["recovery"]["choices"][0]["name"] == "resume"
        after = await service.queue.recover("redo")
        assert after.mode is QueueMode.RUNNING
        assert (await service.wait(1)).state is TaskState.DONE


async def test_status_shows_the_state_of_the_queue() -> None:
    async with opened_service() as (_, service):
        await service.queue.pause(EVA)
        await service.submit(HOME)
        status = await service.status()
        assert (status.queue, status.reason, status.can_teleop) == (QueueMode.PAUSED, "asked", True)
        assert [line.id for line in status.jobs] == [1]


async def test_the_same_key_is_the_same_job_for_one_owner() -> None:
    async with opened_service() as (_, service):
        one = await service.submit(HOME, key="k", by=EVA)
        assert await service.submit(HOME, key="k", by=EVA) == one
        assert (await service.submit(HOME, key="k", by=LOCAL)).id != one.id


@pytest.mark.parametrize("way", ["demoted", "removed"])
async def test_demoted_owners_step_finishes_and_the_rest_waits_for_approval(way: str) -> None:
    async with opened_service() as (layer, service):
        root = Caller("root", Role.ADMIN, "lab")
        await service.users.add("root", "admin")
        await service.users.add("eva", "operator")
        for _ in range(2):
            await service.submit(job(*PICK_AND_PLACE), by=EVA)
        await service.submit(HOME, by=root)
        await layer.until(1, 1)
        if way == "demoted":
            await service.users.change("eva", role="viewer", by=root)
        else:
            await service.users.remove("eva")
        view = service.queue.view()
        assert (view.mode, view.reason) == (QueueMode.PAUSING, "driver")
        while service.queue.view().mode is QueueMode.PAUSING:
            await elapse(0.1)
        found = {line.id: line for line in await service.history.page(Filter())}
        assert (found[1].state, found[1].done) == (TaskState.PAUSED, 1)
        assert (found[2].state, found[2].proposal) == (TaskState.HELD, True)
        assert (found[3].state, found[3].proposal) == (TaskState.QUEUED, False)
        await service.queue.release(2, by=root)
        await service.queue.resume(root)
        assert [(await service.wait(number)).state for number in (1, 2, 3)] == [TaskState.DONE] * 3


async def test_job_goes_on_when_its_owners_token_is_revoked_or_role_raised() -> None:
    async with opened_service() as (_, service):
        root = Caller("root", Role.ADMIN, "lab")
        await service.users.add("root", "admin")
        made = await service.users.add("eva", "operator")
        for _ in range(2):
            await service.submit(job(*PICK_AND_PLACE), by=EVA)
        await service.users.revoke(made.id, by=root)
        await service.users.change("eva", role="admin", by=root)
        assert [(await service.wait(number)).state for number in (1, 2)] == [TaskState.DONE] * 2


async def test_of_two_editors_the_later_one_learns_that_the_job_has_changed() -> None:
    async with opened_service() as (_, service):
        await service.submit(HOME, options=JobOptions(held=True), by=EVA)
        seen = (await service.job(1)).version
        changed = [service.queue.change(1, {"retries": n}, by=EVA, version=seen) for n in (1, 2)]
        first, second = await asyncio.gather(*changed, return_exceptions=True)
        assert isinstance(first, JobLine)
        assert isinstance(second, JobChanged)
        assert first.retries == (await service.queue.change(1, {"notes": "x"}, by=EVA)).retries == 1


async def test_approval_covers_only_the_version_that_was_shown() -> None:
    async with opened_service() as (_, service):
        await service.submit(job({"pick": "cube"}, {"place": "tray"}), by=ANA)
        seen = (await service.job(1)).version
        await service.queue.change(1, {"notes": "please"}, by=ANA)
        assert (await service.job(1)).version == seen
        for changes in ({"priority": 100}, {"retries": 10}, {"on_failure": "pause"}, {"stepwise": True}):
            before = (await service.job(1)).version
            await service.queue.change(1, changes, by=ANA)
            with pytest.raises(JobChanged):
                await service.queue.release(1, by=EVA, version=before)
        await service.queue.change(1, {"job": HOME}, by=ANA)
        with pytest.raises(JobChanged):
            await service.queue.release(1, by=EVA, version=seen)
        assert service.queue.view().waiting[0].state is TaskState.HELD
        now = (await service.job(1)).version
        assert (await service.queue.release(1, by=EVA, version=now)).approved_by == "eva"


async def test_version_in_a_report_is_that_of_its_steps_although_the_job_changes_meanwhile() -> None:
    async with opened_service() as (_, service):
        await service.submit(HOME, options=JobOptions(held=True), by=EVA)
        longer = job(*({"wait": 1.0} for _ in range(500)))
        await service.submit(longer, options=JobOptions(held=True), by=EVA)
        versions = {"home": (await service.job(1)).version}
        await service.queue.change(1, {"job": job({"wait": 1.0})}, by=EVA)
        changed = await service.job(1)
        versions[changed.steps[0].step] = changed.version
        assert len(versions) == 2
        for turns in range(12):
            other = asyncio.create_task(service.job(2))  # readers take turns: the report below waits for this one
            report = asyncio.create_task(service.job(1))
            for _ in range(turns):
                await asyncio.sleep(0)
            await service.queue.change(1, {"job": HOME if turns % 2 == 0 else job({"wait": 1.0})}, by=EVA)
            await other
            told = await report
            assert told.version == versions[told.steps[0].step]
