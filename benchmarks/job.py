"""The job that benchmarks carry out: one part that wanders over the table, no two of its places alike."""

from __future__ import annotations

import random
from math import cos, sin

from maya_un.process.spec.job import Job

SEED = 1


def pairs(count: int) -> dict[str, object]:
    """Return a job of homing and `count` pairs of pick and place, as its file has it."""
    rng = random.Random(SEED)

    def place() -> list[float]:
        a, d = rng.uniform(0.1, 2.0), rng.uniform(0.85, 1.7)
        return [d * sin(a), d * cos(a)]

    places = [place() for _ in range(count + 1)]
    steps = [step for there in range(count) for step in ({"pick": places[there]}, {"place": places[there + 1]})]
    return {"name": f"{count} pairs", "parts": {"cube": places[0]}, "steps": ["home", *steps]}


def parsed(count: int) -> Job:
    """Return the job of `pairs`, read."""
    return Job.parse(pairs(count))
