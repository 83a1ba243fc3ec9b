"""`maya fleet`: texts of other programs on the terminal, options, and the process beside a robot."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import AsyncIterator
from typing import Any

import aiomqtt
import pytest

from dmc41x3.cli.console import OutputSettings
from maya_un.cli.fleet import robots, running, watching
from maya_un.cli.fleet.watching import fleet_beside
from maya_un.errors import InvalidValue, SupervisorsNotReached
from maya_un.schema.encoding import to_json
from maya_un.service.fleet import FleetService
from maya_un.steps.text import StepEnd, StepProgress, StepState
from maya_un.supervisor import Event, Step
from maya_un.supervisor.fleet import FleetBoard
from maya_un.supervisor.lab import _event_of
from maya_un.supervisor.process import ProcessStep
from tests.waiting import until

CODE = "\x1b[2J\x9b"
SHOWN = r"\x1b[2J\x9b"
SETTINGS = OutputSettings()
DATE = "2026-01-31T12:00:00+00:00"
END = StepEnd("1", f"bad {CODE}", CODE, DATE, DATE)


class Lab:
    """A supervisor of one robot whose texts hold codes for terminals; the robot fails every step."""

    name = "lab"
    robots = {"MAYA": f"ONLINE{CODE}"}

    def __init__(self, *_: object, **__: object) -> None:
        pass

    async def __aenter__(self) -> Lab:
        return self

    async def __aexit__(self, *_: object) -> None:
        pass

    async def watch(self) -> AsyncIterator[Event]:
        yield Event("MAYA", "connection", {"connection": f"ONLINE{CODE}"})
        yield Event("MAYA", "results", json.loads(END.text))

    def robot(self, _: str) -> Lab:
        return self

    def do(self, *_: object, **__: object) -> Step:
        step = Step("1", "MAYA", "{}")
        step.reported(StepProgress(f"1{CODE}", StepState.ACCEPTED, DATE))
        step.ended(StepEnd("1", None, None, DATE, DATE))
        return step


@pytest.fixture
def _lab(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robots, "Supervisor", Lab)


def require_visible(text: str) -> None:
    assert SHOWN in text
    assert not {"\x1b", "\x9b"} & set(text)


@pytest.mark.usefixtures("_lab")
def test_terminal_executes_no_code_of_a_robot(capsys: pytest.CaptureFixture[str]) -> None:
    robots.list_(None, SETTINGS)
    require_visible(capsys.readouterr().out)
    robots.watch(None, None, SETTINGS)
    require_visible(capsys.readouterr().out)
    robots.send("MAYA", "home", [], None, None, SETTINGS)
    shown = capsys.readouterr()
    require_visible(shown.out)
    require_visible(shown.err)
    running._tell(ProcessStep("a", "MAYA", "home", {}), END, SETTINGS)
    require_visible(capsys.readouterr().out)


async def test_terminal_executes_no_code_in_the_list_that_follows(capsys: pytest.CaptureFixture[str]) -> None:
    board, changed = FleetBoard("mqtt://lab"), asyncio.Event()
    board.take(Event("MAYA", "connection", {"connection": "ONLINE"}), DATE)
    board.take(Event("MAYA", "results", json.loads(END.text)), DATE)
    changed.set()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(0.1):
            await robots._list_changes(board, changed, SETTINGS)
    require_visible(capsys.readouterr().out)


def message(kind: str, text: bytes) -> aiomqtt.Message:
    return aiomqtt.Message(f"maya/v1/MAYA/{kind}", text, 1, False, 1, None)


def test_lone_surrogates_of_a_robot_do_not_end_the_list() -> None:
    board = FleetBoard("mqtt://lab")
    board.take(Event("MAYA", "connection", {"connection": "ONLINE"}), DATE)
    command = _event_of(message("commands", b'{"id": "1", "command": "x\\ud800", "supervisor": "\xed\xa0\x80"}'))
    result = _event_of(
        message(
            "results",
            rb'{"id": "2", "success": false, "error": "\udfff", "code": "1", '
            rb'"started": "", "finished": "", "warnings": ["\ud800"], "\ud800": {"x": ["\ud800"]}}',
        )
    )
    for event in (command, result):
        assert event is not None
        json.dumps(event.data, ensure_ascii=False).encode()
        board.take(event, DATE)
    assert json.loads(to_json(board.view()))["robots"][0]["last"][0]["error"] == "?"


def test_pair_of_surrogates_is_a_character() -> None:
    event = _event_of(message("results", rb'{"id": "\ud83d\ude00"}'))
    assert event is not None
    assert event.data == {"id": "\U0001f600"}


def test_deadline_of_a_step_names_its_option() -> None:
    for deadline in ("1e12", "99999999d", "1e300"):
        with pytest.raises(InvalidValue, match="--deadline"):
            robots.send("MAYA", "home", [], "mqtt://lab", deadline, SETTINGS)


LONG_LINE = (sys.executable, "-c", "print('x' * 100_000, flush=True)")


@pytest.mark.parametrize(
    ("command", "words"), [(LONG_LINE, "more than 1000 bytes"), (("/no/such/program",), "No such file")]
)
async def test_fleet_says_why_its_process_cannot_be_used(
    command: tuple[str, ...], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAYA_COMS_URL", "mqtt://lab")
    monkeypatch.setattr(watching, "_COMMAND", command)
    monkeypatch.setattr(watching, "_LONGEST", 1000)
    fleet = FleetService()
    trouble: Any = None
    async with fleet_beside(fleet):
        await until(lambda: fleet.view().link == "lost")
        trouble = fleet.view().trouble
    assert trouble.code == SupervisorsNotReached.code
    assert words in trouble.message
