"""The worker processes of a robot, and their bounds. A worker imports this module, so it loads little."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from maya_un.config import Config
from maya_un.workers import ComputeLimits, Workers, WorkerSet

OWN_BOUNDS = ComputeLimits(seconds=60.0, most=256, each=128)
"""Bounds of the work for which the robot waits: those of a job, which is requested in pieces."""

PEOPLE_BOUNDS = ComputeLimits(seconds=30.0, most=256, each=4, nicer=5)


@contextmanager
def staffed(config: Config) -> Iterator[WorkerSet]:
    """Provide worker processes for a machine while the block runs; they start when they are needed."""
    own = Workers("motion", OWN_BOUNDS, _prepare, config)
    people = Workers("previews", PEOPLE_BOUNDS, _prepare, config)
    try:
        yield WorkerSet(own, people)
    finally:
        own.close()
        people.close()


def _prepare(config: Config) -> None:
    """Prepare a worker for a machine. Only a worker loads what plans and previews need."""
    from maya_un.service import previews  # noqa: PLC0415

    previews.prepare(config)
