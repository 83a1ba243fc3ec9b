"""A robot with a queue, run to be killed: the stack on its twin in virtual time, with the queue in a real file.

    python -m tests.system.kill_worker FOLDER SEED

It queues the jobs of SEED, like a client that repeats a request until it is answered, and runs them. The mechanics' own
record, the announcements and the decisions of a person go to FOLDER/ledger.jsonl as they happen. The next worker knows
the machine's state from that file alone: its host was killed, the machine was not; now and then its power is gone too,
and it has to be homed. Every statement of the journal and every line of the ledger is a byte on stdout, so that the
parent process can choose the instant of the kill.

If work is unfinished at its start, it checks that nothing moves by itself, compares the queue's choices with the
ledger, answers like a person who looks at the table, and continues. It ends with 0 when every job has ended.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from dataclasses import dataclass
from itertools import pairwise
from math import cos, dist, sin
from pathlib import Path
from random import Random
from typing import Any

from dmc41x3.loops import JumpingLoop, run
from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.wire.server import VirtualController
from maya_un.assembly import controller as assembled
from maya_un.assembly.controller import Twin
from maya_un.assembly.stack import Stack, stack
from maya_un.config.files import parse
from maya_un.errors import AnswerNeeded
from maya_un.events import Event, HomingBegun, HomingDone, JobAdvanced, PhaseBegun, StepAdvanced
from maya_un.machine.log import PartDrop, PartTable, Place
from maya_un.machine.mechanics import MayaMechanics
from maya_un.machine.truth import StartPose
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.process.spec.job import Job
from maya_un.schema.jobs import QueueMode, QueueView, Recovery, TaskState
from maya_un.service.access.operations import LOCAL
from maya_un.values import Joints
from tests.homing_mark import mark
from tests.machines import Machine
from tests.virtual_time import elapse

JOBS = 4
MACHINE = Machine.of(parse({}))
GRASP = MACHINE.config.cell.grasp_height
APART = 0.1
"""No two places of a plan are nearer to each other [m]."""
HERE = Joints(0.5, 1.5, 1.5)
"""Initial position of the machine."""
LOOK = 2.5
"""The machine's place on its way is written down this often [s]."""
POWER_CUT = 0.1
"""Share of the kills that also cut the machine's power."""


@dataclass(frozen=True, slots=True)
class Carry:
    """Take a part here, put it there."""

    part: str
    here: Place
    there: Place


Plan = dict[str, list[Carry]]
"""The part of each job, by its name."""


def plan(seed: int) -> Plan:
    """Return the jobs of a seed: each carries a part of its own, over places that nothing else uses."""
    rng, used = Random(f"plan {seed}"), list[Place]()

    def place() -> Place:
        while True:
            a, d = rng.uniform(0.1, 1.9), rng.uniform(0.85, 1.7)
            found = (round(d * sin(a), 3), round(d * cos(a), 3), GRASP)
            if all(dist(found, other) > APART for other in used):
                used.append(found)
                return found

    jobs: Plan = {}
    for number in range(JOBS):
        places = [place() for _ in range(rng.choice((2, 2, 3)))]
        jobs[f"job{number}"] = [Carry(f"part{number}", *leg) for leg in pairwise(places)]
    return jobs


def job_of(name: str, carries: list[Carry]) -> Job:
    """Return a job as it is queued."""
    steps = [step for one in carries for step in ({"pick": list(one.here)}, {"place": list(one.there)})]
    return Job.parse({"name": name, "steps": steps})


class Ledger:
    """The facts of a run, line by line.

    A line that was written whole outlives whatever kills the process. A kill can tear the line being written where
    it crosses a page of memory; nothing that follows from such a line was done, and the next life drops it.
    """

    def __init__(self, folder: Path, progress: int | None = None) -> None:
        path = folder / "ledger.jsonl"
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o600)
        self._progress = progress
        written = path.read_bytes()
        whole = written[: written.rfind(b"\n") + 1]
        os.ftruncate(self._file, len(whole))
        self.lines: list[dict[str, Any]] = [json.loads(line) for line in whole.splitlines()]
        self.twin: Twin | None = None

    def write(self, what: str, **facts: object) -> None:
        """Write a fact down, with where the machine stands."""
        joints = self.joints if self.twin is None else self.twin.mechanics.true_joints()
        line = {"what": what, "at": list(joints), **facts}
        self.lines.append(line)
        os.write(self._file, json.dumps(line).encode() + b"\n")
        self.tick()

    def tick(self, *_: object) -> None:
        """Notify the parent process that something happened."""
        if self._progress is not None:
            os.write(self._progress, b".")

    def of(self, *kinds: str) -> list[dict[str, Any]]:
        """Return the lines of some kinds, oldest first."""
        return [line for line in self.lines if line["what"] in kinds]

    @property
    def joints(self) -> Joints:
        """Last position of the machine."""
        return Joints(*self.lines[-1]["at"]) if self.lines else HERE

    @property
    def jaws_open(self) -> bool:
        """Whether the gripper was opened last; it is closed at power-up."""
        moved = self.of("open", "close", "power")
        return bool(moved) and moved[-1]["what"] == "open"

    @property
    def homed(self) -> bool:
        """Whether the machine holds the mark of a homing: it has had its power since, and no other has begun."""
        told = self.of("power", "homing", "homed")
        return not told or told[-1]["what"] == "homed"

    @property
    def carried(self) -> str | None:
        """The part in the gripper."""
        moved = self.of("open", "close", "taken out")
        return moved[-1]["part"] if moved and moved[-1]["what"] == "close" else None

    def place(self, part: str, start: Place) -> Place:
        """Return where a part stood last."""
        put = [line["place"] for line in self.of("open", "taken out") if line["part"] == part]
        return tuple(put[-1]) if put else start

    def happened(self, part: str, index: int) -> bool:
        """Whether a step (from 1) of the job that carries a part had its effect: it was taken, or put down so often."""
        kind = "close" if index % 2 else "open"
        return len([line for line in self.of(kind) if line["part"] == part]) > (index - 1) // 2

    def ended(self) -> set[int]:
        """Return the numbers of the jobs whose end was announced."""
        ends = {"done", "failed", "cancelled"}
        return {line["detail"]["job"] for line in self.of("job") if line["detail"]["state"] in ends}


def noting(table: PartTable, ledger: Ledger) -> None:
    """Have the gripper record the parts that it takes and releases."""
    close, open_ = table.close, table.open

    def closing(gripper: Place) -> str | None:
        was_open, taken = not table.closed, close(gripper)
        if was_open:
            ledger.write("close", part=taken, place=gripper)
        return taken

    def opening(gripper: Place, time: float) -> PartDrop | None:
        was_closed, let_go = table.closed, table.carried
        drop = open_(gripper, time)
        if was_closed:
            x, y, _ = gripper
            ledger.write("open", part=let_go, place=(x, y, GRASP), fell=drop is not None)
        return drop

    table.close, table.open = closing, opening


def standing(jobs: Plan, ledger: Ledger, *, powered: bool) -> Twin:
    """Return the machine in the state of the ledger; a powered one has its gripper unchanged, and its mark."""
    parts = {legs[0].part: ledger.place(legs[0].part, legs[0].here) for legs in jobs.values()}
    stand = MACHINE.whole(ledger.joints)
    mechanics = MayaMechanics(MACHINE.truth, StartPose(*stand), parts=parts)
    if ledger.carried is not None:
        mechanics._table._carried = ledger.carried
    virtual = VirtualController(VirtualDmc(mechanics))
    if powered:
        handle = virtual.machine.connect()
        assert handle is not None
        counts, *homed = mark(MACHINE.config, stand, MACHINE.truth)
        jaws = "SB 1" if ledger.jaws_open or not ledger.lines else "CB 1"
        for command in [counts, *(homed if ledger.homed else []), jaws]:
            assert b"?" not in virtual.machine.receive(handle, f"{command}\r".encode(), virtual.machine.now), command
        virtual.machine.disconnect(handle)
    noting(mechanics._table, ledger)
    return Twin(virtual, mechanics)


class Person:
    """Inspects the table and the queue's choices, and decides on the interrupted job."""

    def __init__(self, robot: Stack, twin: Twin, jobs: Plan, ledger: Ledger, rng: Random) -> None:
        self._robot = robot
        self._queue = robot.service.queue
        self._twin = twin
        self._jobs = jobs
        self._ledger = ledger
        self._rng = rng

    async def look_after(self) -> None:
        """See that nothing moves, say what becomes of what was under way, and let the queue go on."""
        if self._view().mode is QueueMode.PAUSED:
            await self._nothing_moves()
        if not self._robot.controller.state.homed:
            await self._do("home", {"command": "home"})
        if not self._ledger.jaws_open and self._ledger.carried is None:
            await self._do("open", {"command": "gripper", "open": True})
        while (recovery := self._view().recovery) is not None:
            await self._judge(recovery)
            await self._answer(recovery)
        if self._view().mode is QueueMode.PAUSED:
            self._ledger.write("said", choice="resume the queue")
            await self._queue.resume(LOCAL)

    def _view(self) -> QueueView:
        view = self._queue.view()
        unfinished = view.recovery is not None or view.waiting or view.running
        assert view.mode is QueueMode.PAUSED or not (view.recovery or (unfinished and not self._said_anything))
        return view

    @property
    def _said_anything(self) -> bool:
        """Whether a person has decided since this start."""
        since = [line["what"] for line in self._ledger.lines]
        return "said" in since[len(since) - 1 - since[::-1].index("up") :]

    async def _nothing_moves(self) -> None:
        before = self._twin.mechanics.true_joints(), self._twin.mechanics.record.carried
        await elapse(self._rng.uniform(0.0, 600.0))
        self._twin.controller.sync()
        assert (self._twin.mechanics.true_joints(), self._twin.mechanics.record.carried) == before
        assert self._view().running is None

    async def _do(self, said: str, request: dict[str, object]) -> None:
        """Have the robot do something now, while the queue is paused."""
        self._ledger.write("said", choice=said)
        report = await self._robot.service.command(request, by=LOCAL)
        assert report.state is TaskState.DONE, report.message

    async def _judge(self, offer: Recovery) -> None:
        """Compare what is offered with what really happened."""
        assert (offer.holding is False) == self._ledger.jaws_open
        names = [choice.name for choice in offer.choices]
        assert names == (["resume", "redo", "skip", "abort"] if offer.index else ["resume", "abort"])
        if offer.name not in self._jobs:
            assert offer.name in {"home", "gripper"}
            return
        carries = self._jobs[offer.name]
        steps = (await self._robot.service.job(offer.job)).steps
        before = sum(step.state in {TaskState.DONE, TaskState.SKIPPED} for step in steps)
        assert offer.index in {0, before + 1}
        happened = [self._ledger.happened(carries[0].part, index) for index in range(1, 2 * len(carries) + 1)]
        after = happened[offer.index or before :]
        assert all(happened[:before]), "what is said to be done has not happened"
        assert not any(after), "something happened of which nothing is known"
        if offer.index:
            assert offer.step.startswith("pick" if offer.index % 2 else "place")
            closed = self._ledger.carried is not None or not self._ledger.jaws_open
            needs = {choice.name for choice in offer.choices if choice.needs_answer}
            assert not closed or {"resume", "redo"} <= needs, "the gripper cannot be known, so it is asked"

    async def _answer(self, offer: Recovery) -> None:
        carried = self._ledger.carried
        name = self._choice(offer)
        if name == "abort" and carried is not None and offer.name in self._jobs:
            self._take_out(carried)
        holding = self._ledger.carried is not None
        needs_answer = next(choice.needs_answer for choice in offer.choices if choice.name == name)
        resume = self._rng.random() < 0.5
        self._ledger.write("said", choice=name, job=offer.name, index=offer.index, holding=holding)
        if needs_answer:
            await self._refused(name, resume=resume)
            assert self._queue.view().recovery == offer
        told = holding if needs_answer or name == "abort" or self._rng.random() < 0.5 else None
        await self._queue.recover(name, holding=told, resume_queue=resume, by=LOCAL)

    async def _refused(self, name: str, *, resume: bool) -> None:
        """See that a choice is refused without what the person sees in the gripper."""
        try:
            await self._queue.recover(name, resume_queue=resume, by=LOCAL)
        except AnswerNeeded:
            return
        raise AssertionError(f"{name} was not refused")

    def _choice(self, offer: Recovery) -> str:
        """Return the decision of a person who sees the state: repeat no finished step, skip no unfinished one.

        A person who cancelled a job without an answer repeats it.
        """
        given_up = {line.get("job") for line in self._ledger.of("said") if line["choice"] == "abort"}
        if offer.name in given_up or self._rng.random() < 0.05:
            return "abort"
        if not offer.index:
            return "resume"
        if offer.name not in self._jobs:
            return self._rng.choice(("resume", "redo", "skip"))
        happened = self._ledger.happened(self._jobs[offer.name][0].part, offer.index)
        return self._rng.choice(("resume", "resume", "skip" if happened else "redo"))

    def _take_out(self, part: str) -> None:
        """Take a part out of the gripper by hand and put it at the edge of the table."""
        table = self._twin.mechanics._table
        table._carried = None
        aside = (0.0, 0.1 + 0.05 * len(self._ledger.of("taken out")), GRASP)
        table._places[part] = aside
        self._ledger.write("taken out", part=part, place=aside)


async def submit(robot: Stack, jobs: Plan, ledger: Ledger, rng: Random) -> list[int]:
    """Ask for every job until it was accepted; one that was is asked for again, and is the same."""
    accepted = {line["job"]: line["number"] for line in ledger.of("accepted")}
    numbers: list[int] = []
    for name, carries in jobs.items():
        await elapse(rng.choice((0.0, 0.0, rng.uniform(0.0, 100.0))))
        said = await robot.service.submit(job_of(name, carries), by=LOCAL, key=name)
        assert accepted.get(name, said.id) == said.id
        ledger.write("accepted", job=name, number=said.id)
        numbers.append(said.id)
    return numbers


def hear(robot: Stack, twin: Twin, ledger: Ledger) -> None:
    """Have the ledger hold what is announced."""

    def heard(event: Event) -> None:
        if isinstance(event, JobAdvanced | StepAdvanced | PhaseBegun | HomingBegun | HomingDone):
            twin.controller.sync()
            ledger.write(event.kind, detail={key: str(value) for key, value in event.detail.items()})

    robot.controller.events.heard_by(heard)


async def watch(twin: Twin, ledger: Ledger) -> None:
    """Write down now and then where the machine is on its way."""
    while True:
        await elapse(LOOK)
        twin.controller.sync()
        if list(twin.mechanics.true_joints()) != ledger.lines[-1]["at"]:
            ledger.write("way")


async def work(folder: Path, seed: int) -> None:
    """Start, recover the job that was under way, and continue until every job has ended."""
    jobs, ledger = plan(seed), Ledger(folder, sys.stdout.fileno())
    rng = Random(f"{seed} {len(ledger.lines)}")
    powered = not ledger.lines or ledger.jaws_open or rng.random() >= POWER_CUT
    marked = powered and ledger.homed
    ledger.twin = twin = standing(jobs, ledger, powered=powered)
    assembled.make_twin = lambda *_, **__: twin
    if not ledger.lines:
        ledger.write("open", part=None, place=twin.mechanics.gripper_point(), fell=False)
    ledger.write("up" if powered else "power")
    journal = await SqliteJournal.open(folder / "maya.db")
    journal._writer.set_trace_callback(ledger.tick)
    async with stack(MACHINE.config, live=False, skip_home=marked, journal=journal) as robot:
        hear(robot, twin, ledger)
        watching = asyncio.create_task(watch(twin, ledger))
        submitting = asyncio.create_task(submit(robot, jobs, ledger, rng))
        await Person(robot, twin, jobs, ledger, rng).look_after()
        for number in await submitting:
            await robot.service.wait(number)
        watching.cancel()
    ledger.write("end")
    await journal.close()


if __name__ == "__main__":
    run(work(Path(sys.argv[1]), int(sys.argv[2])), JumpingLoop)
