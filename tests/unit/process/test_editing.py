"""Changes of the queue by several people at once or while a job runs, and dependent jobs that change with others."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from maya_un.errors import InvalidJob, InvalidValue, Stopped, WrongState
from maya_un.process.journal.protocol import JobRow
from maya_un.process.journal.tables import Change
from maya_un.process.queue.entries import AT_HAND
from maya_un.schema.jobs import TaskState
from tests.queues import CUBE, TRAY, FrailJournal, Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

HOME = job("home", name="home")


def kept(layer: QueueBench, *numbers: int) -> list[TaskState]:
    """Return the states of jobs in the journal."""
    return [layer.journal.now(number)[0].state for number in numbers]


@pytest.mark.parametrize("priority", [-3, 0, 3])
async def test_dependent_jobs_are_cleared_in_any_order(priority: int) -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1,), priority=priority))
        await layer.process.submit(HOME, submit_request(depends_on=(1, 2), priority=2 * priority))
        await layer.process.clear()
        assert kept(layer, 1, 2, 3) == [TaskState.CANCELLED] * 3
        assert layer.states(2) == ["queued", "cancelled"]
        assert await layer.process.submit(HOME) == 4
        assert (await layer.process.result(4)).state is TaskState.DONE


async def test_a_long_chain_is_cleared_and_stays_cleared_after_a_restart() -> None:
    machine, count = Machine(), 450
    async with machine.running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        for number in range(1, count):
            await layer.process.submit(HOME, submit_request(depends_on=(number,), priority=number % 7))
        await layer.process.clear()
        assert set(kept(layer, *range(1, count + 1))) == {TaskState.CANCELLED}
    async with machine.running() as layer:
        assert (await layer.journal.unfinished()).jobs == ()


async def test_cancelling_the_first_of_a_chain_holds_the_next_only() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        await layer.process.submit(HOME, submit_request(depends_on=(1,)))
        await layer.process.submit(HOME, submit_request(depends_on=(2,)))
        await layer.process.cancel(1)
        assert kept(layer, 1, 2, 3) == [TaskState.CANCELLED, TaskState.HELD, TaskState.QUEUED]


async def test_two_editors_of_one_job_keep_both_changes() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        await asyncio.gather(
            layer.process.change(1, {"priority": 5}),
            layer.process.change(1, {"notes": "before the visit"}),
            layer.process.change(1, {"retries": 2}),
        )
        options = layer.journal.now(1)[0].options
        assert (options.priority, options.notes, options.retries) == (5, "before the visit", 2)


async def test_mutual_dependencies_are_refused_once() -> None:
    async with Machine().running() as layer:
        for _ in range(2):
            await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        answers = await asyncio.gather(
            layer.process.change(1, {"depends_on": [2]}),
            layer.process.change(2, {"depends_on": [1]}),
            return_exceptions=True,
        )
        assert answers[0] is None
        assert isinstance(answers[1], InvalidValue)
        await layer.process.release(1, "ana")
        await layer.process.release(2, "ana")
        await elapse(1000.0)
        assert kept(layer, 1, 2) == [TaskState.DONE, TaskState.DONE]


async def test_steps_that_begin_while_a_change_waits_for_its_turn_stay_as_they_are() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request(stepwise=True))
        await elapse(1000.0)
        layer.journal.slow = 0.5
        note = asyncio.create_task(layer.process.change(1, {"notes": "slow"}))
        await elapse(0.1)
        with pytest.raises(InvalidJob, match="steps up to 1 have begun"):
            await layer.process.change(1, {"job": {"steps": [{"gripper": "open"}, "home"]}})
        await note
        assert len(layer.journal.now(1)[0].body["steps"]) == 2


async def test_steps_of_a_job_that_is_paused_within_a_step_do_not_change() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job({"pick": "cube"}, {"place": "tray"}))
        await layer.until(1, 1)
        await layer.process.scheduler.pause("ana", now=True)
        other = {"parts": CUBE, "places": {"shelf": [0.9, 0.9]}, "steps": [{"pick": "cube"}, {"place": "shelf"}]}
        with pytest.raises(
            WrongState, match=r"Job 1 is paused within a step\. A job in this state cannot be changed\."
        ):
            await layer.process.change(1, {"job": other})
        await layer.process.change(1, {"notes": "look at the tray"})
        await layer.process.scheduler.resume("ana")
        done = await layer.process.result(1)
        assert [(step.step, step.state) for step in done.steps] == [
            ("pick cube", TaskState.DONE),
            ("place tray", TaskState.DONE),
        ]
        assert layer.journal.now(1)[0].body["places"] == TRAY


async def test_steps_of_a_job_that_is_paused_in_its_check_do_not_change(monkeypatch: pytest.MonkeyPatch) -> None:
    async with Machine().running() as layer:
        walk = layer.process.computer.walk

        async def slow(*args: Any, **options: Any) -> Any:
            await elapse(5.0)
            return await walk(*args, **options)

        monkeypatch.setattr(layer.process.computer, "walk", slow)
        await layer.process.submit(job("home", {"gripper": "open"}))
        await elapse(1.0)
        await layer.process.scheduler.pause("ana", now=True)
        with pytest.raises(WrongState):
            await layer.process.change(1, {"job": {"steps": ["home", "home"]}})
        await layer.process.scheduler.resume("ana")
        assert [step.step for step in (await layer.process.result(1)).steps] == ["home", "gripper open"]


async def test_a_job_that_has_begun_is_not_changed_without_approval() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", "home"), submit_request(stepwise=True))
        await elapse(1000.0)
        before = layer.journal.now(1)[0]
        for changes in ({"job": {"steps": ["home", {"gripper": "open"}]}}, {"stepwise": False}):
            with pytest.raises(WrongState, match="cannot be changed without approval"):
                await layer.process.change(1, changes, approved=False)
        assert layer.journal.now(1)[0] == before


async def test_a_job_done_again_from_a_step_keeps_the_steps_before_it() -> None:
    async with Machine().running() as layer:
        await layer.process.submit(job("home", {"gripper": "open"}, "home"))
        await layer.process.result(1)
        again = await layer.process.again(1, submit_request(held=True), 3)
        with pytest.raises(InvalidJob, match="steps up to 2 have begun or are left out"):
            await layer.process.change(again, {"job": {"steps": ["home", "home"]}})
        await layer.process.change(again, {"job": {"steps": ["home", {"gripper": "open"}, {"gripper": "close"}]}})
        await layer.process.release(again, "ana")
        steps = (await layer.process.result(again)).steps
        assert [step.state for step in steps] == [TaskState.SKIPPED, TaskState.SKIPPED, TaskState.DONE]
        assert layer.controller.state.gripper_closed


class SlowlyKnown(FrailJournal):
    """A journal whose new jobs are stored `late` [s] before the queue knows them."""

    late = 0.0

    async def add(self, *jobs: JobRow) -> None:
        await super().add(*jobs)
        await elapse(self.late)


@pytest.mark.parametrize("stored", [False, True])
async def test_jobs_that_arrive_while_their_owners_rights_end_are_proposals(stored: bool) -> None:
    journal = SlowlyKnown()
    async with Machine(journal).running() as layer:
        await layer.process.scheduler.pause("root", now=False)
        await layer.process.submit(HOME, submit_request("ben"))
        await layer.process.submit(HOME, submit_request("ana"))
        journal.slow, journal.late = (0.0, 0.5) if stored else (0.5, 0.0)
        coming = [asyncio.create_task(layer.process.submit(HOME, submit_request(owner))) for owner in ("ben", "ana")]
        await elapse(0.1)
        layer.process.owner_ended("ben")
        assert await asyncio.gather(*coming) == [3, 4]
        await elapse(5.0)
        rows = [layer.journal.now(number)[0] for number in (1, 2, 3, 4)]
        assert [(row.state, row.proposal) for row in rows] == [(TaskState.HELD, True), (TaskState.QUEUED, False)] * 2
        await layer.process.scheduler.resume("root")
        assert (await layer.process.result(4)).state is TaskState.DONE
        assert layer.states(3)[-1] == "held"
        journal.slow = journal.late = 0.0
        assert (await layer.process.submit(HOME, submit_request("ben"))) == 5  # of rights that were given again
        assert (await layer.process.result(5)).state is TaskState.DONE


async def test_job_is_accepted_once_if_the_journal_breaks_while_its_owners_rights_end() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("root", now=False)
        layer.journal.slow = 1.0
        coming = asyncio.create_task(layer.process.submit(HOME, submit_request("eve")))
        await elapse(0.5)
        layer.process.owner_ended("eve")
        await elapse(0.6)
        layer.journal.broken = "the disk is full"
        assert await coming == 1
        layer.journal.broken, layer.journal.slow = "", 0.0
        await elapse(5.0)
        row, _ = layer.journal.now(1)
        assert (row.state, row.proposal) == (TaskState.HELD, True)


async def test_direct_command_that_was_held_waits_in_a_paused_queue_when_it_is_released() -> None:
    async with Machine().running() as layer:
        await layer.process.scheduler.pause("root", now=False)
        with layer.process.scheduler.aside("jog"):
            number = await layer.process.command({"command": "home"}, submit_request())
            await layer.process.hold(number)
            layer.process.scheduler.halt(Stopped())
        await layer.process.release(number, "ben")
        await elapse(5.0)
        assert kept(layer, number) == [TaskState.QUEUED]
        await layer.process.scheduler.resume("root")
        assert (await layer.process.result(number)).state is TaskState.DONE


class Counting(FrailJournal):
    """A journal that counts the rows of each write."""

    def __init__(self) -> None:
        super().__init__()
        self.sizes: list[int] = []

    async def save(self, *changes: Change) -> None:
        self.sizes.append(len(changes))
        await super().save(*changes)


@pytest.mark.parametrize("broken", ["", "the disk is full"])
async def test_all_of_many_waiting_jobs_become_proposals_some_at_a_time(broken: str) -> None:
    journal = Counting()
    async with Machine(journal).running() as layer:
        await layer.process.scheduler.pause("root", now=False)
        for number in range(300):
            await layer.process.submit(HOME, submit_request("ana" if number % 3 == 0 else "ben"))
        journal.broken = broken
        layer.process.owner_ended("ben")
        await elapse(1.0)
        journal.broken = ""
        await elapse(10.0)
        rows = [layer.journal.now(number + 1)[0] for number in range(300)]
        assert [row.proposal for row in rows] == [number % 3 != 0 for number in range(300)]
        assert [row.state is TaskState.HELD for row in rows] == [row.proposal for row in rows]
        assert broken or max(journal.sizes) <= AT_HAND


@pytest.mark.parametrize("last", [True, False])
async def test_job_moved_to_an_end_is_there_however_others_move(last: bool) -> None:
    async with Machine().running() as layer:
        for _ in range(3):
            await layer.process.submit(HOME, submit_request(held=True))
        layer.journal.slow = 0.1
        end = 3 if last else 1
        await asyncio.gather(layer.process.cancel(end), layer.process.move_to(2, last=last))
        waiting = [1, 2] if last else [2, 3]
        places = [(layer.journal.now(number)[0].position, number) for number in waiting]
        assert [number for _, number in sorted(places)][-1 if last else 0] == 2
