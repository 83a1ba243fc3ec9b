"""The steps of a process as JSON text, as the laboratory's cloud sends them, and how they ended.

    {"id": "7", "command": "pick", "args": {"x": 0.5, "y": 1.1, "z": 0.4}}
    {"id": "7", "success": true, "error": null, "code": null, "started": …, "finished": …, "warnings": []}

A command is pick, place, approach (args x, y, z in metres), gripper (args open), home or can_teleop (no args). What
else stands in args is ignored, and the result says so.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from maya_un.errors import InvalidMessage, InvalidRequest, MayaError, UnknownName
from maya_un.robot.primitives import Primitive, from_dict, to_dict

INTERRUPTED = "INTERRUPTED"
"""The code of a step that was under way when this program ended: nobody knows how far it came."""

LONGEST_ID = 200
"""Characters of an id."""

_ARGUMENTS: dict[str, tuple[str, ...]] = {
    "pick": ("x", "y", "z"),
    "place": ("x", "y", "z"),
    "approach": ("x", "y", "z"),
    "gripper": ("open",),
    "home": (),
    "can_teleop": (),
}
"""The commands, and what each needs."""


@dataclass(frozen=True, slots=True)
class Step:
    """A command that can be understood. `warnings` say what of it was ignored or is missing."""

    id: str
    primitive: Primitive
    warnings: tuple[str, ...] = ()

    @property
    def digest(self) -> str:
        """What tells its content from that of another; what was ignored does not count."""
        return sha256(json.dumps(to_dict(self.primitive), sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Result:
    """How a step ended, or why it was refused: `error` is a sentence and `code` ours, both None after success.

    `id` is None where the command had none that could be read. Dates are ISO 8601 in UTC.
    """

    id: str | None
    error: str | None
    code: str | None
    started: str
    finished: str
    warnings: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The JSON text."""
        return json.dumps(
            {
                "id": self.id,
                "success": self.error is None,
                "error": self.error,
                "code": self.code,
                "started": self.started,
                "finished": self.finished,
                "warnings": list(self.warnings),
            }
        )

    @classmethod
    def refused(cls, id_: str | None, error: MayaError, date: str, warnings: tuple[str, ...] = ()) -> Result:
        """Return the result of a step of which nothing was done on `date`, for `error`."""
        return cls(id_, str(error), str(error.code), date, date, warnings)


def read(text: str) -> dict[str, Any]:
    """Return a command as data; raises `InvalidMessage` for what is no JSON object."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidMessage(name="the step", reason=f"it is not JSON: {error}") from error
    if not isinstance(data, dict):
        raise InvalidMessage(name="the step", reason='it must be an object like {"id": "1", "command": "home"}')
    return data


def id_of(data: Mapping[str, Any]) -> str | None:
    """Return the id of a command, None where it has none; raises `InvalidRequest` for one that is none."""
    found = data.get("id")
    if found is None:
        return None
    if not isinstance(found, str) or not 0 < len(found) <= LONGEST_ID or not found.isprintable():
        raise InvalidRequest(key="id", reason=f"it must be text of 1 to {LONGEST_ID} printable characters")
    return found


def step_of(data: Mapping[str, Any], id_: str) -> Step:
    """Return the step that a command asks for.

    Raises `InvalidRequest` for what is missing, `UnknownName` for a command that is none, `InvalidValue` for a value
    that is not what it must be.
    """
    command = data.get("command")
    if command is None:
        raise InvalidRequest(key="command", reason="it is missing")
    if not isinstance(command, str) or command not in _ARGUMENTS:
        raise UnknownName(name=str(command)[:64], known=", ".join(_ARGUMENTS))
    args = data.get("args", {})
    args = {} if args is None else args
    if not isinstance(args, Mapping):
        raise InvalidRequest(key="args", reason="it must be an object")
    needed = _ARGUMENTS[command]
    for name in needed:
        if name not in args:
            raise InvalidRequest(key=f"args.{name}", reason="it is missing")
    warnings = [f"args.{name} was ignored" for name in map(_shown, args) if name not in needed]
    return Step(id_, _primitive(command, args), tuple(warnings))


def _primitive(command: str, args: Mapping[str, Any]) -> Primitive:
    match _ARGUMENTS[command]:
        case ("x", "y", "z"):
            target = {name: args[name] for name in "xyz"}
            return from_dict({"command": command, "target": target}, 0.0)
        case ("open",):
            return from_dict({"command": command, "open": args["open"]}, 0.0)
        case _:
            return from_dict({"command": command}, 0.0)


def _shown(name: object) -> str:
    return str(name)[:64]
