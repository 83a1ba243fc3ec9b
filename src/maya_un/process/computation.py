"""Compute jobs before anything moves: their tasks, previews, margins and refusals.

With a worker (`maya_un.workers`), no computation blocks the loop. Without one, as in a dry run, the loop computes, and
runs other tasks between two steps.

Long lists of tasks are sent to the worker in pieces, because reading a long list at once would block the caller's loop.
`taught` is a pickle of the taught places, or of the error that prevents reading them.
"""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Generator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

from dmc41x3.i18n import phrase
from maya_un.controller.protocol import Controller
from maya_un.errors import (
    InvalidJob,
    InvalidRequest,
    MayaError,
    RequestError,
    TakesTooLong,
    TooLarge,
    TooMuchAsked,
    WorkerFailed,
)
from maya_un.kinematics.workspace import Workspace
from maya_un.process.outlook import (
    Course,
    JobOutlook,
    inspect_tasks,
    joined_outlook,
    preview_tasks,
    require_channels,
    step_of,
)
from maya_un.process.spec.job import Job
from maya_un.process.spec.json_object import decode_object
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.statements import Condition, JobStatement
from maya_un.process.spec.stored import COMMAND_KEY, Body, StoredJob, expanded, write_job
from maya_un.process.spec.tasks import Action, Expansion, Recall, Task, expand
from maya_un.quantities import has_units
from maya_un.robot.plan_builder import Pose
from maya_un.robot.robot import Robot, gripper_path, on_paper
from maya_un.schema.previews import (
    JobInspection,
    JobMistake,
    JobPreview,
    JobText,
    ParsedJob,
)
from maya_un.values import Point
from maya_un.workers import Work, WorkerSet
from maya_un.workers.wire import pickled

MOST_TEXT = 65_536
"""Longest text of a job that is parsed for a caller [characters]; a thousand steps have about half of it."""


MOST_SAMPLED = 200_000
"""Most samples of all motions of a job together; enough for 990 motions of 200 samples."""

PIECE = 50
"""Number of tasks in one message."""


class ExpansionRest(NamedTuple):
    """An expansion without its tasks."""

    parts: dict[str, Point | None]
    remarks: tuple[str, ...]
    start: dict[str, Point | None]

    @classmethod
    def of(cls, expansion: Expansion) -> ExpansionRest:
        """Return all of an expansion but its tasks."""
        return cls(expansion.parts, expansion.remarks, expansion.start)

    def joined(self, pieces: Sequence[Sequence[Task]]) -> Expansion:
        """Return the expansion with its tasks, which arrived in pieces."""
        return Expansion(tuple(task for piece in pieces for task in piece), *self)


class WrittenJob(NamedTuple):
    """A written job without its tasks."""

    name: str
    body: Body
    rest: ExpansionRest


def decoded(body: bytes) -> Generator[None, None, dict[str, Any]]:
    """Return a JSON object; raises as `decode_object` does."""
    yield
    return decode_object(body)


def read_text(request: bytes | Mapping[str, Any]) -> Generator[Any, None, ParsedJob]:
    """Return the job in the `text` of a request, or its first mistake; raises `InvalidRequest`."""
    from maya_un.process.spec.documents import TextMistake, read_yaml  # noqa: PLC0415 - loads yaml

    body = decode_object(request) if isinstance(request, bytes) else request
    text = body.get("text")
    if not isinstance(text, str) or body.keys() != {"text"} or len(text) > MOST_TEXT:
        raise InvalidRequest(
            key="text",
            reason=phrase("the body is an object with a `text` of at most {most} characters", most=MOST_TEXT),
        )
    found = yield from read_yaml(text)
    if isinstance(found, TextMistake):
        return ParsedJob(None, JobMistake(*found.place, "", found.reason))
    try:
        job = Job.parse(found.data)
    except InvalidJob as error:
        key = str(error.details["key"])
        return ParsedJob(None, JobMistake(*found.place(key), key, str(error.details["reason"])))
    return ParsedJob(job.as_data() if has_units(found.data) else found.data)


def write_text(job: object) -> Generator[Any, None, JobText]:
    """Return a job as YAML; raises `InvalidJob`, `InvalidRequest`."""
    from maya_un.process.spec.documents import write_yaml  # noqa: PLC0415 - loads yaml

    yield
    data = decode_object(job) if isinstance(job, bytes) else job
    Job.parse(data)
    return JobText(write_yaml(data))


def write(job: object, taught: bytes, grasp_height: float) -> Generator[Any, None, WrittenJob]:
    """Yield the tasks of a job, and return its stored form; raises as `write_job` and `Job.parse` do."""
    yield
    written = write_job(parsed(job), grasp_height, recalled(taught))
    yield from _pieces(written.expansion.tasks)
    return WrittenJob(written.name, written.body, ExpansionRest.of(written.expansion))


def expand_kept(body: Body, grasp_height: float) -> Generator[Any, None, ExpansionRest]:
    """Yield the tasks of a stored job, and return the rest; raises as `written.expanded` does."""
    yield
    expansion = expanded(body, grasp_height)
    yield from _pieces(expansion.tasks)
    return ExpansionRest.of(expansion)


def walk(workspace: Workspace, tasks: Sequence[Task], start: Course) -> Generator[None, None, JobOutlook]:
    """Return the preview of some tasks from `start`."""
    return (yield from preview_tasks(on_paper(workspace), tasks, start))


def path_ahead(
    workspace: Workspace, actions: Sequence[Action], start: Pose, most: int
) -> Generator[None, None, tuple[Point, ...]]:
    """Return at most `most` points [m] on the path of the last of some actions, which begin at `start`."""
    pose = start
    *before, last = actions
    if any(isinstance(action, Condition) for action in before):
        return ()
    for action in before:
        if not isinstance(action, JobStatement):
            pose = on_paper(workspace).preview(action, pose).end
        yield
    if isinstance(last, JobStatement):
        return ()
    found = on_paper(workspace).plan(last, pose)
    yield
    return gripper_path(workspace, found, most)


def require(workspace: Workspace, tasks: Sequence[Task], start: Course) -> Generator[None, None, Course]:
    """Return the course after some tasks; raises the error of the first task that would be refused."""
    course = start
    for task in tasks:
        _, course = step_of(on_paper(workspace), task, course)
        yield
    return course


def preview(
    workspace: Workspace, job: object, taught: bytes, grasp_height: float, start: Course
) -> Generator[None, None, JobPreview]:
    """Return the preview of a job."""
    yield
    tasks = expand(parsed(job), grasp_height, recalled(taught)).tasks
    return (yield from preview_tasks(on_paper(workspace), tasks, start)).preview


def inspect(
    workspace: Workspace,
    job: object,
    taught: bytes,
    grasp_height: float,
    start: Course,
    samples: int,
) -> Generator[None, None, JobInspection]:
    """Return a job in detail; raises `TooLarge` for more than `MOST_SAMPLED` samples."""
    yield
    tasks = expand(parsed(job), grasp_height, recalled(taught)).tasks
    return (yield from inspect_tasks(on_paper(workspace), tasks, start, samples, MOST_SAMPLED))


def parsed(job: object) -> Job:
    """Return a job from a `Job`, plain data, or JSON in bytes; raises `InvalidJob`, `InvalidRequest`."""
    if isinstance(job, Job):
        return job
    return Job.parse(decode_object(job) if isinstance(job, bytes) else job)


def recalled(taught: bytes) -> Recall:
    """Return a function that returns the taught places, or raises the error that prevents reading them."""

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


T = TypeVar("T")

CHECK = "check"
"""Principal of the computation of the job that begins next."""

AHEAD = "ahead"
"""Principal of the computation of the step that follows the running one, for those who watch."""

REPORT = "report"
"""Principal of the computation of a job for a report."""

SUBMITTED = 128
"""Most jobs of one principal that may be parsed at once; more are refused."""

_LONG = 200
"""A job of more steps is expanded in a thread if there is no worker."""


class JobComputer:
    """Computes jobs for a robot, in `staff` if it is not None."""

    def __init__(
        self, robot: Robot, controller: Controller, grasp_height: float, recall: Recall, staff: WorkerSet | None
    ) -> None:
        self._robot = robot
        self._controller = controller
        self._grasp_height = grasp_height
        self._recall = recall
        self._staff = staff
        self._sealed: tuple[TaughtPlaces | None, bytes] = (None, b"")

    async def written(self, job: object, *, whose: str) -> StoredJob:
        """Return the stored form of a job of user `whose`; `parsed` defines what `job` may be.

        Raises as `Job.parse` and `write_job` do, `InvalidJob` for an output or input that the configuration lacks, and
        as `Workers.run`.
        """
        if self._staff is None:
            written = write_job(parsed(job), self._grasp_height, self._recall)
        else:
            asked = (job, self.taught(), self._grasp_height)
            answer = await self._staff.people.run(write, *asked, whose=f"submit {whose}", each=SUBMITTED)
            name, body, rest = answer.value
            written = StoredJob(name, body, rest.joined(answer.parts))
        require_channels(written.expansion.tasks, self._robot.config)
        return written

    async def expanded(self, body: Body, steps: int = 0, *, whose: str = CHECK) -> Expansion:
        """Return the expansion of a stored job with `steps` steps.

        Raises as `tasks.expanded` does, and `Workers.run`.
        """
        if self._staff is not None and COMMAND_KEY not in body:
            worker = self._staff.people if whose == REPORT else self._staff.own
            answer = await worker.run(expand_kept, body, self._grasp_height, whose=whose, each=SUBMITTED)
            return answer.value.joined(answer.parts)
        return await self._expanded_here(body, steps)

    async def expanded_anyway(self, body: Body) -> Expansion:
        """Return the expansion of a stored job, in a thread if no worker can compute it.

        The done steps must not be lost.

        Raises as `tasks.expanded` does.
        """
        try:
            return await self.expanded(body)
        except (WorkerFailed, TakesTooLong, TooLarge, TooMuchAsked):
            return await self._expanded_here(body, _LONG + 1)

    async def _expanded_here(self, body: Body, steps: int) -> Expansion:
        if steps <= _LONG:
            return expanded(body, self._grasp_height)
        return await asyncio.get_running_loop().run_in_executor(None, expanded, body, self._grasp_height)

    def course(self, start: Pose, answers: Mapping[int, str] | None = None) -> Course:
        """Return the course from `start` with the present inputs, and the `answers` to earlier questions by task."""
        signals = self._controller.signals()
        return Course((start,), None if signals is None else signals.inputs, tuple((answers or {}).items()))

    async def walk(
        self, tasks: Sequence[Task], start: Pose, answers: Mapping[int, str] | None = None, *, whose: str = CHECK
    ) -> JobOutlook:
        """Return the outlook of `tasks` from `start`; sends nothing, and lets other tasks run meanwhile.

        `answers` are those to earlier questions, by task. Raises as `Workers.run` does.
        """
        if any(isinstance(task.action, Condition) for task in tasks):
            with suppress(RequestError):  # without inputs, the prediction takes the first branches
                await self._controller.input(1)
        course, courses = self.course(start, answers), list[JobOutlook]()
        if self._staff is None:
            return await _slowly(preview_tasks(self._robot, tasks, course))
        first = course
        for begin in range(0, len(tasks), PIECE):
            some = list(tasks[begin : begin + PIECE])
            courses.append(await self._asked(walk, some, course, whose=whose))
            course = courses[-1].course
            if courses[-1].preview.refusal is not None:
                break
        return joined_outlook(courses, first)

    async def path_ahead(self, actions: Sequence[Action], start: Pose, most: int) -> tuple[Point, ...]:
        """Return at most `most` points [m] on the path of the last of some actions, which begin at `start`.

        Without workers there are none. Raises the errors of planning, and as `Workers.run` does.
        """
        if self._staff is None:
            return ()
        return await self._asked(path_ahead, actions, start, most, whose=AHEAD)

    async def require(self, tasks: Sequence[Task], start: Pose) -> None:
        """Raise the refusal of the first of `tasks` that would be refused from `start`; sends nothing."""
        course = self.course(start)
        for begin in range(0, len(tasks), PIECE):
            some = list(tasks[begin : begin + PIECE])
            if self._staff is not None:
                course = await self._asked(require, some, course, whose=CHECK)
                continue
            for task in some:
                _, course = step_of(self._robot, task, course)
                await asyncio.sleep(0)

    async def preview(self, job: Job, start: Pose) -> JobPreview:
        """Return the preview of `job` from `start`; raises as `written` does for its contents; sends nothing."""
        if self._staff is None:
            tasks = expand(job, self._grasp_height, self._recall).tasks
            return (await _slowly(preview_tasks(self._robot, tasks, self.course(start)))).preview
        return await self._asked(preview, job, self.taught(), self._grasp_height, self.course(start), whose=CHECK)

    async def inspect(self, job: Job, start: Pose, samples: int) -> JobInspection:
        """Return the details of `job` from `start`; raises as `preview` does; sends nothing."""
        if self._staff is None:
            tasks = expand(job, self._grasp_height, self._recall).tasks
            return await _slowly(inspect_tasks(self._robot, tasks, self.course(start), samples))
        asked = (job, self.taught(), self._grasp_height, self.course(start), samples)
        return await self._asked(inspect, *asked, whose=CHECK)

    def taught(self) -> bytes:
        """Return a pickle of the taught places, or of the error that prevents reading them."""
        try:
            taught = self._recall()
        except MayaError as error:
            return pickled(error)
        if taught is not self._sealed[0]:
            self._sealed = (taught, pickled(taught))
        return self._sealed[1]

    async def _asked(self, work: Work[..., T], *args: object, whose: str) -> T:
        assert self._staff is not None
        return (await self._staff.own.run(work, self._controller.workspace, *args, whose=whose)).value


async def _slowly(work: Generator[None, None, T]) -> T:
    """Return the result of a generator that runs in this loop; other tasks run after each of its steps."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
        await asyncio.sleep(0)
