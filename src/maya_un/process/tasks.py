"""What a job comes to: one task a step and round, names resolved to points.

A part is where it stood at the start until it is placed, then where it was placed; so a job may be repeated, and
a part may be picked by name wherever the job itself put it.
"""

from __future__ import annotations

from dataclasses import dataclass

from maya_un.errors import InvalidJob, UnknownName
from maya_un.process.job import Coordinates, Job, Step, point_of
from maya_un.robot.approach import Approach
from maya_un.robot.gripper import Gripper
from maya_un.robot.home import Home
from maya_un.robot.move import MoveJoints
from maya_un.robot.pick import Pick
from maya_un.robot.place import Place
from maya_un.robot.primitives import Primitive
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class Task:
    """One step of one round: `index` counts from 1 over all rounds, `key` is its place in the file.

    `part` is the named part that it takes or lets go, `put` where it puts that down [m], None where nobody knows.
    """

    index: int
    key: str
    label: str
    primitive: Primitive
    part: str | None = None
    put: Point | None = None


@dataclass(frozen=True, slots=True)
class Expansion:
    """All tasks of a job, and where its named parts are when all are done; None where nobody knows."""

    tasks: tuple[Task, ...]
    parts: dict[str, Point | None]


def expand(job: Job, grasp_height: float) -> Expansion:
    """Return the tasks of `job`; a place without z is at `grasp_height` [m].

    Raises `UnknownName` for a name that is neither part nor place, `InvalidJob` for the pick of a part that the
    job dropped somewhere.
    """
    table = _Table(job, grasp_height)
    named = [(step, f"steps.{number}", str(step)) for number, step in enumerate(job.steps)]
    rounds = (named_step for _ in range(job.repeat) for named_step in named)
    tasks = tuple(table.task(step, index, key, label) for index, (step, key, label) in enumerate(rounds, 1))
    return Expansion(tasks, table.parts)


def single(primitive: Primitive) -> Expansion:
    """Return the one task of a direct wish."""
    words = [f"{value:g}" if isinstance(value, float) else str(value) for value in _arguments(primitive)]
    return Expansion((Task(1, "task", " ".join((primitive.command, *words)), primitive),), {})


def _arguments(primitive: Primitive) -> tuple[object, ...]:
    match primitive:
        case Gripper(open_):
            return ("open" if open_ else "close",)
        case MoveJoints(joints):
            return joints
        case Approach(target) | Pick(target) | Place(target):
            return target
        case _:
            return ()


class _Table:
    """Where the parts are while the steps are walked through."""

    def __init__(self, job: Job, grasp_height: float) -> None:
        self.parts: dict[str, Point | None] = {**job.part_points(grasp_height)}
        self._places = job.place_points(grasp_height)
        self._grasp_height = grasp_height
        self._held: str | None = None

    def task(self, step: Step, index: int, key: str, label: str) -> Task:
        """Return the task of a step and remember what it does to the parts."""
        held = self._held
        primitive = self._primitive(step, key)
        if isinstance(primitive, Pick):
            return Task(index, key, label, primitive, part=self._held)
        if held is None or self._held is not None:
            return Task(index, key, label, primitive)
        return Task(index, key, label, primitive, part=held, put=self.parts[held])

    def _primitive(self, step: Step, key: str) -> Primitive:
        if step.pick is not None:
            target = self._point(step.pick, f"{key}.pick")
            self._held = next((name for name, place in self.parts.items() if place == target), None)
            return Pick(target)
        if step.place is not None:
            target = self._point(step.place, f"{key}.place")
            self._let_go(target)
            return Place(target)
        if step.approach is not None:
            return Approach(self._point(step.approach, f"{key}.approach"))
        if step.gripper is not None:
            if step.gripper == "open":
                self._let_go(None)
            return Gripper(step.gripper == "open")
        return MoveJoints(step.move) if step.move is not None else Home()

    def _let_go(self, where: Point | None) -> None:
        if self._held is not None:
            self.parts[self._held] = where
        self._held = None

    def _point(self, spot: str | Coordinates, key: str) -> Point:
        if not isinstance(spot, str):
            return point_of(spot, self._grasp_height)
        if spot not in self.parts and spot not in self._places:
            known = ", ".join((*self.parts, *self._places)) or "no parts and no places"
            raise UnknownName(name=spot, known=known, key=key)
        point = self._places[spot] if spot in self._places else self.parts[spot]
        if point is None:
            raise InvalidJob(key=key, reason=f"nobody knows where {spot!r} is since the gripper was opened on it")
        return point
