from __future__ import annotations

import asyncio
import json
from typing import Any

import jsonschema
import pytest

from maya_un.coms.schemas import SCHEMAS
from maya_un.errors import (
    InvalidRequest,
    InvalidValue,
    MayaError,
    StepFailed,
    StepInterrupted,
    UnknownName,
    Unreachable,
)
from maya_un.steps.command import step_of
from maya_un.steps.text import ARGUMENTS, StepEnd, StepProgress, StepState
from maya_un.supervisor.step import Step, check, command_text, error_of, progress_of, result_of
from tests.virtual_time import turn

GOOD: list[tuple[str, dict[str, Any]]] = [
    ("home", {}),
    ("can_teleop", {}),
    ("gripper", {"open": True}),
    *((command, {"x": 0.5, "y": -1, "z": 0.0}) for command in ("pick", "place", "approach", "line")),
    ("move", {"a": -0.5, "b": 1.1, "c": 1.6}),
]
BAD: list[Any] = [
    ("dance", {}, UnknownName),
    ("pick", {"x": 0.5, "y": 1.1}, InvalidRequest),
    ("home", {"x": 0.5}, InvalidRequest),
    ("pick", {"x": 0.5, "y": 1.1, "z": float("nan")}, InvalidValue),
    ("pick", {"x": 0.5, "y": 1.1, "z": 1e5}, InvalidValue),
    ("pick", {"x": 0.5, "y": 1.1, "z": True}, InvalidValue),
    ("pick", {"x": 0.5, "y": 1.1, "z": "0.4"}, InvalidValue),
    ("gripper", {"open": 1}, InvalidValue),
    ("move", {"x": 0.5, "y": 1.1, "z": 0.4}, InvalidRequest),
    ("move", {"a": 0.5, "b": 1.1, "c": True}, InvalidValue),
    pytest.param("move", {"a": 0.5, "b": 1.1, "c": [16**5000]}, InvalidValue, id="long in a list"),
    pytest.param("gripper", {"open": {"a": 16**5000}}, InvalidValue, id="long in a dict"),
]


def result(error: str | None = None, code: str | None = None, warnings: tuple[str, ...] = ()) -> StepEnd:
    return StepEnd("1", error, code, "a", "b", warnings)


@pytest.mark.parametrize(
    "deadline",
    [
        *(604_801.0, 1e12, 1e300, float("inf"), float("nan"), pytest.param(10**5000, id="long")),
        *(0.0, -1.0, -1e12, -1e300, float("-inf"), pytest.param(-(10**5000), id="long and negative")),
    ],
)
def test_a_deadline_that_no_date_can_have_is_refused(deadline: float) -> None:
    with pytest.raises(InvalidValue, match="at most 604800"):
        command_text("1", "MAYA", "home", {}, deadline, "anna")


def test_every_command_of_robots_is_valid() -> None:
    assert {command for command, _ in GOOD} == set(ARGUMENTS)


@pytest.mark.parametrize(("command", "args"), GOOD)
def test_a_good_command_passes_here_at_the_robot_and_the_schema(command: str, args: dict[str, Any]) -> None:
    check(command, args)
    data = json.loads(command_text("1", "MAYA", command, args, 60.0, "anna"))
    assert step_of(data, "1") == step_of(data | {"supervisor": None}, "1")
    assert (step_of(data, "1").robot, data["supervisor"]) == ("MAYA", "anna")
    jsonschema.validate(data, SCHEMAS["commands"])


@pytest.mark.parametrize(("command", "args", "error"), BAD)
def test_a_command_that_no_robot_begins_is_refused_at_once(
    command: str, args: dict[str, Any], error: type[MayaError]
) -> None:
    with pytest.raises(error) as refused:
        check(command, args)
    assert refused.value.text()


@pytest.mark.parametrize("schema", SCHEMAS.values(), ids=list(SCHEMAS))
def test_the_schemas_are_schemas(schema: dict[str, Any]) -> None:
    jsonschema.Draft202012Validator.check_schema(schema)


@pytest.mark.parametrize(
    ("kind", "data"),
    [
        ("commands", {"id": "1", "command": "pick", "args": {"x": 0.5, "y": 1.1}}),
        ("commands", {"id": "1", "command": "pick"}),
        ("commands", {"id": "", "command": "home"}),
        ("commands", {"id": "1", "command": "home", "deadline": "tomorrow"}),
        ("progress", {"id": "1", "state": "resting", "date": "2026-01-31T12:00:00Z"}),
        ("connection", {"connection": "online"}),
    ],
)
def test_schemas_refuse_invalid_messages(kind: str, data: dict[str, Any]) -> None:
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, SCHEMAS[kind])


def test_a_failed_step_raises_the_robots_error() -> None:
    error = error_of(result(error="it is too far", code="2101"), "MAYA")
    assert isinstance(error, Unreachable)
    assert (error.code, str(error)) == (2101, "it is too far")
    assert isinstance(error_of(result(error="gone", code="INTERRUPTED"), "MAYA"), StepInterrupted)
    assert isinstance(error_of(result(error="gone", code="9999"), "MAYA"), StepFailed)


def test_published_report_of_a_robot_is_read_back() -> None:
    one = result(error="no", code="2101", warnings=("args.w was ignored",))
    assert result_of(json.loads(one.text)) == one
    report = StepProgress("1", StepState.EXECUTING, "2026-01-31T12:00:00Z")
    assert progress_of(json.loads(report.text)) == report
    assert result_of({"id": "1", "success": True}) is None
    date = "2026-01-31T12:00:00Z"
    other = StepEnd("1", "other content", "4012", date, date, (), {"command": "home", "args": {}})
    assert result_of(json.loads(other.text)) == other
    jsonschema.validate(json.loads(other.text), SCHEMAS["results"])
    assert progress_of({"id": "1", "state": "resting", "date": ""}) is None


def test_reports_reach_every_reader_once_and_in_order() -> None:
    async def story() -> None:
        step = Step("1", "MAYA", "")

        async def states() -> list[StepState]:
            return [report.state async for report in step]

        readers = [asyncio.create_task(states()) for _ in range(2)]
        for state in (StepState.ACCEPTED, StepState.ACCEPTED, StepState.EXECUTING):
            await turn()
            step.reported(StepProgress("1", state, ""))
        step.ended(result())
        step.ended(result(error="a second result does not count", code="2101"))
        assert await asyncio.gather(*readers) == [[StepState.ACCEPTED, StepState.EXECUTING]] * 2
        assert await step == result()
        assert await states() == [StepState.ACCEPTED, StepState.EXECUTING]

    asyncio.run(story())
