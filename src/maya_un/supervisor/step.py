"""One step of one robot: its command, the robot's reports, its result."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Collection, Generator, Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.errors import (
    InvalidRequest,
    InvalidValue,
    MayaError,
    StepFailed,
    StepInterrupted,
    UnknownName,
    by_code,
    from_sentence,
)
from maya_un.robot.primitives import PRIMITIVES
from maya_un.robot.primitives.primitive import Argument, Switch
from maya_un.steps.text import ARGUMENTS, INTERRUPTED, StepEnd, StepProgress, StepState, content_of
from maya_un.values import FARTHEST, WITHIN

LONGEST_DEADLINE = 7 * 24 * 3600.0
"""Longest time within which a step must start [s]; brokers store a command no longer."""

_MOST_BITS = 1024
"""A longer integer is shown in part: it is not readable, and Python refuses to write one of 4300 digits."""


def check_deadline(deadline: float, key: str = "deadline") -> None:
    """Raise `InvalidValue` naming `key` unless `deadline` [s] is positive and at most `LONGEST_DEADLINE`."""
    if not 0.0 < deadline <= LONGEST_DEADLINE:
        reason = phrase("it must be seconds, more than 0, at most {most:g}", most=LONGEST_DEADLINE)
        raise InvalidValue(key=key, value=shown(deadline), reason=reason)


def shown(value: object) -> object:
    """Return a value for a message: of a long integer, its beginning; of a collection, which can hold one, its type."""
    if isinstance(value, Collection) and not isinstance(value, str | bytes):
        return type(value).__name__
    return f"{value:#x}"[:20] + "…" if isinstance(value, int) and value.bit_length() > _MOST_BITS else value


def check(command: str, args: Mapping[str, Any]) -> None:
    """Raise `UnknownName`, `InvalidRequest` or `InvalidValue` for a command that every robot would refuse."""
    needed = ARGUMENTS.get(command)
    if needed is None:
        raise UnknownName(name=command, known=", ".join(ARGUMENTS))
    for name in needed:
        if name not in args:
            raise InvalidRequest(key=f"args.{name}", reason="it is missing")
    for name, value in args.items():
        if name not in needed:
            takes = ", ".join(needed) or phrase("no arguments")
            raise InvalidRequest(
                key=f"args.{shown(name)}",
                reason=phrase("{command} takes {arguments}", command=command, arguments=takes),
            )
        _check_value(PRIMITIVES[command].argument, name, value)


def _check_value(argument: Argument, name: str, value: object) -> None:
    if isinstance(argument, Switch):
        if not isinstance(value, bool):
            raise InvalidValue(key=f"args.{name}", value=shown(value), reason="it must be true or false")
    elif isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= FARTHEST:
        raise InvalidValue(key=f"args.{name}", value=shown(value), reason=WITHIN)


def command_text(id_: str, robot: str, command: str, args: Mapping[str, Any], deadline: float, supervisor: str) -> str:
    """Return the JSON text of a command of `supervisor` whose step must start within `deadline` [s].

    Raises `InvalidValue` for a time that is not positive, or longer than `LONGEST_DEADLINE`.
    """
    check_deadline(deadline)
    until = datetime.now(UTC) + timedelta(seconds=deadline)
    data = {"id": id_, "command": command, "args": dict(args), "robot": robot, "deadline": until.isoformat()}
    return json.dumps(data | {"supervisor": supervisor})


class Step:
    """A step for a robot. Await it for its result; iterate over it for the robot's reports before that.

    It is carried out even if no code awaits it. Awaiting it raises the error with which the step failed.
    """

    def __init__(self, id_: str, robot: str, text: str) -> None:
        self.id = id_
        self.robot = robot
        self.text = text
        self._reports: list[StepProgress] = []
        self._changed = asyncio.Event()
        self._ended: asyncio.Future[StepEnd | MayaError] = asyncio.get_running_loop().create_future()

    def __await__(self) -> Generator[Any, None, StepEnd]:
        return self._result().__await__()

    async def __aiter__(self) -> AsyncIterator[StepProgress]:
        seen = 0
        while True:
            for report in self._reports[seen:]:
                seen += 1
                yield report
            if self._ended.done():
                return
            self._changed.clear()
            await self._changed.wait()

    @property
    def content(self) -> dict[str, Any]:
        """The part of the command that the robot compares if it receives the same id again."""
        return content_of(json.loads(self.text))

    async def outcome(self) -> StepEnd:
        """Return the result, also that of a failed step.

        Raises `BrokerRefused` for a step that the broker refused, `StepFailed` for one without a result when its
        supervisor ended.
        """
        ended = await asyncio.shield(self._ended)
        if isinstance(ended, MayaError):
            raise ended
        return ended

    async def _result(self) -> StepEnd:
        result = await self.outcome()
        if result.error is not None:
            raise error_of(result, self.robot)
        return result

    def reported(self, progress: StepProgress) -> None:
        """Record a report of the robot; a repeated one changes nothing."""
        if progress.state not in {known.state for known in self._reports}:
            self._reports.append(progress)
            self._changed.set()

    def ended(self, how: StepEnd | MayaError) -> None:
        """Record the result, or the error that prevented sending; only the first call counts."""
        if not self._ended.done():
            self._ended.set_result(how)
            self._changed.set()


def error_of(result: StepEnd, robot: str) -> MayaError:
    """Return the error of a failed step, with the robot's code and message."""
    error, code = result.error or "", result.code or ""
    if code == INTERRUPTED:
        return StepInterrupted(id=result.id, robot=robot)
    if code.isdecimal() and int(code) in by_code():
        return from_sentence(int(code), error)
    return StepFailed(id=result.id, robot=robot, error=error, error_code=code)


def progress_of(data: Mapping[str, Any]) -> StepProgress | None:
    """Return a report of a robot, None for other data."""
    try:
        return StepProgress(str(data["id"]), StepState(data["state"]), str(data["date"]))
    except (KeyError, ValueError):
        return None


def result_of(data: Mapping[str, Any]) -> StepEnd | None:
    """Return a result that a robot published, None for other data."""
    try:
        error = None if data["success"] is True else str(data["error"])
        code = None if error is None else str(data["code"])
        warnings = tuple(str(warning) for warning in data.get("warnings", ()))
        dates = str(data["started"]), str(data["finished"])
        return StepEnd(str(data["id"]), error, code, *dates, warnings, data.get("content"))
    except (KeyError, TypeError):
        return None
