"""Compute jobs before anything moves: their tasks, previews, margins and refusals.

With a worker (`maya_un.workers`), no computation blocks the loop. Without one, as in a dry run, the loop computes, and
runs other tasks between two steps.

Long lists of tasks are sent to the worker in pieces, because reading a long list at once would block the caller's loop.
`taught` is a pickle of the taught places, or of the error that prevents reading them.
"""

from __future__ import annotations

import asyncio
import pickle
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from math import inf
from typing import Any, NamedTuple, Protocol, TypeVar

from dmc41x3.i18n import phrase
from maya_un.config import Config, ControllerConfig, Units
from maya_un.controller.protocol import Closest, Controller, Inspection
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
from maya_un.process.spec.job import Job
from maya_un.process.spec.json_object import decode_object
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.statements import ELSE, THEN, Condition, Statement
from maya_un.process.spec.tasks import (
    COMMAND_KEY,
    Action,
    Body,
    Expansion,
    Recall,
    StoredJob,
    Task,
    expand,
    expanded,
    write_job,
)
from maya_un.quantities import has_units
from maya_un.robot.plan_builder import ActionDetail, Pose, PrimitivePreview
from maya_un.robot.primitives import Primitive
from maya_un.robot.robot import Robot, gripper_path, on_paper
from maya_un.schema.previews import (
    Band,
    JobInspection,
    JobMistake,
    JobPreview,
    JobText,
    Nearest,
    ParsedJob,
    PhasePreview,
    Refusal,
    Samples,
    StepPreview,
)
from maya_un.values import Notice, Point
from maya_un.workers import Work, WorkerSet

MOST_TEXT = 65_536
"""Longest text of a job that is parsed for a caller [characters]; a thousand steps have about half of it."""


MOST_POSES = 16
"""Most poses in which a step may begin, after branches that end apart."""


class Fork(NamedTuple):
    """An open branch: the last tasks of `then` and of `else`, and the poses before it.

    `then_ends` are the poses after `then`, None before. `takes_then` is whether the prediction takes `then`, `expected`
    whether it comes to this branch at all.
    """

    then_last: int
    else_last: int
    starts: tuple[Pose, ...]
    takes_then: bool
    expected: bool
    then_ends: tuple[Pose, ...] | None = None


class Course(NamedTuple):
    """The poses in which the next task of a job may begin; the first is the predicted one, if it is `expected`.

    `inputs` are the present digital inputs, None if unknown. `answers` are those to earlier questions, by task.
    """

    poses: tuple[Pose, ...]
    inputs: tuple[bool, ...] | None = None
    answers: tuple[tuple[int, str], ...] = ()
    expected: bool = True
    forks: tuple[Fork, ...] = ()

    def before(self, index: float) -> Course:
        """Return the course before the task `index`: branches that end before it are closed."""
        course = self
        while course.forks:
            fork = course.forks[-1]
            if fork.then_ends is None and index > fork.then_last:
                changed = fork._replace(then_ends=course.poses)
                expected = fork.expected and not fork.takes_then
                course = course._replace(poses=fork.starts, expected=expected, forks=(*course.forks[:-1], changed))
            elif fork.then_ends is not None and index > fork.else_last:
                both = (fork.then_ends, course.poses) if fork.takes_then else (course.poses, fork.then_ends)
                poses = tuple(dict.fromkeys((*both[0], *both[1])))
                course = course._replace(poses=poses, expected=fork.expected, forks=course.forks[:-1])
            else:
                break
        return course

    def forked(self, task: Task, config: ControllerConfig) -> Course:
        """Return the course within the first branch of an `if`."""
        takes_then = self._takes_then(task, config)
        last = task.index + task.then
        fork = Fork(last, last + task.otherwise, self.poses, takes_then, self.expected)
        return self._replace(expected=self.expected and takes_then, forks=(*self.forks, fork))

    def _takes_then(self, task: Task, config: ControllerConfig) -> bool:
        condition = task.action
        assert isinstance(condition, Condition)
        if condition.input is None:
            answer = dict(self.answers).get(task.asked)
            return task.first if answer is None else answer == condition.answer
        number = condition.number(config, task.place)
        return self.inputs is None or self.inputs[number - 1] is (condition.level == "on")

    @property
    def end(self) -> Pose:
        """The predicted pose after the last task."""
        return self.before(inf).poses[0]


class JobOutlook(NamedTuple):
    """The preview of a job, or of a piece of it, and the course after it."""

    preview: JobPreview
    course: Course

    @property
    def end(self) -> Pose:
        """The predicted end position."""
        return self.course.end


class PreviewSource(Protocol):
    """A source of previews of primitives: a robot, or its planner."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    def preview(self, primitive: Primitive, start: Pose, speed: float = 1.0) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`; raises the errors of running it."""
        ...


def _step_of(robot: PreviewSource, task: Task, course: Course) -> tuple[StepPreview, Course]:
    """Return the preview of a task, and the course after it; raises the errors of running it from any of its starts."""
    course = course.before(task.index)
    units, config = Units.of(robot.config), robot.config.controller
    action = task.action
    if isinstance(action, Statement):
        action.checked(config, task.place)
        duration, phases, after = action.duration, _phases(action), course
        if isinstance(action, Condition):
            after = course.forked(task, config)
            phases = (PhasePreview(THEN if after.forks[-1].takes_then else ELSE, 0.0),)
        step = PrimitivePreview(duration, phases, None, None, course.poses[0])
        return _step(task, step, units, expected=course.expected), after
    found = [robot.preview(action, pose, task.speed) for pose in course.poses]
    ends = tuple(dict.fromkeys(one.end for one in found))
    if len(ends) > MOST_POSES:
        raise InvalidJob(
            key=task.key, reason=phrase("it may end in more than {most} poses; go to one place before", most=MOST_POSES)
        )
    return _step(task, found[0], units, expected=course.expected), course._replace(poses=ends)


def _phases(statement: Statement) -> tuple[PhasePreview, ...]:
    return (PhasePreview(statement.command, statement.duration),)


def require_channels(tasks: Sequence[Task], config: Config) -> None:
    """Raise `InvalidJob` for the first statement with an output or input that the configuration lacks."""
    for task in tasks:
        if isinstance(task.action, Statement):
            task.action.checked(config.controller, task.place)


def preview_tasks(robot: PreviewSource, tasks: Sequence[Task], start: Course) -> Generator[None, None, JobOutlook]:
    """Return the preview of `tasks` from `start`, and the course after them.

    Both branches of an `if` are checked, and later steps from every pose in which they may begin. Yields after every
    step, so that other tasks may run.
    """
    course = start
    steps: list[StepPreview] = []
    refusal: Refusal | None = None
    for task in tasks:
        try:
            step, course = _step_of(robot, task, course)
        except RequestError as error:
            refusal = Refusal(task.index, task.key, task.label, Notice(error.code, str(error)))
            break
        steps.append(step)
        yield
    return JobOutlook(_preview(steps, refusal), course)


def joined_outlook(courses: Sequence[JobOutlook], start: Course) -> JobOutlook:
    """Combine outlooks, each from the end of the one before; without any, the result ends at `start`."""
    if len(courses) == 1:
        return courses[0]
    steps = [step for course in courses for step in course.preview.steps]
    refusal = courses[-1].preview.refusal if courses else None
    return JobOutlook(_preview(steps, refusal), courses[-1].course if courses else start)


def _preview(steps: Sequence[StepPreview], refusal: Refusal | None) -> JobPreview:
    return JobPreview(
        duration=sum(step.duration for step in steps if step.expected and step.duration is not None),
        lowest=min((step.lowest for step in steps if step.lowest is not None), default=None),
        highest=max((step.highest for step in steps if step.highest is not None), default=None),
        steps=tuple(steps),
        refusal=refusal,
    )


def _step(task: Task, step: PrimitivePreview, units: Units, *, expected: bool) -> StepPreview:
    return StepPreview(
        index=task.index,
        key=task.key,
        step=task.label,
        duration=step.duration,
        phases=step.phases,
        lowest=step.lowest,
        highest=step.highest,
        end_counts=None if step.end.joints is None else units.to_counts(step.end.joints),
        expected=expected,
    )


class InspectionSource(PreviewSource, Protocol):
    """A source of details of primitives."""

    def inspect(
        self, primitive: Primitive, start: Pose, samples: int = 200, speed: float = 1.0
    ) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and its end pose."""
        ...


def inspect_tasks(
    robot: InspectionSource, tasks: Sequence[Task], start: Course, samples: int, most: float = inf
) -> Generator[None, None, JobInspection]:
    """Return the details of the expected `tasks` from `start` up to the first refused one; yields after every step.

    Every motion has `samples` samples. Raises `TooLarge` for more than `most` in all.
    """
    preview = (yield from preview_tasks(robot, tasks, start)).preview
    found = _Collected()
    pose = start.poses[0]
    for task, step in zip(tasks, preview.steps, strict=False):
        action = task.action
        if not step.expected:
            continue
        if isinstance(action, Statement):
            details = [ActionDetail(_phases(action), action.duration, None)]
        else:
            details, pose = robot.inspect(action, pose, samples, task.speed)
        for detail in details:
            found.add(task.index, detail)
        if len(found.inspections) * samples > most:
            raise TooLarge(most=phrase("{most:d} samples", most=most))
        yield
    return JobInspection(
        preview,
        tuple(found.bands),
        _least(found.closest),
        max((motion.stopping.time for motion in found.inspections), default=0.0),
        max((motion.stopping.distance for motion in found.inspections), default=0.0),
        tuple(found.motions),
    )


class _Collected:
    """The results of a job's actions, one after the other."""

    def __init__(self) -> None:
        self.now = 0.0
        self.bands: list[Band] = []
        self.closest: list[Nearest] = []
        self.motions: list[Samples] = []
        self.inspections: list[Inspection] = []

    def add(self, step: int, detail: ActionDetail) -> None:
        """Add an action that begins now."""
        if detail.motion is not None:
            self._add_motion(step, detail.motion)
        for name, duration in detail.phases:
            end = self.now + (duration or 0.0)
            self.bands.append(Band(step, name, self.now, end))
            self.now = end

    def _add_motion(self, step: int, motion: Inspection) -> None:
        self.inspections.append(motion)
        self.closest += [_of_job(near, step, self.now) for near in motion.closest]
        joints = [(a, b, c) for a, b, c in motion.trajectory.joints.tolist()]
        velocity = [(a, b, c) for a, b, c in motion.trajectory.velocity.tolist()]
        times = (self.now + motion.trajectory.time).tolist()
        self.motions.append(Samples(step, tuple(times), tuple(joints), tuple(velocity)))


def _of_job(near: Closest, step: int, begun: float) -> Nearest:
    return Nearest(near.name, near.margin, near.unit, near.zone, step, begun + near.time)


def _least(found: Iterable[Nearest]) -> tuple[Nearest, ...]:
    """Return the least margin of every name, limits first, in the order of the motions."""
    least: dict[tuple[bool, str], Nearest] = {}
    for near in found:
        known = least.get((near.zone, near.name))
        if known is None or near.margin < known.margin:
            least[near.zone, near.name] = near
    return tuple(sorted(least.values(), key=lambda near: near.zone))


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
        if not isinstance(action, Statement):
            pose = on_paper(workspace).preview(action, pose).end
        yield
    if isinstance(last, Statement):
        return ()
    found = on_paper(workspace).plan(last, pose)
    yield
    return gripper_path(workspace, found, most)


def require(workspace: Workspace, tasks: Sequence[Task], start: Course) -> Generator[None, None, Course]:
    """Return the course after some tasks; raises the error of the first task that would be refused."""
    course = start
    for task in tasks:
        _, course = _step_of(on_paper(workspace), task, course)
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
                _, course = _step_of(self._robot, task, course)
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
            return pickle.dumps(error)
        if taught is not self._sealed[0]:
            self._sealed = (taught, pickle.dumps(taught, pickle.HIGHEST_PROTOCOL))
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
