"""A dry run of a hundred pairs of pick and place, homing with it: the identical stack, in virtual time."""

from __future__ import annotations

from harness import Case, Goal, measure, report, timed
from job import parsed

from dmc41x3.loops import run_virtual
from maya_un.assembly.stack import stack
from maya_un.config import Config
from maya_un.interpreter import quiet_collector
from maya_un.process.spec.job import Job
from maya_un.schema.jobs import TaskState

PAIRS = 100
HORIZON = 1e9


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


def main() -> None:
    quiet_collector()  # as the command does
    homing, job = parsed(0), parsed(PAIRS)
    cases = [
        Case("homing alone", timed(lambda: run_virtual(carry_out(homing), HORIZON)), "s"),
        Case(f"check of {PAIRS} pairs", timed(lambda: run_virtual(check_only(job), HORIZON)), "s"),
        Case(f"homing and {PAIRS} pairs", timed(lambda: run_virtual(carry_out(job), HORIZON)), "s", Goal(1.5)),
    ]
    report(measure(cases, rounds=7))


if __name__ == "__main__":
    main()
