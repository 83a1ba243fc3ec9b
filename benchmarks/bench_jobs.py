"""How fast a job is worked out, and how fast it runs in virtual time: `python benchmarks/bench_jobs.py`."""

from __future__ import annotations

import random
from math import cos, sin
from time import perf_counter

from maya_un.assembly import stack
from maya_un.config import Config
from maya_un.loops import run_virtual
from maya_un.process.job import Job

PAIRS = 100
SEED = 1


def pairs() -> Job:
    """Return a job of pick-and-place pairs at random places, no two alike."""
    rng = random.Random(SEED)

    def place() -> list[float]:
        a, d = rng.uniform(0.1, 2.0), rng.uniform(0.85, 1.7)
        return [d * sin(a), d * cos(a)]

    steps = [step for _ in range(PAIRS) for step in ({"pick": place()}, {"place": place()})]
    return Job.parse({"name": f"{PAIRS} pairs", "steps": ["home", *steps]})


async def measure(job: Job) -> None:
    """Time the preview alone, then the whole job in virtual time (goals: 0.5 s and 1 s)."""
    async with stack(Config(), stream=False) as maya:
        began = perf_counter()
        await maya.service.preview(job)
        print(f"{f'preview of {PAIRS} pairs':32s} {(perf_counter() - began) * 1e3:9.0f} ms")
    async with stack(Config(), stream=False) as maya:
        began = perf_counter()
        await maya.service.submit(job)
        report = await maya.service.wait(1)
        took = perf_counter() - began
        print(f"{f'dry run of {PAIRS} pairs':32s} {took * 1e3:9.0f} ms  {report.state}")
        print(f"{'virtual time per real time':32s} {(report.duration or 0.0) / took:9.0f}")


if __name__ == "__main__":
    run_virtual(measure(pairs()))
