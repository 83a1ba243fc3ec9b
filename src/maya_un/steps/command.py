"""The step in a command of /step_command: its primitive, its robot, its deadline."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest, UnknownName
from maya_un.robot.primitives import PRIMITIVES, Primitive, from_dict, to_dict
from maya_un.steps.text import ARGUMENTS


@dataclass(frozen=True, slots=True)
class StepCommand:
    """A valid command. `warnings` list the parts that were ignored or are missing."""

    id: str
    primitive: Primitive
    warnings: tuple[str, ...] = ()
    robot: str | None = None
    deadline: str | None = None

    def expired(self, date: str) -> bool:
        """Return whether the deadline lies before `date` (ISO 8601, UTC)."""
        return self.deadline is not None and _instant(self.deadline) < _instant(date)

    @property
    def digest(self) -> str:
        """Hash of the content; ignored fields do not count."""
        return sha256(json.dumps(to_dict(self.primitive), sort_keys=True).encode()).hexdigest()


def step_of(data: Mapping[str, Any], id_: str) -> StepCommand:
    """Return the step of a command.

    Raises `InvalidRequest` for a missing or malformed field, `UnknownName` for an unknown command, `InvalidValue` for
    an invalid value.
    """
    command = data.get("command")
    if command is None:
        reason = phrase(
            "it is missing. Name a command, or set the default command of this robot in the robot's document"
        )
        raise InvalidRequest(key="command", reason=reason)
    if not isinstance(command, str) or command not in ARGUMENTS:
        raise UnknownName(name=str(command)[:64], known=", ".join(ARGUMENTS))
    args = data.get("args", {})
    args = {} if args is None else args
    if not isinstance(args, Mapping):
        raise InvalidRequest(key="args", reason="it must be an object")
    needed = ARGUMENTS[command]
    for name in needed:
        if name not in args:
            raise InvalidRequest(key=f"args.{name}", reason="it is missing")
    warnings = [f"args.{name} was ignored" for name in map(_shown, args) if name not in needed]
    return StepCommand(id_, _primitive(command, args), tuple(warnings), _robot_of(data), _deadline_of(data))


def _robot_of(data: Mapping[str, Any]) -> str | None:
    found = data.get("robot")
    if found is not None and not isinstance(found, str):
        raise InvalidRequest(key="robot", reason="it must be the name of a robot")
    return found


def _deadline_of(data: Mapping[str, Any]) -> str | None:
    found = data.get("deadline")
    if found is None:
        return None
    reason = phrase("it must be a date and time with a time zone, like 2026-01-31T12:00:00Z")
    try:
        if isinstance(found, str) and _instant(found).tzinfo is not None:
            return found
    except (ValueError, OverflowError) as error:
        raise InvalidRequest(key="deadline", reason=reason) from error
    raise InvalidRequest(key="deadline", reason=reason)


def _instant(date: str) -> datetime:
    found = datetime.fromisoformat(date)
    return found if found.tzinfo is None else found.astimezone(UTC)


def _primitive(command: str, args: Mapping[str, Any]) -> Primitive:
    argument = PRIMITIVES[command].argument
    value = {argument.key: argument.of_numbers(args)} if argument.key else {}
    return from_dict({"command": command, **value}, 0.0)


def _shown(name: object) -> str:
    return str(name)[:64]
