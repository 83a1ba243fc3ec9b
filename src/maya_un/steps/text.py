"""The steps of a remote process as JSON text, their progress and their results, and the robot's identity.

    {"id": "7", "command": "pick", "args": {"x": 0.5, "y": 1.1, "z": 0.4}, "robot": "MAYA", "deadline": …,
     "supervisor": "anna"}
    {"id": "7", "state": "executing", "date": …}
    {"id": "7", "success": true, "error": null, "code": null, "started": …, "finished": …, "warnings": []}
    {"name": "MAYA", "journal": "5b0c…"}

The commands are the primitives: pick, place, approach and line (args x, y, z in metres), move (args a, b, c in radians
and metres), gripper (args open), home and can_teleop (no args). Other args are ignored, and the result lists them.
`robot`, `deadline` and `supervisor` are optional: a step for another robot and a step that would begin after its
deadline (ISO 8601 with a time zone) are refused. `supervisor` names the sender for displays; a robot ignores it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidMessage, InvalidRequest, MayaError
from maya_un.robot.primitives import PRIMITIVES

COMMAND_TOPIC = "/step_command"
RESULT_TOPIC = "/step_result"
STATUS_TOPIC = "/step_status"
ROBOT_TOPIC = "/step_robot"
TEXT_TYPE = "std_msgs/String"
"""The ROS type of the four topics: JSON in a string."""

QUIET = 1.5
"""After a stop or a fault, steps are refused until none has arrived for this time [s, real time].

The slowest transport is Firestore: a query each `coms.firestore.INTERVAL`, then two more requests before the robot gets
a step. These may take 0.2 s each.
"""

INTERRUPTED = "INTERRUPTED"
"""The code of a step without a result when the program ended: its progress is unknown."""

LONGEST_ID = 200
"""Maximum length of an id [characters]."""

DEEPEST = 32
"""Maximum levels of nesting in a command: the limit of a Realtime Database."""

_LONGEST_TEXT = 64
"""Maximum length of a text in `content_of` [characters]."""


ARGUMENTS = {name: primitive.argument.numbers for name, primitive in PRIMITIVES.items()}
"""The commands, and the arguments that each needs."""


class StepState(StrEnum):
    """The states of a step before its result."""

    ACCEPTED = "accepted"
    EXECUTING = "executing"


@dataclass(frozen=True, slots=True)
class RobotIdentity:
    """A robot: its name for supervisors, and the journal of its steps."""

    name: str
    journal: str

    @property
    def text(self) -> str:
        """The JSON text."""
        return json.dumps({"name": self.name, "journal": self.journal})


@dataclass(frozen=True, slots=True)
class StepProgress:
    """The state of a step from a date on (ISO 8601, UTC)."""

    id: str
    state: StepState
    date: str

    @property
    def text(self) -> str:
        """The JSON text."""
        return json.dumps({"id": self.id, "state": self.state.value, "date": self.date})


@dataclass(frozen=True, slots=True)
class StepEnd:
    """The end of a step, or its refusal: `error` is a sentence, `code` a code of Maya; both are None after success.

    `id` is None if the command had no readable id. Dates are ISO 8601 in UTC. `content` is set if another command has
    the same id (`content_of`): it shows the sender of the first command that the other command was refused.
    """

    id: str | None
    error: str | None
    code: str | None
    started: str
    finished: str
    warnings: tuple[str, ...] = ()
    content: dict[str, Any] | None = None

    @property
    def text(self) -> str:
        """The JSON text."""
        data = {
            "id": self.id,
            "success": self.error is None,
            "error": self.error,
            "code": self.code,
            "started": self.started,
            "finished": self.finished,
            "warnings": list(self.warnings),
        }
        return json.dumps(data if self.content is None else data | {"content": self.content})

    @classmethod
    def refused(
        cls,
        id_: str | None,
        error: MayaError,
        date: str,
        warnings: tuple[str, ...] = (),
        content: dict[str, Any] | None = None,
    ) -> StepEnd:
        """Return the result of a step that was refused on `date`, because of `error`."""
        return cls(id_, str(error), str(error.code), date, date, warnings, content)


def read(text: str) -> dict[str, Any]:
    """Return a command as data; raises `InvalidMessage` if it is not a JSON object or is nested too deep."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidMessage(name=phrase("the step"), reason=phrase("it is not JSON: {error}", error=error)) from error
    if not isinstance(data, dict):
        raise InvalidMessage(
            name=phrase("the step"), reason=phrase('it must be an object like {{"id": "1", "command": "home"}}')
        )
    if _is_deeper(data, DEEPEST):
        reason = phrase("it is nested more than {most} levels deep", most=DEEPEST)
        raise InvalidMessage(name=phrase("the step"), reason=reason)
    return data


def _is_deeper(data: object, levels: int) -> bool:
    """Return whether data have more than `levels` levels; Python can parse deeper JSON than it can write."""
    level = [data]
    for _ in range(levels + 1):
        below = [one.values() if isinstance(one, dict) else one for one in level if isinstance(one, dict | list)]
        level = [child for children in below for child in children]
    return bool(level)


def content_of(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part that distinguishes two commands with the same id: the command and the args that it needs.

    Invalid values are replaced by None, and long texts are cut, so that the content is short enough to send back.
    """
    command, args = data.get("command"), data.get("args")
    command = command[:_LONGEST_TEXT] if isinstance(command, str) else None
    args = args if isinstance(args, Mapping) else {}
    return {"command": command, "args": {name: _plain(args.get(name)) for name in ARGUMENTS.get(command or "", ())}}


def _plain(value: object) -> float | bool | str | None:
    """Return a number as a float, a boolean unchanged, the beginning of a text, None for anything else."""
    if isinstance(value, str):
        return value[:_LONGEST_TEXT]
    if isinstance(value, bool):
        return value
    try:
        number = float(value) if isinstance(value, int | float) else None
    except OverflowError:
        return None
    return number if number is not None and isfinite(number) else None


def id_of(data: Mapping[str, Any]) -> str | None:
    """Return the id of a command, None if it has none; raises `InvalidRequest` for an invalid id."""
    found = data.get("id")
    if found is None:
        return None
    if not isinstance(found, str) or not 0 < len(found) <= LONGEST_ID or not found.isprintable():
        raise InvalidRequest(
            key="id", reason=phrase("it must be text of 1 to {most} printable characters", most=LONGEST_ID)
        )
    return found


def as_id(text: str | None) -> str | None:
    """Return a text as an id, None if it is no valid id."""
    with suppress(InvalidRequest):
        return id_of({"id": text})
    return None
