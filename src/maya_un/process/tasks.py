"""The tasks of a job: one for each step, cell and round, with names resolved to points.

A part is where it stood at the start until it is placed, then where it was placed; so a job may be repeated, and
a part may be picked by name wherever the job itself put it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from maya_un.errors import InvalidJob
from maya_un.process.job import MOST_TASKS, TOO_MANY, Job
from maya_un.process.names import NameResolver, PalletLoop, Recall
from maya_un.process.spots import Coordinates, point_of
from maya_un.process.standing import PartMap
from maya_un.process.step import ForEach, Step
from maya_un.process.taught import TaughtPlaces
from maya_un.robot.primitives import PRIMITIVES, Primitive
from maya_un.robot.primitives.arguments import JointTarget, Switch, Target
from maya_un.robot.primitives.primitive import PartEffect
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
    """All tasks of a job, and where its named parts are when all are done; None where nobody knows.

    `remarks` say what of its pallets is out of shape.
    """

    tasks: tuple[Task, ...]
    parts: dict[str, Point | None]
    remarks: tuple[str, ...] = ()


def expand(job: Job, grasp_height: float, recall: Recall = TaughtPlaces) -> Expansion:
    """Return the tasks of `job`; a place without z is at `grasp_height` [m], `recall` tells what has been taught.

    Raises `UnknownName` for a name that stands for nothing, `InvalidJob` for the pick of a part that the job dropped
    somewhere, for cells that are not there, and for more than `MOST_TASKS` tasks.
    """
    table = _PartTracker(job, grasp_height, recall)
    tasks: list[Task] = []
    for planned in table.rounds():
        if len(tasks) == MOST_TASKS:
            raise InvalidJob(key="job", reason=TOO_MANY)
        tasks.append(table.task(planned, len(tasks) + 1))
    return Expansion(tuple(tasks), table.parts, table.remarks)


def starting_parts(job: Job, grasp_height: float, recall: Recall = TaughtPlaces) -> dict[str, Point]:
    """Return where the parts of a job stand at its start [m]; raises as `expand`."""
    parts = NameResolver(job, grasp_height, recall).parts()
    return {name: place for name, place in parts.items() if place is not None}


def single(primitive: Primitive) -> Expansion:
    """Return the one task of a direct command."""
    return Expansion((Task(1, "task", primitive.words, primitive),), {})


class _Planned(NamedTuple):
    """A step on its turn: its place in the file, and the cell of the loop around it."""

    step: Step
    key: str
    loop: PalletLoop | None = None


class _PartTracker:
    """Positions of the parts while the steps are walked through."""

    def __init__(self, job: Job, grasp_height: float, recall: Recall) -> None:
        self._job = job
        self._names = NameResolver(job, grasp_height, recall)
        self._standing = PartMap(self._names.parts())
        self._grasp_height = grasp_height
        self._held: str | None = None

    @property
    def parts(self) -> dict[str, Point | None]:
        """Present positions of the parts [m]."""
        return self._standing.parts

    @property
    def remarks(self) -> tuple[str, ...]:
        """Deviations of the used pallets, in words."""
        return self._names.remarks

    def rounds(self) -> Iterator[_Planned]:
        """Yield every step of every round, those of a loop once for each of its cells."""
        for _ in range(self._job.repeat):
            for number, step in enumerate(self._job.steps):
                key = f"steps.{number}"
                if isinstance(step, Step):
                    yield _Planned(step, key)
                else:
                    yield from self._looped(step, key)

    def _looped(self, loop: ForEach, key: str) -> Iterator[_Planned]:
        for cell in self._names.cells(loop.for_each, f"{key}.for_each"):
            for number, step in enumerate(loop.do):
                yield _Planned(step, f"{key}.do.{number}", cell)

    def task(self, planned: _Planned, index: int) -> Task:
        """Return the task of a step and remember what it does to the parts."""
        held, key = self._held, planned.key
        primitive, label = self._primitive(planned)
        if primitive.part is PartEffect.TAKES:
            return Task(index, key, label, primitive, part=self._held)
        if held is None or self._held is not None:
            return Task(index, key, label, primitive)
        return Task(index, key, label, primitive, part=held, put=self.parts[held])

    def _primitive(self, planned: _Planned) -> tuple[Primitive, str]:
        """Return what a step does and how it is called, with the cells of pallets by their numbers."""
        step = planned.step
        primitive = PRIMITIVES[step.command]
        label, value = str(step), step.argument
        match primitive.argument:
            case Target():
                value, label = self._spot(step.argument, planned)
            case JointTarget() if isinstance(value, str):
                value = self._names.joints(value, f"{planned.key}.{step.command}")
            case Switch(on=on):
                value = value == on
            case _:
                pass
        task = primitive(**{primitive.argument.key: value}) if primitive.argument.key else primitive()
        self._handle(task)
        return task, label

    def _handle(self, task: Primitive) -> None:
        """Remember what a task does to the parts."""
        match task.part:
            case PartEffect.TAKES:
                self._held = self._standing.at(task.value)
            case PartEffect.PUTS:
                self._let_go(task.value)
            case PartEffect.SETS_GRIPPER if task.value:
                self._let_go(None)
            case _:
                pass

    def _let_go(self, where: Point | None) -> None:
        if self._held is not None:
            self._standing.put(self._held, where)
        self._held = None

    def _spot(self, spot: str | Coordinates, planned: _Planned) -> tuple[Point, str]:
        step = planned.step
        if not isinstance(spot, str):
            return point_of(spot, self._grasp_height), str(step)
        key = f"{planned.key}.{step.command}"
        point, name = self._names.spot(spot, self.parts, planned.loop, key, step.command)
        return point, f"{step.command} {name}"
