"""How long the event loop is ever held: while a long job is read, checked whole, and carried out.

The whole stack runs in one loop, the twin included, as in `maya up`. In virtual time the loop makes the same steps
as in real time, only without waiting, so each can be timed; planning runs in the loop itself, and what a step
takes is what a stop that comes meanwhile has to wait. The goal is about the worst step of all rounds.
"""

from __future__ import annotations

import asyncio
import gc
import time
from collections.abc import Callable, Coroutine
from statistics import quantiles
from typing import Any

from harness import Case, Goal, Sample, measure, report
from job import parsed

from maya_un.assembly import stack
from maya_un.config import Config
from maya_un.loops import JumpingLoop, run
from maya_un.process.job import MOST_TASKS, Job
from maya_un.process.states import TaskState

PAIRS = 100


class TimedLoop(JumpingLoop):
    """A loop that notes how long each of its steps takes [s]: all that is ready, run once."""

    def __init__(self) -> None:
        super().__init__(horizon=1e9)
        self.steps: list[float] = []

    def _run_once(self) -> None:
        start = time.perf_counter()
        super()._run_once()  # type: ignore[misc]
        self.steps.append(time.perf_counter() - start)


def steps_of(work: Coroutine[Any, Any, None]) -> list[float]:
    """Return how long each step of a loop was while `work` ran [s]."""
    loops: list[TimedLoop] = []

    def made() -> TimedLoop:
        loops.append(TimedLoop())
        return loops[-1]

    gc.collect()
    run(work, made)
    return loops[0].steps


async def carry_out(job: Job) -> None:
    """Have a job checked and carried out, with the state stream on."""
    config = Config()
    async with stack(config, parts=job.part_points(config.cell.grasp_height)) as robot:
        accepted = await robot.service.submit(job)
        done = await robot.service.wait(accepted.id)
    assert done.state is TaskState.DONE, done.message


async def check_only(job: Job) -> None:
    """Have a job checked for as long as it takes, from where homing would leave the robot."""
    async with stack(Config(), stream=False) as robot:
        await robot.service.preview(job, from_homed=True)


async def accept_only(job: Job) -> None:
    """Have a job accepted, looked at once, and cancelled before its first step."""
    async with stack(Config(), stream=False) as robot:
        accepted = await robot.service.submit(job)
        await asyncio.sleep(0)  # the wishes of an edge are steps of their own
        await robot.service.job(accepted.id)
        await asyncio.sleep(0)
        await robot.service.cancel(accepted.id)


def longest(work: Callable[[Job], Coroutine[Any, Any, None]], job: Job) -> Sample:
    """Return a sample of the longest step of a loop [s]."""
    return lambda: max(steps_of(work(job)))


def usual(work: Callable[[Job], Coroutine[Any, Any, None]], job: Job) -> Sample:
    """Return a sample of the step that 999 of 1000 do not exceed [s]."""
    return lambda: quantiles(steps_of(work(job)), n=1000)[-1]


def main() -> None:
    goal = Goal(10.0)
    job, largest = parsed(PAIRS), parsed(499).model_copy(update={"repeat": MOST_TASKS // 999})
    cases = [
        Case(f"{PAIRS} pairs: 999 of 1000 steps", usual(carry_out, job), "ms"),
        Case(f"{PAIRS} pairs: longest step", longest(carry_out, job), "ms", goal),
        Case(f"check of {PAIRS} pairs: longest step", longest(check_only, job), "ms", goal),
        Case("largest job, accepted: longest step", longest(accept_only, largest), "ms", goal),
    ]
    report(measure(cases, rounds=5, by=max))


if __name__ == "__main__":
    main()
