"""The whole queue against what it promises, whatever people, the machine, the disk and the power do, in any order."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from maya_un.errors import EndNotReached, MayaError, PathRefused, Stopped
from maya_un.events import Event, JobAdvanced, StepAdvanced
from maya_un.robot.primitives import Home
from maya_un.schema.choices import OnFailure
from maya_un.schema.jobs import TRANSITIONS, QueueMode, TaskState
from tests.queues import Machine, QueueBench, job, submit_request
from tests.virtual_time import elapse

OWNERS = ("ana", "ben")
STEPS: tuple[Any, ...] = ("home", {"gripper": "open"}, {"gripper": "close"}, {"approach": "cube"}, {"place": "tray"})

PATIENCE = 1000.0

FAILURES: tuple[Callable[[], MayaError], ...] = (
    lambda: PathRefused(target="cube", reason="x"),
    lambda: EndNotReached(axis="b", distance="1 mm"),
    Stopped,
)

Action = tuple[Any, ...]

numbers = st.integers(0, 5)
actions = st.one_of(
    st.tuples(
        st.just("submit"),
        st.sampled_from(OWNERS),
        st.lists(st.sampled_from(STEPS), min_size=1, max_size=3),
        st.fixed_dictionaries(
            {},
            optional={
                "priority": st.integers(-1, 1),
                "held": st.just(True),
                "stepwise": st.just(True),
                "retries": st.just(1),
                "on_failure": st.just(OnFailure.PAUSE),
            },
        ),
        st.none() | numbers,
    ),
    st.tuples(st.just("elapse"), st.sampled_from((0.0, 0.3, 10.0, 100.0))),
    st.tuples(st.just("fail"), st.sampled_from(FAILURES)),
    st.tuples(st.just("take"), st.sampled_from(OWNERS)),
    st.tuples(st.just("recover"), st.sampled_from(("resume", "redo", "skip", "abort")), st.none() | st.booleans()),
    st.tuples(st.just("move"), numbers, numbers, st.booleans()),
    st.tuples(st.sampled_from(("cancel", "hold", "release", "again")), numbers),
    st.tuples(st.just("end"), st.booleans()),
    *(
        st.tuples(st.just(word))
        for word in ("pause", "pause now", "resume", "resume motion", "step", "stop", "clear", "command", "kill")
    ),
    st.tuples(st.just("release lease")),
    st.tuples(st.sampled_from(("break", "mend"))),
)


@dataclass
class World:
    """A queue over many runs of the program, and what was heard of it."""

    machine: Machine = field(default_factory=Machine)
    layer: QueueBench = field(init=False)
    states: dict[int, TaskState] = field(default_factory=dict)
    begun: Counter[tuple[int, int]] = field(default_factory=Counter)
    granted: Counter[tuple[int, int]] = field(default_factory=Counter)
    accepted: list[int] = field(default_factory=list)
    direct: set[int] = field(default_factory=set)
    permits: int = 0
    lease: tuple[str, str] = ("", "")
    flaws: list[str] = field(default_factory=list)

    async def start(self) -> None:
        """Start the program; it does not start on a disk that takes nothing."""
        self.machine.journal.broken = ""
        self.layer = await self.machine.started()
        self.permits = 0
        self.direct.clear()
        self.layer.check_announcements()
        self.layer.controller.events.heard_by(self._hear)
        for line in self.layer.process.views.lines():
            known = self.states[line.id]
            assert line.state is known or line.state in TRANSITIONS[known], f"{line.id}: {known} became {line.state}"
            self.states[line.id] = line.state
        assert self.layer.process.running is None

    def _hear(self, event: Event) -> None:
        try:
            self._judge(event)
        except AssertionError as flaw:  # the queue would take it for a defect of its own
            self.flaws.append(str(flaw))

    def _judge(self, event: Event) -> None:
        detail = event.detail
        if isinstance(event, JobAdvanced):
            self._hear_job(int(str(detail["job"])), TaskState(str(detail["state"])))
        elif isinstance(event, StepAdvanced) and detail["state"] == "running" and "attempt" not in detail:
            self._hear_step((int(str(detail["job"])), int(str(detail["index"]))))

    def _hear_job(self, number: int, state: TaskState) -> None:
        before = self.states.get(number)
        if before is not None and state is not before:
            assert state in TRANSITIONS[before], f"{number}: {before} became {state}"
        self.states[number] = state
        if state is TaskState.RUNNING and before is TaskState.QUEUED:
            self._judge_turn(number)

    def _judge_turn(self, number: int) -> None:
        """No job that waits, is ready and may begin goes before the one that begins."""
        process, lease = self.layer.process, self.layer.lease
        lines = {line.id: line for line in process.views.lines()}
        this = lines[number]
        first = self.layer.states(number)[-2:] == ["queued", "running"] and this.done == 0
        holder = lease.holder
        if not first or number in self.direct:
            return
        assert holder is None or holder.implicit or holder.name == this.owner or this.began, (
            "begun under another's lease"
        )
        ahead = [
            line
            for line in lines.values()
            if line.state is TaskState.QUEUED
            and not line.began
            and not line.depends_on
            and line.priority > this.priority
        ]
        assert not [line for line in ahead if holder is None or holder.name == line.owner], f"{number} overtook {ahead}"

    def _hear_step(self, step: tuple[int, int]) -> None:
        self.begun[step] += 1
        assert self.begun[step] <= 1 + self.granted[step], f"step {step} is done once more, and nobody said so"
        if self.layer.process.views.mode is not QueueMode.RUNNING and step[0] not in self.direct:
            assert self.permits > 0, f"step {step} begins in a queue that is {self.layer.process.views.mode}"
            self.permits -= 1

    async def do(self, action: Action) -> None:
        """Do an action; it may be refused."""
        word, *arguments = action
        with suppress(MayaError):
            await self._doers()[word](*arguments)
        assert not self.flaws

    def _doers(self) -> dict[str, Callable[..., Awaitable[Any]]]:
        layer = self.layer
        process = layer.process
        return {
            "submit": self._submit,
            "elapse": elapse,
            "fail": self._fail,
            "take": self._take,
            "release lease": self._release_lease,
            "recover": self._recover,
            "move": lambda one, other, behind: process.move(self._some(one), self._some(other), behind=behind),
            "cancel": self._cancel,
            "hold": lambda one: process.hold(self._some(one)),
            "release": lambda one: process.release(self._some(one), "ana"),
            "again": self._again,
            "pause": lambda: process.scheduler.pause("ana", now=False),
            "pause now": lambda: process.scheduler.pause("ana", now=True),
            "resume": lambda: process.scheduler.resume("ana"),
            "resume motion": process.scheduler.resume_motion,
            "step": self._step,
            "stop": self._stop,
            "clear": process.clear,
            "command": self._command,
            "kill": self._kill,
            "end": self._end,
            "break": lambda: self._storage("the disk is full"),
            "mend": lambda: self._storage(""),
        }

    def _some(self, index: int) -> int:
        return self.accepted[index % len(self.accepted)] if self.accepted else 99

    async def _submit(self, owner: str, steps: list[Any], options: dict[str, Any], before: int | None) -> None:
        depends_on = () if before is None or not self.accepted else (self._some(before),)
        number = await self.layer.process.submit(job(*steps), submit_request(owner, depends_on=depends_on, **options))
        self.accepted.append(number)

    async def _again(self, index: int) -> None:
        self.accepted.append(await self.layer.process.again(self._some(index), submit_request()))

    async def _cancel(self, index: int) -> None:
        with suppress(TimeoutError):  # a caller who cancels a job learns of its end when the disk takes it
            async with asyncio.timeout(PATIENCE):
                await self.layer.process.cancel(self._some(index))

    async def _command(self) -> None:
        process = self.layer.process
        if process.views.mode is QueueMode.PAUSED and process.running is None:
            self.direct.add(max(self.accepted, default=0) + 1)
        number = await process.command(Home())
        self.accepted.append(number)

    async def _fail(self, failure: Callable[[], MayaError]) -> None:
        self.layer.controller.fail_at[len(self.layer.controller.calls) + 1] = failure()

    async def _take(self, owner: str) -> None:
        held = self.layer.lease.take(owner, "test", patience=60.0)
        self.lease = held.id, owner

    async def _release_lease(self) -> None:
        self.layer.lease.release(*self.lease)

    async def _recover(self, choice: str, holding: bool | None) -> None:
        found = self.layer.process.views.view().recovery
        await self.layer.process.recover(choice, holding, resume_queue=True, by="ana")
        if found is not None and choice in {"resume", "redo"}:
            self.granted[found.job, found.index] += 1

    async def _step(self) -> None:
        if self.layer.process.views.mode is QueueMode.PAUSED:
            self.permits = 1
        await self.layer.process.scheduler.step("ana")

    async def _stop(self) -> None:
        self.permits = 0
        self.layer.process.scheduler.halt(Stopped())
        await self.layer.controller.stop()

    async def _kill(self) -> None:
        await self.machine.kill(self.layer)
        self._forget_what_nobody_heard()
        await self.start()

    async def _end(self, finish: bool) -> None:
        await self.layer.process.close(finish=finish)
        self.layer.lease.close()
        self._forget_what_nobody_heard()
        await self.start()

    def _forget_what_nobody_heard(self) -> None:
        """A program that ended may have written what it had no time to announce: take the states from the journal."""
        for number in self.states:
            self.states[number] = self.machine.journal.now(number)[0].state

    async def _storage(self, reason: str) -> None:
        self.machine.journal.broken = reason

    async def bring_to_an_end(self) -> None:
        """Let everything go on until every job has ended."""
        self.machine.journal.broken = ""
        self.layer.controller.fail_at.clear()
        if self.layer.lease.holder is not None:
            self.layer.lease.take("ana", "test", force=True)
            self.layer.lease.drop("ana", "over")
        await elapse(10.0)
        for _ in range(200):
            process = self.layer.process
            process_lines = [line for line in process.views.lines() if not line.state.ended]
            if not process_lines:
                return
            if process.views.view().recovery is not None:
                await process.recover("abort", None, resume_queue=True, by="ana")
            for line in process_lines:
                if line.state is TaskState.HELD:
                    await process.release(line.id, "ana")
            if process.views.view().recovery is None:
                await process.scheduler.resume("ana")
            await elapse(500.0)
        raise AssertionError(f"never ended: {self.layer.process.views.view()}")

    async def judge_the_end(self) -> None:
        """Nothing was lost: every job that was accepted has ended, and its steps tell how."""
        assert not self.flaws
        for number in self.accepted:
            row, steps = self.machine.journal.now(number)
            assert row.state.ended, f"{number} is {row.state}"
            assert row.state is self.states[number]
            done = [step for step in steps if step.state is TaskState.DONE]
            assert row.done == len(done)
            assert not [step for step in steps if not step.state.ended], f"{number}: {steps}"
            if row.state is TaskState.DONE:
                assert len(steps) == row.steps
                assert {step.state for step in steps} <= {TaskState.DONE, TaskState.SKIPPED}


@settings(max_examples=150)
@given(st.lists(actions, min_size=3, max_size=25))
async def test_queue_keeps_its_guarantees(what_happens: list[Action]) -> None:
    world = World()
    await world.start()
    for action in what_happens:
        await world.do(action)
    await world.bring_to_an_end()
    await world.judge_the_end()
    await world.layer.process.close()
    world.layer.lease.close()
