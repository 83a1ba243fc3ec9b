"""The board of a fleet: which robots and steps follow from which messages."""

from __future__ import annotations

import json
from typing import Any

import pytest

from maya_un.errors import SupervisorsNotReached
from maya_un.schema.encoding import to_json
from maya_un.schema.fleet import FleetRobot, FleetStep, FleetView
from maya_un.steps.text import StepEnd, StepProgress, StepState
from maya_un.supervisor.fleet import MOST_LAST, MOST_ROBOTS, FleetBoard
from maya_un.supervisor.lab import Event
from maya_un.supervisor.step import command_text

BROKER = "mqtt://lab"
GONE = SupervisorsNotReached(where=BROKER, reason="Connection refused")
PLACE = {"x": 0.5, "y": 1.1, "z": 0.4}


class Told:
    """A board, and messages for it; each arrives one second after the last."""

    def __init__(self) -> None:
        self.board = FleetBoard(BROKER)
        self.seconds = 0
        self.tell("", "broker", {"code": None, "error": None})

    @property
    def date(self) -> str:
        """The date of the latest message."""
        return self.date_at(self.seconds)

    @staticmethod
    def date_at(second: int) -> str:
        """Return the date at which the message of this number arrived."""
        return f"2026-01-31T12:{second // 60:02}:{second % 60:02}Z"

    def tell(self, robot: str, kind: str, data: dict[str, Any], *, retained: bool = False) -> None:
        self.seconds += 1
        self.board.take(Event(robot, kind, data, retained), self.date)

    def connect(self, robot: str = "MAYA", state: str = "ONLINE", *, retained: bool = False) -> None:
        self.tell(robot, "connection", {"connection": state}, retained=retained)

    def send(self, id_: str, robot: str = "MAYA", by: str = "anna") -> None:
        self.tell(robot, "commands", json.loads(command_text(id_, robot, "pick", PLACE, 60.0, by)))

    def report(self, id_: str, state: str, robot: str = "MAYA") -> None:
        self.tell(robot, "progress", json.loads(StepProgress(id_, StepState(state), self.date).text))

    def end(self, id_: str, error: str | None = None, code: str | None = None, robot: str = "MAYA") -> None:
        self.tell(robot, "results", json.loads(StepEnd(id_, error, code, "accepted", "ended").text))

    def fail(self) -> None:
        self.tell("", "broker", {"code": GONE.code, "error": str(GONE)})

    @property
    def view(self) -> FleetView:
        return self.board.view()

    @property
    def robot(self) -> FleetRobot:
        """The only robot."""
        (robot,) = self.view.robots
        return robot


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def online(told: Told) -> Told:
    told.connect()
    return told


def test_a_step_is_followed_from_its_command_to_its_result(online: Told) -> None:
    assert online.robot == FleetRobot("MAYA", "idle", online.date, online.date)
    since = online.date
    online.send("1")
    assert (online.robot.state, online.robot.waiting, online.robot.heard) == ("waiting", 1, since)
    online.report("1", "accepted")
    assert (online.robot.state, online.robot.waiting, online.robot.step) == ("waiting", 1, None)
    online.report("1", "executing")
    step = FleetStep("1", "executing", online.date, "pick", PLACE, "anna")
    assert online.robot == FleetRobot("MAYA", "working", since, online.date, step)
    online.end("1")
    ended = FleetStep("1", "done", online.date, "pick", PLACE, "anna", 1.0)
    assert online.robot == FleetRobot("MAYA", "idle", since, online.date, None, 0, (ended,))


def test_a_failed_step_has_its_error_until_the_next_step_succeeds(online: Told) -> None:
    online.send("1")
    online.end("1", "no way there", "2101")
    (failed,) = online.robot.last
    assert (online.robot.state, failed.error, failed.code, failed.supervisor) == (
        "failed",
        "no way there",
        "2101",
        "anna",
    )
    online.send("2", by="beto")
    online.report("2", "executing")
    assert online.robot.state == "working"
    online.end("2")
    assert online.robot.state == "idle"
    assert [(step.id, step.state, step.supervisor) for step in online.robot.last] == [
        ("2", "done", "beto"),
        ("1", "failed", "anna"),
    ]


def test_repeated_messages_change_nothing(online: Told) -> None:
    online.send("1")
    online.report("1", "executing")
    executing = online.robot.step
    online.send("1", by="mallory")
    online.report("1", "executing")
    online.report("1", "accepted")
    assert (online.robot.step, online.robot.waiting) == (executing, 0)
    online.end("1")
    ended = online.robot.last
    online.end("1")
    online.send("1")
    online.report("1", "executing")
    assert (online.robot.last, online.robot.step, online.robot.waiting) == (ended, None, 0)


def test_a_step_whose_command_was_not_seen_is_shown_by_its_id(online: Told) -> None:
    online.send("later")
    online.report("earlier", "executing")
    assert online.robot.step == FleetStep("earlier", "executing", online.date)
    assert online.robot.waiting == 1
    online.end("earlier")
    (last,) = online.robot.last
    assert (last.id, last.command, last.duration) == ("earlier", None, 1.0)
    online.end("later")
    assert online.robot.last[0].duration is None


def test_lost_results_of_earlier_steps_do_not_keep_a_robot_busy(online: Told) -> None:
    for id_ in ("1", "2", "3", "4"):
        online.send(id_)
    online.report("1", "executing")
    online.report("3", "executing")
    assert (online.robot.step is not None, online.robot.waiting) == (True, 1)
    online.end("3")
    online.end("4")
    assert (online.robot.state, online.robot.waiting) == ("idle", 0)


def test_a_refused_repetition_of_an_id_is_not_the_result_of_its_step(online: Told) -> None:
    online.send("1")
    online.report("1", "executing")
    other = {"command": "home", "args": {}}
    online.tell("MAYA", "results", json.loads(StepEnd("1", "used", "4012", "a", "a", content=other).text))
    assert (online.robot.state, online.robot.last) == ("working", ())


@pytest.mark.parametrize(
    ("connection", "state"), [("OFFLINE", "offline"), ("CONNECTION_BROKEN", "lost"), ("ONLINE", "idle")]
)
def test_a_stored_connection_has_no_date(told: Told, connection: str, state: str) -> None:
    told.connect(state=connection, retained=True)
    assert told.robot == FleetRobot("MAYA", state)  # type: ignore[arg-type]


def test_a_broken_link_shows_at_once_and_the_step_stays(online: Told) -> None:
    online.send("1")
    online.report("1", "executing")
    online.connect(state="CONNECTION_BROKEN")
    assert (online.robot.state, online.robot.since) == ("lost", online.date)
    assert online.robot.step is not None
    online.connect()
    assert online.robot.state == "working"


def test_without_the_broker_the_robots_of_before_are_kept(online: Told) -> None:
    online.fail()
    lost = online.date
    assert (online.view.link, online.view.since, online.robot.state) == ("lost", lost, "idle")
    assert online.view.trouble is not None
    assert (online.view.trouble.code, online.view.trouble.message) == (GONE.code, str(GONE))
    online.fail()
    assert online.view.since == lost
    online.tell("", "broker", {"code": None, "error": None})
    assert (online.view.link, online.view.trouble, online.robot.state) == ("connected", None, "unknown")
    online.connect(retained=True)
    assert online.robot.state == "idle"


def test_a_broker_that_never_answered_is_not_lost() -> None:
    board = FleetBoard(BROKER)
    board.failed(GONE, "now")
    assert (board.view().link, board.view().trouble is None) == ("connecting", False)


def test_refused_topics_are_named_until_the_next_connection(online: Told) -> None:
    online.tell("", "refused", {"topic": "maya/v1/+/progress"})
    assert online.view.refused
    online.tell("", "broker", {"code": None, "error": None})
    assert not online.view.refused


def test_a_robot_that_was_removed_from_the_broker_is_gone(online: Told) -> None:
    online.tell("MAYA", "removed", {})
    assert online.view.robots == ()


def test_only_robots_with_a_connection_are_listed(told: Told) -> None:
    told.send("1", robot="NOBODY")
    told.end("1", robot="NOBODY")
    told.connect("MAYA", "DANCING")
    told.connect("A" * 65)
    assert told.view.robots == ()


HOSTILE: list[tuple[str, dict[str, Any]]] = [
    ("connection", {}),
    ("connection", {"connection": None}),
    ("connection", {"connection": ["ONLINE"]}),
    ("commands", {"id": None, "command": "home"}),
    ("commands", {"id": 7, "command": "home"}),
    ("commands", {"id": "x" * 201, "command": "home"}),
    ("progress", {}),
    ("progress", {"id": [], "state": "executing", "date": ""}),
    ("progress", {"id": "1", "state": "dancing", "date": ""}),
    ("results", {"id": None, "success": False, "error": "e", "code": "1", "started": "", "finished": ""}),
    ("results", {"id": "1", "success": True}),
]


@pytest.mark.parametrize(("kind", "data"), HOSTILE)
def test_an_invalid_message_shows_no_step(online: Told, kind: str, data: dict[str, Any]) -> None:
    online.tell("MAYA", kind, data)
    assert (online.robot.step, online.robot.waiting, online.robot.last) == (None, 0, ())


def test_texts_of_others_are_cut_and_of_other_types_ignored(online: Told) -> None:
    online.tell("MAYA", "commands", {"id": "1", "command": ["home"], "args": "none", "supervisor": {"name": "x"}})
    online.tell("MAYA", "commands", {"id": "2", "command": "p" * 999, "args": {"q": 1}, "supervisor": "s" * 999})
    online.report("1", "executing")
    assert online.robot.step == FleetStep("1", "executing", online.date)
    online.end("1", "e" * 9999, "c" * 9999)
    online.report("2", "executing")
    assert online.robot.step is not None
    assert (online.robot.step.command, online.robot.step.args, online.robot.step.supervisor) == ("p" * 64, {}, "s" * 64)
    assert len(to_json(online.view)) < 3000


def test_the_view_is_bounded_with_many_robots_and_steps(told: Told) -> None:
    for number in range(MOST_ROBOTS + 30):
        told.connect(f"R{number:04}")
    for number in range(3000):
        told.send(f"{number}", robot="R0000")
    for number in range(40):
        told.end(f"{number}", robot="R0000")
    first = told.view.robots[0]
    assert (len(told.view.robots), told.view.more) == (MOST_ROBOTS, 30)
    assert [step.id for step in first.last] == ["39", "38", "37", "36", "35"][:MOST_LAST]
    assert first.waiting == 1000
    told.tell("R0000", "removed", {})
    told.connect("R0229", "OFFLINE")
    assert (len(told.view.robots), told.view.more) == (MOST_ROBOTS, 29)
