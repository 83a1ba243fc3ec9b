"""The outlook of tasks: previews, margins and refusals, through both branches of each `if`.

A step is planned from every pose in which it may begin. The prediction follows one of the branches: that of the present
inputs and of given answers, else of the first answers.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from math import inf
from typing import NamedTuple, Protocol

from dmc41x3.i18n import phrase
from maya_un.config import Config, ControllerConfig, Units
from maya_un.controller.protocol import Closest, Inspection
from maya_un.errors import InvalidJob, RequestError, TooLarge
from maya_un.process.spec.statements import ELSE, THEN, Condition, JobStatement
from maya_un.process.spec.tasks import Task
from maya_un.robot.plan_builder import ActionDetail, Pose, PrimitivePreview
from maya_un.robot.primitives import Primitive
from maya_un.schema.previews import (
    Band,
    JobInspection,
    JobPreview,
    Nearest,
    PhasePreview,
    Refusal,
    Samples,
    StepPreview,
)
from maya_un.values import Notice

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
    """The poses in which the next task of a job may begin; if `expected`, the first is the predicted one.

    `expected` is whether the prediction reaches this task. `inputs` are the present digital inputs, None if unknown.
    `answers` are those to earlier questions, by task. `forks` are the open branches, the innermost last.
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


def step_of(robot: PreviewSource, task: Task, course: Course) -> tuple[StepPreview, Course]:
    """Return the preview of a task, and the course after it; raises the errors of running it from any of its starts."""
    course = course.before(task.index)
    units, config = Units.of(robot.config), robot.config.controller
    action = task.action
    if isinstance(action, JobStatement):
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
            key=task.key,
            reason=phrase("the robot can be in more than {most} poses here; move to one place before", most=MOST_POSES),
        )
    return _step(task, found[0], units, expected=course.expected), course._replace(poses=ends)


def _phases(statement: JobStatement) -> tuple[PhasePreview, ...]:
    return (PhasePreview(statement.command, statement.duration),)


def require_channels(tasks: Sequence[Task], config: Config) -> None:
    """Raise `InvalidJob` for the first statement with an output or input that the configuration lacks."""
    for task in tasks:
        if isinstance(task.action, JobStatement):
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
            step, course = step_of(robot, task, course)
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
        if isinstance(action, JobStatement):
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
