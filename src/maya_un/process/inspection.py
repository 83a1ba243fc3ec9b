"""A whole job in detail, before its first step: profiles of the axes, least margins, longest stop."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from math import inf
from typing import Protocol

from maya_un.controller.inspection import Closest, Inspection
from maya_un.errors import TooLarge
from maya_un.process.preview import PreviewSource, walked
from maya_un.process.tasks import Task
from maya_un.robot.plan import ActionDetail, Pose
from maya_un.robot.primitives import Primitive
from maya_un.schema.previews import Band, JobInspection, Nearest, Samples


class Inspected(PreviewSource, Protocol):
    """A source of details of primitives."""

    def inspect(self, primitive: Primitive, start: Pose, samples: int = 200) -> tuple[list[ActionDetail], Pose]:
        """Return the details of every action of `primitive` from `start`, and where it ends."""
        ...


def inspected(
    robot: Inspected, tasks: Sequence[Task], start: Pose, samples: int, most: float = inf
) -> Generator[None, None, JobInspection]:
    """Return the details of `tasks` from `start` up to the first that is refused; yields after every step.

    Every motion has so many `samples`. Raises `TooLarge` for more than `most` in all.
    """
    preview = (yield from walked(robot, tasks, start)).preview
    found = _Collected()
    pose = start
    for task in tasks[: len(preview.steps)]:
        details, pose = robot.inspect(task.primitive, pose, samples)
        for detail in details:
            found.add(task.index, detail)
        if len(found.inspections) * samples > most:
            raise TooLarge(most=f"{most} samples")
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
    """Return the least of every name, limits first, in the order in which the motions name them."""
    least: dict[tuple[bool, str], Nearest] = {}
    for near in found:
        known = least.get((near.zone, near.name))
        if known is None or near.margin < known.margin:
            least[near.zone, near.name] = near
    return tuple(sorted(least.values(), key=lambda near: near.zone))
