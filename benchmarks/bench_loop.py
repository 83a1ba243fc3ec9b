"""How long the event loop is ever held: while a long job is accepted, checked whole, and carried out.

The whole stack runs in one loop, the twin included, as in `maya up`. In virtual time the loop makes the same steps
as in real time, only without waiting; planning runs in the loop itself, and what a step takes is what a stop that
comes meanwhile has to wait. Steps are measured in CPU time of the loop's thread, which leaves out what other
processes of a busy machine take; nothing here waits for a disk. The goal is about the worst step of all rounds.
"""

from __future__ import annotations

import asyncio
import gc
import time
from collections.abc import Callable, Coroutine
from typing import Any

from harness import Case, Goal, Sample, measure, report
from job import parsed

from dmc41x3.loops import JumpingLoop, run
from maya_un.assembly import stack
from maya_un.config import Config
from maya_un.interpreter import quiet_collector
from maya_un.process.spec.job import MOST_TASKS, Job
from maya_un.schema.jobs import TaskState

PAIRS = 499
"""As many as the file of a job may hold."""


class TimedLoop(JumpingLoop):
    """A loop that notes its longest step [s]: all that is ready, run once, with and without garbage collection."""

    def __init__(self) -> None:
        super().__init__(horizon=1e9)
        self.longest = 0.0
        self.longest_own = 0.0
        self._collecting = 0.0

    def _run_once(self) -> None:
        self._collecting = 0.0
        start = time.thread_time()
        super()._run_once()  # type: ignore[misc]
        took = time.thread_time() - start
        self.longest = max(self.longest, took)
        self.longest_own = max(self.longest_own, took - self._collecting)

    def collecting(self, phase: str, _: dict[str, int]) -> None:
        """Note how long the collector takes within a step."""
        now = time.thread_time()
        self._collecting += now if phase == "stop" else -now


def timed_loop(work: Coroutine[Any, Any, None]) -> TimedLoop:
    """Return the loop in which `work` ran."""
    loops: list[TimedLoop] = []

    def made() -> TimedLoop:
        loops.append(TimedLoop())
        gc.callbacks.append(loops[0].collecting)
        return loops[0]

    quiet_collector()  # as the commands do that own their process
    run(work, made)
    gc.callbacks.remove(loops[0].collecting)
    return loops[0]


async def carry_out(job: Job) -> None:
    """Have a job checked and carried out."""
    config = Config()
    async with stack(config, parts=job.part_points(config.cell.grasp_height), live=False) as robot:
        accepted = await robot.service.submit(job)
        done = await robot.service.wait(accepted.id)
    assert done.state is TaskState.DONE, done.message


async def accept_only(job: Job) -> None:
    """Have a job accepted, looked at once, and cancelled before its first step."""
    async with stack(Config(), live=False) as robot:
        accepted = await robot.service.submit(job)
        await asyncio.sleep(0)  # the requests of an edge are steps of their own
        await robot.service.job(accepted.id)
        await asyncio.sleep(0)
        await robot.service.cancel(accepted.id)


def both(work: Callable[[Job], Coroutine[Any, Any, None]], job: Job) -> tuple[Sample, Sample]:
    """Return samples of the longest step of the same run, with and without garbage collection [s]."""
    last: list[TimedLoop] = []

    def with_collection() -> float:
        last[:] = [timed_loop(work(job))]
        return last[0].longest

    return with_collection, lambda: last[0].longest_own


def main() -> None:
    goal = Goal(10.0)
    largest = parsed(PAIRS).model_copy(update={"repeat": MOST_TASKS // (2 * PAIRS + 1)})
    cases: list[Case] = []
    for name, work, job in (
        (f"job of {PAIRS} pairs", carry_out, parsed(PAIRS)),
        (f"job of {MOST_TASKS} tasks, accepted", accept_only, largest),
    ):
        with_collection, own = both(work, job)
        cases.append(Case(f"{name}: longest step", with_collection, "ms", goal))
        cases.append(Case(f"{name}: the same without garbage collection", own, "ms", goal))
    report(measure(cases, rounds=3, by=max))


if __name__ == "__main__":
    main()
