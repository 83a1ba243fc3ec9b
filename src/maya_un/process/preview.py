"""The whole job worked out before its first step: how long, how low, and whether any step would be refused."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import NamedTuple, Protocol

from maya_un.config import Config, Units
from maya_un.errors import RequestError
from maya_un.process.tasks import Task
from maya_un.robot.plan import Pose, PrimitivePreview
from maya_un.robot.primitives import Primitive
from maya_un.schema.previews import JobPreview, Refusal, StepPreview
from maya_un.values import Notice


class JobOutlook(NamedTuple):
    """The preview of a job and its end position, or its refusal."""

    preview: JobPreview
    end: Pose


class PreviewSource(Protocol):
    """A source of previews of primitives: a robot, or its planner."""

    @property
    def config(self) -> Config:
        """The machine's constants."""
        ...

    def preview(self, primitive: Primitive, start: Pose) -> PrimitivePreview:
        """Return the preview of `primitive` from `start`; raises what running it would."""
        ...


def walked(robot: PreviewSource, tasks: Sequence[Task], start: Pose) -> Generator[None, None, JobOutlook]:
    """Return what `tasks` will be from `start`, and where they end; yields after every step, so that others may run."""
    units = Units.of(robot.config)
    pose = start
    steps: list[StepPreview] = []
    refusal: Refusal | None = None
    for task in tasks:
        try:
            step = robot.preview(task.primitive, pose)
        except RequestError as error:
            refusal = Refusal(task.index, task.key, task.label, Notice(error.code, str(error)))
            break
        steps.append(_step(task, step, units))
        pose = step.end
        yield
    return JobOutlook(_preview(steps, refusal), pose)


def course_of(courses: Sequence[JobOutlook], start: Pose) -> JobOutlook:
    """Return courses, each from the end of the one before, as one; without any it ends at `start`."""
    if len(courses) == 1:
        return courses[0]
    steps = [step for course in courses for step in course.preview.steps]
    refusal = courses[-1].preview.refusal if courses else None
    return JobOutlook(_preview(steps, refusal), courses[-1].end if courses else start)


def _preview(steps: Sequence[StepPreview], refusal: Refusal | None) -> JobPreview:
    return JobPreview(
        duration=sum(step.duration for step in steps if step.duration is not None),
        lowest=min((step.lowest for step in steps if step.lowest is not None), default=None),
        highest=max((step.highest for step in steps if step.highest is not None), default=None),
        steps=tuple(steps),
        refusal=refusal,
    )


def _step(task: Task, step: PrimitivePreview, units: Units) -> StepPreview:
    return StepPreview(
        index=task.index,
        key=task.key,
        step=task.label,
        duration=step.duration,
        phases=step.phases,
        lowest=step.lowest,
        highest=step.highest,
        end_counts=None if step.end.joints is None else units.to_counts(step.end.joints),
    )
