"""Computations about jobs in a worker (`maya_un.workers`); each function yields to other requests.

Long lists of tasks cross in pieces: reading a long one at once would hold the caller's loop. `taught` is a
pickle of what is taught, or of the error why nobody can tell.
"""

from __future__ import annotations

import pickle
from collections.abc import Generator, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from maya_un.errors import MayaError
from maya_un.kinematics.workspace import Workspace
from maya_un.process.decoding import decode_object
from maya_un.process.inspection import inspected
from maya_un.process.job import Job
from maya_un.process.names import Recall
from maya_un.process.preview import JobOutlook, walked
from maya_un.process.tasks import Task, expand
from maya_un.process.taught import TaughtPlaces
from maya_un.process.written import Body, expanded, write_job
from maya_un.robot.plan import Pose
from maya_un.robot.plans import on_paper
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.values import Point

MOST_SAMPLED = 200_000
"""Most samples of all motions of a job together; enough for 990 motions of 200 samples."""

PIECE = 50
"""Number of tasks in one message."""


class ExpansionRest(NamedTuple):
    """An expansion without its tasks."""

    parts: dict[str, Point | None]
    remarks: tuple[str, ...]


class WrittenJob(NamedTuple):
    """A written job without its tasks."""

    name: str
    body: Body
    rest: ExpansionRest


def decoded(body: bytes) -> Generator[None, None, dict[str, Any]]:
    """Return a JSON object; raises as `decode_object` does."""
    yield
    return decode_object(body)


def write(job: object, taught: bytes, grasp_height: float) -> Generator[Any, None, WrittenJob]:
    """Yield the tasks of a job, and return its stored form; raises as `write_job` and `Job.parse` do."""
    yield
    written = write_job(parsed(job), grasp_height, recalled(taught))
    yield from _pieces(written.expansion.tasks)
    return WrittenJob(written.name, written.body, ExpansionRest(written.expansion.parts, written.expansion.remarks))


def expand_kept(body: Body, grasp_height: float) -> Generator[Any, None, ExpansionRest]:
    """Yield the tasks of a stored job, and return the rest; raises as `written.expanded` does."""
    yield
    expansion = expanded(body, grasp_height)
    yield from _pieces(expansion.tasks)
    return ExpansionRest(expansion.parts, expansion.remarks)


def walk(workspace: Workspace, tasks: Sequence[Task], start: Pose) -> Generator[None, None, JobOutlook]:
    """Return the preview of some tasks from `start`."""
    return (yield from walked(on_paper(workspace), tasks, start))


def require(workspace: Workspace, tasks: Sequence[Task], start: Pose) -> Generator[None, None, Pose]:
    """Return the end of some tasks; raises the error of the first task that would be refused."""
    pose = start
    for task in tasks:
        pose = on_paper(workspace).preview(task.primitive, pose).end
        yield
    return pose


def preview(
    workspace: Workspace, job: object, taught: bytes, grasp_height: float, start: Pose
) -> Generator[None, None, JobPreview]:
    """Return the preview of a job."""
    yield
    tasks = expand(parsed(job), grasp_height, recalled(taught)).tasks
    return (yield from walked(on_paper(workspace), tasks, start)).preview


def inspect(
    workspace: Workspace,
    job: object,
    taught: bytes,
    grasp_height: float,
    start: Pose,
    samples: int,
) -> Generator[None, None, JobInspection]:
    """Return a job in detail; raises `TooLarge` for more than `MOST_SAMPLED` samples."""
    yield
    tasks = expand(parsed(job), grasp_height, recalled(taught)).tasks
    return (yield from inspected(on_paper(workspace), tasks, start, samples, MOST_SAMPLED))


def parsed(job: object) -> Job:
    """Return a job from a `Job`, plain data, or JSON in bytes; raises `InvalidJob`, `InvalidRequest`."""
    if isinstance(job, Job):
        return job
    return Job.parse(decode_object(job) if isinstance(job, bytes) else job)


def recalled(taught: bytes) -> Recall:
    """Return who tells what is taught, or why he cannot."""

    def recall() -> TaughtPlaces:
        found = _unpickled(taught)
        if isinstance(found, MayaError):
            raise found
        return found

    return recall


@lru_cache(maxsize=2)
def _unpickled(taught: bytes) -> TaughtPlaces | MayaError:
    return pickle.loads(taught)


def _pieces(tasks: Sequence[Task]) -> Generator[Sequence[Task], None, None]:
    for begin in range(0, len(tasks), PIECE):
        yield tasks[begin : begin + PIECE]
