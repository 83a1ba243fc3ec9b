"""A process: a file of steps for several robots, each after the steps that it names.

name: hand over
deadline: 60            # a step begins within so many seconds after it was sent; optional
steps:
- {id: fetch, robot: MAYA, command: pick, args: {x: 0.5, y: 1.1, z: 0.4}}
- {id: give, robot: MAYA, command: place, args: {x: 0.3, y: 1.2, z: 0.4}, after: [fetch]}
- {id: take, robot: MAYA2, command: pick, args: {x: 0.4, y: 1.0, z: 0.4}, after: [give]}
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from graphlib import CycleError, TopologicalSorter
from hashlib import sha256
from pathlib import Path
from typing import Any

from maya_un.coms.broker import topic
from maya_un.errors import InvalidProcess, MayaError
from maya_un.process.documents import read_document
from maya_un.supervisor.lab import DEADLINE
from maya_un.supervisor.step import check

_LONGEST_DEADLINE = 7 * 24 * 3600.0


@dataclass(frozen=True, slots=True)
class ProcessStep:
    """A step of a process; it begins when the steps `after` which it comes have ended."""

    id: str
    robot: str
    command: str
    args: dict[str, Any]
    after: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FleetProcess:
    """Steps by id, in the order of the file. `deadline` is the time in which a step begins once it was sent [s]."""

    name: str
    steps: dict[str, ProcessStep]
    deadline: float = DEADLINE

    @property
    def digest(self) -> str:
        """The identity of a process, in the ids of its steps."""
        return sha256(json.dumps([asdict(step) for step in self.steps.values()]).encode()).hexdigest()

    def sorter(self) -> TopologicalSorter[str]:
        """Return the graph of its steps."""
        return TopologicalSorter({step.id: step.after for step in self.steps.values()})


def load_process(path: Path) -> FleetProcess:
    """Return the process of a YAML or JSON file; one without a name is called as the file.

    Raises `FileUnreadable` for a file that cannot be read or parsed, `InvalidProcess` for anything in it by which it
    could not be carried out to its end.
    """
    data = _mapping(read_document(path), "the file", {"steps"}, {"name", "deadline"})
    if not isinstance(data["steps"], list) or not data["steps"]:
        raise InvalidProcess(key="steps", reason="it must be a list of steps")
    steps: dict[str, ProcessStep] = {}
    for number, one in enumerate(data["steps"], 1):
        step = _planned(one, f"steps, number {number}")
        if step.id in steps:
            raise InvalidProcess(key=step.id, reason="two steps have this id")
        steps[step.id] = step
    process = FleetProcess(_text(data.get("name", path.stem), "name"), steps, _deadline(data.get("deadline", DEADLINE)))
    _check_graph(process)
    return process


def _planned(data: object, key: str) -> ProcessStep:
    found = _mapping(data, key, {"id", "robot", "command"}, {"args", "after"})
    id_ = _text(found["id"], f"{key}, id")
    command = _text(found["command"], f"{id_}, command")
    robot = _text(found["robot"], f"{id_}, robot")
    args = found.get("args") or {}
    if not isinstance(args, dict):
        raise InvalidProcess(key=f"{id_}, args", reason="it must be an object like {x: 0.5, y: 1.1, z: 0.4}")
    try:
        topic(robot, "commands")
        check(command, args)
    except MayaError as error:
        raise InvalidProcess(key=id_, reason=str(error).rstrip(".")) from error
    after = found.get("after") or []
    if not isinstance(after, list):
        raise InvalidProcess(key=f"{id_}, after", reason="it must be a list of ids")
    return ProcessStep(id_, robot, command, args, tuple(_text(one, f"{id_}, after") for one in after))


def _check_graph(process: FleetProcess) -> None:
    for step in process.steps.values():
        unknown = [name for name in step.after if name not in process.steps]
        if unknown:
            raise InvalidProcess(key=f"{step.id}, after", reason=f"there is no step {unknown[0]}")
    try:
        process.sorter().prepare()
    except CycleError as error:
        raise InvalidProcess(key="after", reason=f"these steps wait for each other: {_chain(error.args[1])}") from error


def _chain(ids: Iterable[str]) -> str:
    return " -> ".join(ids)


def _mapping(data: object, key: str, needed: set[str], optional: set[str]) -> Mapping[str, Any]:
    if not isinstance(data, dict):
        raise InvalidProcess(key=key, reason=f"it must be an object with {', '.join(sorted(needed))}")
    for name in sorted(needed - set(data)):
        raise InvalidProcess(key=key, reason=f"{name} is missing")
    for name in data:
        if name not in needed | optional:
            raise InvalidProcess(
                key=key, reason=f"{name!r} is not known; there are {', '.join(sorted(needed | optional))}"
            )
    return data


def _text(value: object, key: str) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        value = str(value)  # YAML reads an id like 7 as a number
    if not isinstance(value, str) or not value or len(value) > 64 or not value.isprintable():
        raise InvalidProcess(key=key, reason="it must be text of 1 to 64 printable characters")
    return value


def _deadline(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value <= _LONGEST_DEADLINE:
        raise InvalidProcess(key="deadline", reason=f"it must be seconds, more than 0, at most {_LONGEST_DEADLINE:g}")
    return float(value)
