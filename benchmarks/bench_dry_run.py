"""The identical stack in virtual time: a dry run of a hundred pairs of pick and place, its homing, an hour at rest."""

from __future__ import annotations

import asyncio

from harness import Case, Goal, measure, report, timed
from job import parsed

from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.config.files import parse
from maya_un.interpreter import quiet_collector
from maya_un.process.spec.job import Job
from maya_un.schema.jobs import TaskState

PAIRS = 100
HORIZON = 1e9
HOUR = 3_600.0
SELDOM = parse({"controller": {"stream_rate": 1.0}, "safety": {"guard_time": 5.0}})
"""A data record a second, as in the test of a day (tests/system/test_soak.py)."""
HOMING = "homing alone"


async def carry_out(job: Job) -> None:
    """Carry a job out on a twin of its own, as `maya run --dry-run` does."""
    config = Config()
    async with stack(config, parts=job.part_points(config.cell.grasp_height), live=False) as robot:
        accepted = await robot.service.submit(job)
        done = await robot.service.wait(accepted.id)
    assert done.state is TaskState.DONE, done.message


async def check_only(job: Job) -> None:
    """Work a job out, and send nothing that moves."""
    async with stack(Config(), live=False) as robot:
        checked = await robot.service.preview(job, from_homed=True)
    assert checked.refusal is None, checked.refusal


async def rest() -> None:
    """Do nothing for an hour, while the driver and the monitor work on."""
    async with stack(SELDOM):
        await asyncio.sleep(HOUR)


def main() -> None:
    quiet_collector()  # as the command does
    homing, job = parsed(0), parsed(PAIRS)
    cases = [
        Case(HOMING, timed(lambda: run_virtual(carry_out(homing), HORIZON)), "s", Goal(0.06)),
        Case(f"check of {PAIRS} pairs", timed(lambda: run_virtual(check_only(job), HORIZON)), "s"),
        Case(
            f"homing and {PAIRS} pairs", timed(lambda: run_virtual(carry_out(job), HORIZON)), "s",
            Goal(0.2, to=HOMING, kind="over"),
        ),
    ]  # fmt: skip
    figures = measure(cases, rounds=7)
    hour = Case(
        "an hour at rest, a record a second", timed(lambda: run_virtual(rest(), HORIZON)), "s", Goal(20.0 / 24.0)
    )
    report(figures + measure([hour], rounds=3))


if __name__ == "__main__":
    main()
