"""How Maya's own costs grow: tasks of a job, axes of the twin; and how near its motions are to the least time."""

from __future__ import annotations

import time
from collections.abc import Iterator

from benchmarks.bench_dry_run import HORIZON, carry_out
from benchmarks.bench_motion import carried_out
from benchmarks.bench_twin import SECONDS, machine_in_motion
from benchmarks.job import pairs
from dmc41x3.loops import run_virtual
from maya_un.interpreter import quiet_collector
from maya_un.process.spec.job import Job
from scripts.performance_results import OURS, Growth, Motion

STEPS = 500
"""Longer jobs repeat so many steps."""


def round_trip(tasks: int) -> Job:
    """Return a job of so many tasks behind its homing, whose part ends where it began.

    Above `STEPS` it repeats them, and `tasks` must be a multiple of that.
    """
    body = pairs(min(tasks, STEPS) // 2)
    steps = body["steps"]
    assert isinstance(steps, list)
    first, last = steps[1], steps[-1]
    last["place"] = first["pick"]
    return Job.parse(body | {"repeat": max(1, tasks // STEPS)})


def tasks(sizes: tuple[int, ...]) -> Iterator[Growth]:
    """Yield the CPU time of the dry run of a job [s], homing included."""
    quiet_collector()  # as the command does
    run_virtual(carry_out(round_trip(2)), HORIZON)  # so that no size pays for the imports
    for size in sizes:
        job = round_trip(size)
        start = time.process_time()
        run_virtual(carry_out(job), HORIZON)
        yield Growth("tasks of a dry run", OURS, size, time.process_time() - start, "s")


def axes(sizes: tuple[int, ...]) -> Iterator[Growth]:
    """Yield the CPU time of the twin for a second of motion of so many axes [ms], the best of three."""
    for size in sizes:
        cost = min(machine_in_motion(size) for _ in range(3))
        yield Growth("axes of the twin", OURS, size, 1e3 * cost / SECONDS, "ms CPU per second")


def motions() -> Iterator[Motion]:
    """Yield the standard motions of `scripts/bench motion`, beside the least time that the axes' limits allow."""
    for found in run_virtual(carried_out()):
        yield Motion(found.name, found.bound(), found.duration, found.one_axis_at_a_time(), found.off)
