"""Tasks of the robot, the list of tasks that is prepared here, and its job files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterator, Sequence

import yaml

HOME, GRIPPER, PICK, PLACE, APPROACH = "home", "gripper", "pick", "place", "approach"

AIMED = (PICK, PLACE, APPROACH)
"""The commands that have a target."""

MOST_TASKS = 10_000
"""Largest number of tasks in a list."""


@dataclass(frozen=True)
class Task:
    """A primitive of the robot: `target` [m] of pick, place and approach, `open` of gripper."""

    command: str
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    open: bool = False


class BadJob(ValueError):
    """A file of which no list can be made; `key` is the word for the reason, `details` its values."""

    def __init__(self, key: str, **details: object) -> None:
        super().__init__(key, details)
        self.key = key
        self.details = details


class TaskList:
    """Tasks in the order in which they are to be done."""

    def __init__(self, tasks: Sequence[Task] = ()) -> None:
        self._tasks: list[Task] = list(tasks)

    def __iter__(self) -> Iterator[Task]:
        return iter(self._tasks)

    def __len__(self) -> int:
        return len(self._tasks)

    def add(self, task: Task) -> int:
        """Append a task and return its index; raises `BadJob` if the list is full."""
        if len(self._tasks) >= MOST_TASKS:
            raise BadJob("job_too_long", most=MOST_TASKS)
        self._tasks.append(task)
        return len(self._tasks) - 1

    def remove(self, place: int) -> None:
        """Remove a task, if it exists."""
        if 0 <= place < len(self._tasks):
            del self._tasks[place]

    def move(self, place: int, by: int) -> int:
        """Move a task up (`by` < 0) or down, and return its new index."""
        there = place + by
        if 0 <= place < len(self._tasks) and 0 <= there < len(self._tasks):
            self._tasks.insert(there, self._tasks.pop(place))
            return there
        return place

    def replace(self, tasks: Sequence[Task]) -> None:
        """Replace all tasks."""
        self._tasks = list(tasks)


def job_text(tasks: Sequence[Task], name: str) -> str:
    """Return tasks as a job file of `maya run`."""
    steps = yaml.safe_dump([_step(task) for task in tasks], default_flow_style=None, allow_unicode=True, width=120)
    head = yaml.safe_dump({"name": name[:64] or "list"}, allow_unicode=True)
    return f"{head}steps:\n" + "".join(f"  {line}\n" for line in steps.splitlines())


def _step(task: Task) -> Any:
    if task.command == HOME:
        return HOME
    if task.command == GRIPPER:
        return {GRIPPER: "open" if task.open else "close"}
    return {task.command: [round(number, 6) for number in task.target]}


def job_tasks(text: str, grasp_height: float | None = None) -> list[Task]:
    """Return the tasks of a job file; a place without z is at `grasp_height` [m]. Raises `BadJob`."""
    try:
        job = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise BadJob("job_unreadable", reason=str(error).partition("\n")[0]) from error
    if not isinstance(job, dict) or not isinstance(job.get("steps"), list) or not job["steps"]:
        raise BadJob("job_without_steps")
    places = _places(job)
    steps = [_task(number, step, places, grasp_height) for number, step in enumerate(job["steps"], 1)]
    repeat = job.get("repeat", 1)
    if not isinstance(repeat, int) or repeat < 1 or repeat * len(steps) > MOST_TASKS:
        raise BadJob("job_too_long", most=MOST_TASKS)
    return steps * repeat


def _places(job: dict[str, Any]) -> dict[str, Any]:
    groups = [job.get(key) or {} for key in ("parts", "places")]
    if not all(isinstance(group, dict) for group in groups):
        raise BadJob("job_unreadable", reason="parts, places")
    return {name: place for group in groups for name, place in group.items()}


def _task(number: int, step: Any, places: dict[str, Any], grasp_height: float | None) -> Task:
    if step == HOME or step in ({HOME: True}, {HOME: None}):
        return Task(HOME)
    command, argument = next(iter(step.items())) if isinstance(step, dict) and len(step) == 1 else (step, None)
    if command == GRIPPER and argument in ("open", "close"):
        return Task(GRIPPER, open=argument == "open")
    if command not in AIMED:
        raise BadJob("job_step_unknown", number=number, step=_short(command))
    place = places.get(argument, argument) if isinstance(argument, str) else argument
    return Task(command, _target(number, place, grasp_height))


def _target(number: int, place: Any, grasp_height: float | None) -> tuple[float, float, float]:
    if isinstance(place, str):
        raise BadJob("job_place_unknown", number=number, place=_short(place))
    numbers = [one for one in place if _is_number(one)] if isinstance(place, list) else []
    if len(numbers) == 2 == len(place) and grasp_height is None:
        raise BadJob("job_height_unknown", number=number)
    if len(numbers) == 2 == len(place):
        numbers.append(grasp_height)
    if len(numbers) != 3 or not isinstance(place, list) or len(place) > 3:
        raise BadJob("job_place_unreadable", number=number, place=_short(place))
    return float(numbers[0]), float(numbers[1]), float(numbers[2])


_TOO_FAR = 1e6
"""No robot reaches as far [m]; a larger whole number may not even fit into a float."""


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _TOO_FAR


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 40 else f"{text[:39]}…"
