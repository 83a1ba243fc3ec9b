"""Disks that are full, files that may only be read, files that are damaged: said plainly, and the robot is at rest.

Whatever was acknowledged before is kept, and nothing begins that could not be written down.
"""

from __future__ import annotations

import http.client
import json
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.journals import content, damage, looked_up, overwrite
from tests.system.disks import UNPRIVILEGED, Disk, disk, kinds
from tests.system.processes import Process

pytestmark = pytest.mark.system

SPEED = "200"
LONG = {"name": "long", "steps": ["home", *[{"gripper": state} for state in ("open", "close") * 10]]}
"""A homing, which takes a while, and steps that would follow at once."""
SHORT = {"name": "short", "steps": [{"gripper": "open"}], "parts": {f"part{n}": [0.5, 1.1] for n in range(300)}}
"""Some kilobytes, to fill what little is left."""
QUIET = ("/bin/sh", "-c", 'exec "$@" 2>/dev/null', "sh")
"""Before a command: what it logs goes nowhere, for nobody reads it."""
LOOKS = 400
"""So often it is looked whether something has happened; each look waits for an event, or 0.1 s."""


@dataclass(slots=True)
class Running:
    """A `maya up` of its own and the way to ask it."""

    process: Process
    url: str
    pid: int

    def ask(self, method: str, path: str, body: object = None) -> tuple[int, Any]:
        """Return status and answer of a request."""
        connection = http.client.HTTPConnection(self.url.removeprefix("http://"), timeout=30.0)
        try:
            data = None if body is None else json.dumps(body)
            connection.request(method, path, data, {"Content-Type": "application/json"})
            answer = connection.getresponse()
            text = answer.read()
            return answer.status, json.loads(text) if text else None
        finally:
            connection.close()

    def until(self, holds: Callable[[Any], bool], path: str = "/v1/queue") -> Any:
        """Look at something until it is so, and return it."""
        found: Any = None
        for _ in range(LOOKS):
            found = self.ask("GET", path)[1]
            if holds(found):
                return found
            last = self.ask("GET", "/v1/status")[1]["last_event"]
            self.ask("GET", f"/v1/events?since={last}&wait=0.1")
        raise AssertionError(f"it never was so: {found}")

    def submit_until_refused(self) -> tuple[set[int], Any]:
        """Submit until it is refused; return the numbers that were acknowledged, and the refusal."""
        kept: set[int] = set()
        for _ in range(2000):
            status, answer = self.ask("POST", "/v1/jobs", SHORT)
            if status >= 400:
                assert status == 503, answer
                return kept, answer
            kept.add(answer["id"])
        raise AssertionError("it was never refused")

    def end(self) -> None:
        """End it as a person does."""
        self.process.send(signal.SIGTERM)
        code, said = self.process.end()
        assert code == 0, said


@contextmanager
def up() -> Iterator[Running]:
    """Run `maya up` on a twin while the block runs."""
    process = Process(f"up --port 0 --speed {SPEED} --json", before=QUIET)
    try:
        url = process.until('"url"').split('"')[3]
        yield Running(process, url, int(process.until('"pid"').strip(",").split()[-1]))
    finally:
        process.kill()


def refused(*, before: tuple[str, ...] = ()) -> tuple[int, str]:
    """Return how a `maya up` ends that cannot begin, and what it says."""
    return Process(f"up --port 0 --speed {SPEED}", before=before).end()


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of state of this test's commands."""
    folder = tmp_path / "kept"
    monkeypatch.setenv("MAYA_STATE_DIR", str(folder))
    return folder


def fill(robot: Running, place: Disk) -> tuple[set[int], Any]:
    place.fill(robot.pid)
    return robot.submit_until_refused()


def at_rest(robot: Running) -> bool:
    return robot.ask("GET", "/v1/status")[1]["state"]["mode"] == "idle"


@pytest.mark.parametrize("kind", kinds())
def test_on_a_full_disk_the_step_under_way_ends_and_none_begins(state: Path, kind: str) -> None:
    with disk(kind, state) as place:
        with up() as robot:
            status, accepted = robot.ask("POST", "/v1/jobs", LONG)
            assert status < 300
            robot.until(lambda queue: queue["running"] is not None)
            kept, refusal = fill(robot, place)
            assert refusal["code"] == 5007
            paused = robot.until(lambda queue: queue["mode"] == "paused" and at_rest(robot))
            assert paused["reason"] == "storage"
            steps = robot.ask("GET", f"/v1/jobs/{accepted['id']}")[1]["steps"]
            assert [step["state"] for step in steps] == ["done", *["queued"] * 20]
            assert robot.ask("GET", "/v1/status")[1]["state"]["homed"]
            assert robot.ask("POST", "/v1/jobs", SHORT)[1]["code"] == 5007
            assert robot.ask("POST", "/v1/queue/resume")[1]["code"] == 5007

            place.make_room(robot.pid)
            assert robot.ask("POST", "/v1/queue/resume")[0] < 300
            robot.until(lambda job: job["state"] == "done", f"/v1/jobs/{accepted['id']}")
            robot.end()
        states = dict(looked_up(state / "maya.db", "SELECT id, state FROM jobs"))
        assert set(states) == {accepted["id"], *kept}
        assert looked_up(state / "maya.db", "PRAGMA integrity_check") == [("ok",)]


def test_a_stop_needs_no_disk(state: Path) -> None:
    with disk("quota", state) as place, up() as robot:
        robot.ask("POST", "/v1/jobs", LONG)
        robot.until(lambda queue: queue["running"] is not None)
        fill(robot, place)
        assert robot.ask("POST", "/v1/stop")[0] < 300
        robot.until(lambda status: status["state"]["mode"] not in {"homing", "moving", "stopping"}, "/v1/status")
        assert robot.until(lambda queue: queue["mode"] == "paused")["running"] is None


def test_a_killed_one_on_a_full_disk_has_lost_nothing_that_was_acknowledged(state: Path) -> None:
    with disk("quota", state) as place:
        with up() as robot:
            robot.ask("POST", "/v1/jobs", LONG)
            kept, _ = fill(robot, place)
            robot.process.kill()
        with up() as robot:
            queue = robot.ask("GET", "/v1/queue")[1]
            assert (queue["mode"], queue["reason"]) == ("paused", "restart")
            known = {line["id"] for line in robot.ask("GET", "/v1/jobs?limit=1000")[1]}
            assert known == {1, *kept}


@pytest.mark.parametrize("rights", [(0o400, 0o700), (0o600, 0o500)], ids=["file", "folder"])
def test_what_may_only_be_read_is_said_before_anything_begins(state: Path, rights: tuple[int, int]) -> None:
    with up() as robot:
        robot.end()
    (state / "maya.db.lock").unlink()
    before = content(state / "maya.db")
    (state / "maya.db").chmod(rights[0])
    state.chmod(rights[1])
    code, said = refused(before=UNPRIVILEGED)
    state.chmod(0o700)
    assert code == 2, said
    assert "error 5002" in said
    assert str(state / "maya.db") in said
    assert content(state / "maya.db") == before


def test_a_damaged_file_is_refused_and_left_as_it_is(state: Path) -> None:
    with up() as robot:
        robot.ask("POST", "/v1/jobs", SHORT)
        robot.end()
    before = damage(state / "maya.db")
    code, said = refused()
    assert code == 2, said
    assert "error 5008" in said
    assert content(state / "maya.db") == before
    overwrite(state / "maya.db", b"rubbish")
    assert "error 5008" in refused()[1]


@pytest.mark.parametrize("what", ["moved", "cut short"])
def test_a_file_that_is_lost_while_it_is_in_use_is_said_and_nothing_more_begins(state: Path, what: str) -> None:
    with up() as robot:
        robot.ask("POST", "/v1/jobs", LONG)
        robot.until(lambda queue: queue["running"] is not None)
        if what == "moved":
            state.rename(state.with_name("elsewhere"))
        else:
            overwrite(state / "maya.db", b"")
        status, refusal = robot.ask("POST", "/v1/jobs", SHORT)
        assert (status, refusal["code"]) == (503, 5007)
        assert what in json.dumps(refusal)
        paused = robot.until(lambda queue: queue["mode"] == "paused" and at_rest(robot))
        assert paused["reason"] == "storage"
        robot.process.send(signal.SIGTERM)
        robot.process.end()


def test_a_file_that_is_damaged_while_it_is_in_use_ends_in_refusals_and_rest(state: Path) -> None:
    with up() as robot:
        numbers = [robot.ask("POST", "/v1/jobs", SHORT)[1]["id"] for _ in range(30)]
        robot.until(lambda queue: not queue["counts"])
        robot.end()
    with up() as robot:
        robot.ask("POST", "/v1/jobs", LONG)
        robot.until(lambda queue: queue["running"] is not None)
        damage(state / "maya.db")
        answers = [robot.ask("GET", f"/v1/jobs/{number}") for number in numbers]
        refusals = {answer["code"] for status, answer in answers if status >= 400}
        assert 5008 in refusals
        assert refusals <= {5007, 5008}
        assert robot.ask("POST", "/v1/stop")[0] < 300
        robot.until(lambda status: status["state"]["mode"] not in {"homing", "moving", "stopping"}, "/v1/status")
        robot.process.send(signal.SIGTERM)
        robot.process.end()
    assert "error 5008" in refused()[1]
