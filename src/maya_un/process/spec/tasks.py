"""The tasks of a job with all places resolved.

Expand a job to its tasks: one for each step, cell and round, with names resolved to points.

Names are looked up in this order: parts, places, cells of pallets, taught poses.

A part is at its starting place until it is placed, then where it was placed. So a job may be repeated, and a part may
be picked by name wherever the job itself put it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import dist
from typing import NamedTuple, NoReturn

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidJob, InvalidValue, UnknownName
from maya_un.process.spec.job import (
    MOST_TASKS,
    TOO_MANY,
    Coordinates,
    ForEach,
    IfElse,
    Job,
    Step,
    point_of,
    step_text,
)
from maya_un.process.spec.pallet import EACH, NEXT, Cell, CellReference, Pallet, cell_text, chosen_cells, read_reference
from maya_un.process.spec.poses import TaughtPlaces
from maya_un.process.spec.statements import ELSE, STATEMENTS, THEN, AskOperator, Condition, JobStatement
from maya_un.robot.primitives import PRIMITIVES, Primitive
from maya_un.robot.primitives.primitive import JointTarget, PartEffect, Switch, Target
from maya_un.values import Joints, Point

SAME_PLACE = 1e-6
"""Places nearer to each other than this [m] are equal: the gripper moves less by one count of any axis."""

_GRAIN = 1e-4
_FAR = 1e6
"""Parts farther away than this [m] are out of reach, and are distinguished by their distance alone."""

_Square = tuple[int, ...]

Action = Primitive | JobStatement
"""The action of a step: a primitive of the robot, or a statement."""

ACTIONS: Mapping[str, type[Action]] = {**PRIMITIVES, **STATEMENTS, Condition.command: Condition}
"""The actions by their names."""


class PartMap:
    """Parts by their names and by their places [m]; `parts` holds None for a part whose place is unknown."""

    def __init__(self, parts: dict[str, Point | None]) -> None:
        self.parts = parts
        self._order = {name: number for number, name in enumerate(parts)}
        self._there: defaultdict[_Square, set[str]] = defaultdict(set)
        for name, place in parts.items():
            self._enter(name, place)

    def at(self, place: Point) -> str | None:
        """Return the part at a place, within rounding; if several stand there, the first named. None without one."""
        around = product(*({_square(value - SAME_PLACE), _square(value + SAME_PLACE)} for value in place))
        near = (name for square in around for name in self._there.get(square, ()))
        return min((name for name in near if self._stands(name, place)), key=self._order.__getitem__, default=None)

    def put(self, name: str, place: Point | None) -> None:
        """Set the place of a part; None means unknown."""
        old = self.parts[name]
        if old is not None:
            self._there[tuple(map(_square, old))].discard(name)
        self.parts[name] = place
        self._enter(name, place)

    def _enter(self, name: str, place: Point | None) -> None:
        if place is not None:
            self._there[tuple(map(_square, place))].add(name)

    def _stands(self, name: str, place: Point) -> bool:
        here = self.parts[name]
        return here is not None and dist(here, place) < SAME_PLACE


class HandledParts:
    """Parts by name, which the gripper takes and releases; `held` is the part in the gripper, None without one."""

    def __init__(self, parts: dict[str, Point | None]) -> None:
        self._standing = PartMap(parts)
        self.held: str | None = None

    @property
    def places(self) -> dict[str, Point | None]:
        """The places of the parts [m]; the one of a held part is its last."""
        return self._standing.parts

    def handle(self, action: Action) -> None:
        """Apply the effect of a done action."""
        if isinstance(action, JobStatement):
            return
        match action.part:
            case PartEffect.TAKES:
                self.held = self._standing.at(action.value)
            case PartEffect.PUTS:
                self.release(action.value)
            case PartEffect.SETS_GRIPPER if action.value:
                self.release(None)
            case _:
                pass

    def release(self, place: Point | None) -> None:
        """Release the held part at a place, None for an unknown one."""
        if self.held is not None:
            self._standing.put(self.held, place)
        self.held = None


def _square(value: float) -> int:
    return round(max(-_FAR, min(_FAR, value)) / _GRAIN)


Recall = Callable[[], TaughtPlaces]
"""Returns the taught places; called only for a name that the job does not define."""


class NamedPlace(NamedTuple):
    """A place and its name."""

    point: Point
    name: str


class PalletLoop(NamedTuple):
    """The current cell of a loop over a pallet."""

    pallet: str
    cell: Cell


class NameResolver:
    """Resolves the names of one job, and remembers which cells it has used."""

    def __init__(self, job: Job, grasp_height: float, recall: Recall) -> None:
        self._job = job
        self._grasp_height = grasp_height
        self._recall = recall
        self._places = job.place_points(grasp_height)
        self._pallets: dict[str, Pallet] = {}
        self._used: defaultdict[tuple[str, str], set[Cell]] = defaultdict(set)
        self._ahead: dict[tuple[str, str], Iterator[Cell]] = {}

    @cached_property
    def _taught(self) -> TaughtPlaces:
        return self._recall()

    def parts(self) -> dict[str, Point | None]:
        """Return the starting places of parts: named ones, and those on full pallets under their cells' names.

        Raises `InvalidJob` if a part has the name of such a cell.
        """
        parts: dict[str, Point | None] = {**self._job.part_points(self._grasp_height)}
        for name, grid in self._job.pallets.items():
            if grid.full:
                pallet = self._pallet(name, f"pallets.{name}")
                cells = {cell_text(name, cell): pallet.place(cell) for cell in pallet.cells()}
                for both in sorted(cells.keys() & parts.keys()):
                    raise InvalidJob(key=f"parts.{both}", reason="a cell of a full pallet already has this name")
                parts |= cells
        return parts

    @property
    def used(self) -> dict[tuple[str, str], set[Cell]]:
        """A copy of the used cells, by pallet and command."""
        return {key: set(cells) for key, cells in self._used.items()}

    @used.setter
    def used(self, used: Mapping[tuple[str, str], set[Cell]]) -> None:
        self._used = defaultdict(set, {key: set(cells) for key, cells in used.items()})
        self._ahead.clear()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks about the shapes of the used pallets."""
        pallets = self._pallets.items()
        return tuple(f"{name}: {remark}" for name, pallet in pallets for remark in pallet.shape.remarks)

    def joints(self, name: str, key: str) -> Joints:
        """Return the joints of a taught pose (rad, m, m); raises `UnknownName`."""
        if name not in self._taught.poses:
            raise UnknownName(name=name, known=", ".join(self._taught.poses) or "no taught poses", key=key)
        return self._taught.poses[name].joints

    def cells(self, text: str, key: str) -> tuple[PalletLoop, ...]:
        """Return the cells of a loop; raises `InvalidJob` and `UnknownName`."""
        reference = read_reference(text) or CellReference(text, (None, None))
        if reference.pallet not in self._job.pallets and reference.pallet not in self._taught.pallets:
            known = (*self._job.pallets, *self._taught.pallets)
            raise UnknownName(name=text, known=", ".join(known) or "no pallets", key=key)
        pallet = self._pallet(reference.pallet, key)
        if isinstance(reference.which, str):
            raise InvalidJob(
                key=key,
                reason=phrase("a loop goes through {pallet}, not through {text}", pallet=reference.pallet, text=text),
            )
        found = chosen_cells(reference, pallet)
        if not found:
            raise InvalidJob(key=key, reason=phrase("there is no {text}: {extent}", text=text, extent=pallet.extent))
        return tuple(PalletLoop(reference.pallet, cell) for cell in found)

    def spot(
        self, text: str, parts: Mapping[str, Point | None], loop: PalletLoop | None, key: str, command: str
    ) -> NamedPlace:
        """Return the place that a name stands for in a step `command`, with `parts` at their present places.

        Raises `UnknownName`, and `InvalidJob` for a part whose place is unknown and for a cell that does not exist.
        """
        if text in self._job.parts:
            return NamedPlace(self._part(text, parts[text], key), text)
        if text in self._places:
            return NamedPlace(self._places[text], text)
        reference = read_reference(text)
        if reference is not None and self._is_pallet(reference.pallet):
            return self._on_pallet(reference, self._cell(reference, loop, key, command), key, command)
        return NamedPlace(self._pose(text, key), text)

    def _on_pallet(self, reference: CellReference, cell: Cell, key: str, command: str) -> NamedPlace:
        self._used[reference.pallet, command].add(cell)
        name = cell_text(reference.pallet, cell)
        try:
            return NamedPlace(self._pallet(reference.pallet, key).place(cell), name)
        except ValueError as error:
            raise InvalidJob(key=key, reason=phrase("there is no {name}: {error}", name=name, error=error)) from error

    def _part(self, name: str, place: Point | None, key: str) -> Point:
        if place is None:
            raise InvalidJob(
                key=key,
                reason=phrase(
                    "the place of {name!r} is unknown: the gripper was opened on it, or the branches of an `if` differ",
                    name=name,
                ),
            )
        return place

    def _pose(self, name: str, key: str) -> Point:
        if self._is_pallet(name):
            raise InvalidJob(
                key=key,
                reason=phrase("{name} is a pallet; name a cell: {name}[1,1] or {name}[{next}]", name=name, next=NEXT),
            )
        if name not in self._taught.poses:
            self._unknown(name, key)
        point = self._taught.poses[name].point
        if point is None:
            raise InvalidJob(key=key, reason=phrase("the lines of {name!r} cannot meet; teach it again", name=name))
        return point

    def _unknown(self, name: str, key: str) -> NoReturn:
        pallets = (f"{pallet}[row,column]" for pallet in (*self._job.pallets, *self._taught.pallets))
        known = (*self._job.parts, *self._job.places, *pallets, *self._taught.poses)
        raise UnknownName(name=name, known=", ".join(known) or "no parts and no places", key=key)

    def _is_pallet(self, name: str) -> bool:
        return name in self._job.pallets or name in self._taught.pallets

    def _pallet(self, name: str, key: str) -> Pallet:
        if name not in self._pallets:
            self._pallets[name] = self._spanned(name, key)
        return self._pallets[name]

    def _spanned(self, name: str, key: str) -> Pallet:
        try:
            if name not in self._job.pallets:
                return self._taught.pallet(name, self._grasp_height)
            grid = self._job.pallets[name]
            corners = [self._corner(corner, f"pallets.{name}.corners.{n}") for n, corner in enumerate(grid.corners)]
            return Pallet.spanned(corners, grid.rows, grid.columns)
        except (ValueError, InvalidValue) as error:
            reason = error.details["reason"] if isinstance(error, InvalidValue) else str(error)
            raise InvalidJob(key=f"pallets.{name}" if name in self._job.pallets else key, reason=str(reason)) from error

    def _corner(self, corner: str | Coordinates, key: str) -> Point:
        if not isinstance(corner, str):
            return point_of(corner, self._grasp_height)
        return self._places[corner] if corner in self._places else self._pose(corner, key)

    def _cell(self, reference: CellReference, loop: PalletLoop | None, key: str, command: str) -> Cell:
        name = reference.pallet
        if reference.which == EACH:
            if loop is None or loop.pallet != name:
                raise InvalidJob(
                    key=key,
                    reason=phrase("{name}[{each}] is for the steps of a loop over {name}", name=name, each=EACH),
                )
            return loop.cell
        if reference.which == NEXT:
            return self._next(name, key, command)
        cell = reference.cell
        if cell is None:
            raise InvalidJob(key=key, reason=phrase("a step goes to one cell of {name}; * is for loops", name=name))
        return cell

    def _next(self, name: str, key: str, command: str) -> Cell:
        """Return the first cell of a pallet that no step `command` has used; raises `InvalidJob`."""
        if PRIMITIVES[command].harmless():
            raise InvalidJob(
                key=key,
                reason=phrase(
                    "only pick and place take {name}[{next}]; each counts its own cells", name=name, next=NEXT
                ),
            )
        pallet = self._pallet(name, key)
        ahead = self._ahead.setdefault((name, command), pallet.cells())
        used = self._used[name, command]
        free = next((cell for cell in ahead if cell not in used), None)
        if free is None:
            raise InvalidJob(
                key=key,
                reason=phrase(
                    "all {count} cells of {name} have had their {command} already",
                    count=len(pallet),
                    name=name,
                    command=command,
                ),
            )
        return free


@dataclass(frozen=True, slots=True)
class Task:
    """One step of one round: `index` counts from 1 over all rounds, `key` is its place in the file.

    `part` is the named part that it takes or releases, `put` the place of that release [m], None if unknown. `speed` is
    the share of the limits at which it travels, above 0 up to 1.

    An `if` is followed by the tasks of its branches, `then` of the one and `otherwise` of the other. `asked` is the
    index of the question whose answer it reads, 0 for an input, and `first` whether it reads the first answer.
    """

    index: int
    key: str
    label: str
    action: Action
    part: str | None = None
    put: Point | None = None
    speed: float = 1.0
    then: int = 0
    otherwise: int = 0
    asked: int = 0
    first: bool = True

    def branch(self, name: str) -> range:
        """Return the indices of the tasks of a branch of an `if`, `then` or `else`."""
        begin = self.index + 1
        return range(begin, begin + self.then) if name == THEN else range(begin + self.then, begin + self.branches)

    @property
    def branches(self) -> int:
        """The number of tasks of both branches of an `if`, 0 for another task."""
        return self.then + self.otherwise

    @property
    def place(self) -> str:
        """The key of its value in the file."""
        return f"{self.key}.{self.action.command}"


@dataclass(frozen=True, slots=True)
class Expansion:
    """All tasks of a job, and the places of its named parts after them; None if unknown.

    `remarks` are the deviations in shape of its pallets, and the waits that no prediction contains; `start` the places
    of its parts before the tasks.
    """

    tasks: tuple[Task, ...]
    parts: dict[str, Point | None]
    remarks: tuple[str, ...] = ()
    start: dict[str, Point | None] = field(default_factory=dict[str, Point | None])


def expand(job: Job, grasp_height: float, recall: Recall = TaughtPlaces) -> Expansion:
    """Return the tasks of `job`; a place without z is at `grasp_height` [m], `recall` returns the taught places.

    Raises `UnknownName` for an unknown name, `InvalidJob` for the pick of a part that the job dropped somewhere, for
    cells that do not exist, and for more than `MOST_TASKS` tasks.
    """
    table = _PartTracker(job, grasp_height, recall)
    for _ in range(job.repeat):
        table.expand(job.steps, "steps")
    return Expansion(tuple(table.tasks), table.parts, (*table.remarks, *_waits(table.tasks)), table.start)


def _waits(tasks: Sequence[Task]) -> Iterator[str]:
    """Yield a remark for every statement that waits for a person or for an input, once for all rounds."""
    found: dict[str, Task] = {}
    for task in tasks:
        if isinstance(task.action, JobStatement) and task.action.remark:
            found.setdefault(task.key, task)
    for task in found.values():
        assert isinstance(task.action, JobStatement)
        yield phrase("step {number}: {remark}", number=task.index, remark=task.action.remark)


def starting_parts(job: Job, grasp_height: float, recall: Recall = TaughtPlaces) -> dict[str, Point]:
    """Return the places of a job's parts at its start [m]; raises as `expand`."""
    parts = NameResolver(job, grasp_height, recall).parts()
    return {name: place for name, place in parts.items() if place is not None}


def single(primitive: Primitive) -> Expansion:
    """Return the one task of a direct command."""
    return Expansion((Task(1, "task", primitive.words, primitive),), {})


class _Planned(NamedTuple):
    """A step to be done: its place in the file, and the cell of the loop around it."""

    step: Step
    key: str
    loop: PalletLoop | None = None


class _Situation(NamedTuple):
    """The places of the parts [m], the held part, the used cells and the last question, at one point of a job."""

    parts: dict[str, Point | None]
    held: str | None
    used: dict[tuple[str, str], set[Cell]]
    asked: Task | None

    def merged(self, other: _Situation, asked: Task | None) -> _Situation:
        """Return what is certain after two branches: the place of a part is unknown where they differ."""
        parts = {name: place if _same(place, other.parts[name]) else None for name, place in self.parts.items()}
        if self.held != other.held:
            parts |= dict.fromkeys([name for name in (self.held, other.held) if name is not None])
        used = {key: self.used.get(key, set()) | other.used.get(key, set()) for key in self.used | other.used}
        return _Situation(parts, self.held if self.held == other.held else None, used, asked)


def _same(one: Point | None, other: Point | None) -> bool:
    return one is not None and other is not None and dist(one, other) < SAME_PLACE


class _PartTracker:
    """Positions of the parts during the expansion of the steps."""

    def __init__(self, job: Job, grasp_height: float, recall: Recall) -> None:
        self._job = job
        self._names = NameResolver(job, grasp_height, recall)
        self.start = self._names.parts()
        self._handled = HandledParts(dict(self.start))
        self._grasp_height = grasp_height
        self._asked: Task | None = None
        self.tasks: list[Task] = []

    @property
    def parts(self) -> dict[str, Point | None]:
        """Present positions of the parts [m]."""
        return self._handled.places

    @property
    def remarks(self) -> tuple[str, ...]:
        """Deviations of the used pallets, in words."""
        return self._names.remarks

    def expand(self, steps: Sequence[Step | ForEach | IfElse], key: str, loop: PalletLoop | None = None) -> None:
        """Append the tasks of steps at `key`: of a loop for each of its cells, of an `if` those of both branches."""
        for number, step in enumerate(steps):
            place = f"{key}.{number}"
            match step:
                case ForEach():
                    for cell in self._names.cells(step.for_each, f"{place}.for_each"):
                        self.expand(step.do, f"{place}.do", cell)
                case IfElse():
                    self._branch(step, place, loop)
                case _:
                    self._append(self.task(_Planned(step, place, loop), len(self.tasks) + 1))

    def _append(self, task: Task) -> None:
        if len(self.tasks) == MOST_TASKS:
            raise InvalidJob(key="job", reason=TOO_MANY)
        self.tasks.append(task)
        if isinstance(task.action, AskOperator):
            self._asked = task

    def _branch(self, step: IfElse, key: str, loop: PalletLoop | None) -> None:
        """Append an `if` and both branches, each with the parts as they are before it."""
        place = len(self.tasks)
        self._append(self._condition(step.condition, key, place + 1))
        before = self._situation()
        self.expand(step.then, f"{key}.{THEN}", loop)
        then, middle = self._situation(), len(self.tasks)
        self._take_up(before)
        self.expand(step.otherwise, f"{key}.{ELSE}", loop)
        self._take_up(then.merged(self._situation(), before.asked))
        counts = (middle - place - 1, len(self.tasks) - middle)
        self.tasks[place] = replace(self.tasks[place], then=counts[0], otherwise=counts[1])

    def _condition(self, condition: Condition, key: str, index: int) -> Task:
        """Return the task of an `if`; raises `InvalidJob` for an answer that no question before it offers."""
        task = Task(index, key, condition.words, condition)
        if condition.answer is None:
            return task
        asked = self._asked
        if asked is None or not isinstance(asked.action, AskOperator):
            raise InvalidJob(key=task.place, reason="no step before it asks a question")
        if condition.answer not in asked.action.choices:
            choices = ", ".join(asked.action.choices)
            raise InvalidJob(key=task.place, reason=phrase("the answers before it are {choices}", choices=choices))
        return replace(task, asked=asked.index, first=condition.answer == asked.action.choices[0])

    def _situation(self) -> _Situation:
        return _Situation(dict(self.parts), self._handled.held, self._names.used, self._asked)

    def _take_up(self, situation: _Situation) -> None:
        self._handled = HandledParts(dict(situation.parts))
        self._handled.held = situation.held
        self._names.used = situation.used
        self._asked = situation.asked

    def task(self, planned: _Planned, index: int) -> Task:
        """Return the task of a step and apply its effect on the parts."""
        held, step = self._handled.held, planned.step
        action, label = self._action(planned)
        speed = 1.0 if step.speed is None else step.speed
        label = label if step.speed is None else f"{label} at {step.speed:.0%}"
        task = Task(index, planned.key, label, action, speed=speed)
        if action.part is PartEffect.TAKES:
            return replace(task, part=self._handled.held)
        if held is None or self._handled.held is not None:
            return task
        return replace(task, part=held, put=self.parts[held])

    def _action(self, planned: _Planned) -> tuple[Action, str]:
        """Return the action of a step and its label."""
        value = planned.step.argument
        return (value, value.words) if isinstance(value, JobStatement) else self._primitive(planned)

    def _primitive(self, planned: _Planned) -> tuple[Primitive, str]:
        """Return the primitive of a step and its label, with the cells of pallets by their numbers."""
        command = planned.step.command
        primitive, value = PRIMITIVES[command], getattr(planned.step, command)
        label = step_text(command, value)
        match primitive.argument:
            case Target() if isinstance(value, str):
                value, name = self._names.spot(value, self.parts, planned.loop, f"{planned.key}.{command}", command)
                label = f"{command} {name}"
            case Target():
                value = point_of(value, self._grasp_height)
            case JointTarget() if isinstance(value, str):
                value = self._names.joints(value, f"{planned.key}.{command}")
            case Switch(on=on):
                value = value == on
            case _:
                pass
        task = primitive(**{primitive.argument.key: value}) if primitive.argument.key else primitive()
        self._handled.handle(task)
        return task, label
