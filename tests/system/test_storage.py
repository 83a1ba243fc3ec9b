"""Disks that are full, read-only files, damaged files: reported plainly, and the robot is at rest.

Acknowledged rows are kept, and nothing begins that could not be written.
"""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import pytest

from tests.journals import content, damage, looked_up, overwrite
from tests.system.disks import UNPRIVILEGED, Disk, TinyDisk, disk, kinds
from tests.system.processes import CALM, Process
from tests.system.robots import Running, up

pytestmark = pytest.mark.system

TWIN = f"--speed 100 {CALM}"
UNIT = Path(__file__).resolve().parents[2] / "contrib" / "systemd" / "maya.service"
LONG = {"name": "long", "steps": ["home", *[{"gripper": state} for state in ("open", "close") * 10]]}
"""A homing, which takes a while, and steps that would follow at once."""
SHORT = {"name": "short", "steps": [{"gripper": "open"}], "parts": {f"part{n}": [0.5, 1.1] for n in range(300)}}
"""Some kilobytes, to fill what little is left."""


def submit_until_refused(robot: Running) -> tuple[set[int], Any]:
    """Submit until it is refused; return the numbers that were acknowledged, and the refusal."""
    kept: set[int] = set()
    for _ in range(2000):
        status, answer = robot.ask("POST", "/v1/jobs", SHORT)
        if status >= 400:
            assert status == 503, answer
            return kept, answer
        kept.add(answer["id"])
    raise AssertionError("it was never refused")


def refused(*, before: tuple[str, ...] = ()) -> tuple[int, str]:
    """Return the exit code and the output of a `maya up` that cannot start."""
    return Process(f"up --port 0 {TWIN}", before=before).end()


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of state of this test's commands."""
    folder = tmp_path / "kept"
    monkeypatch.setenv("MAYA_STATE_DIR", str(folder))
    return folder


def fill(robot: Running, place: Disk) -> tuple[set[int], Any]:
    place.fill(robot.pid)
    return submit_until_refused(robot)


def homing(robot: Running) -> Any:
    """Submit the long job and wait until its first step moves the robot; return what was accepted."""
    status, accepted = robot.ask("POST", "/v1/jobs", LONG)
    assert status < 300, accepted
    robot.until(lambda status: status["state"]["mode"] == "homing", "/v1/status")
    return accepted


def paused_at_rest(robot: Running) -> Any:
    """Wait until nothing moves and nothing begins; return the queue."""
    robot.until(lambda status: (status["state"]["mode"], status["queue"]) == ("idle", "paused"), "/v1/status")
    return robot.ask("GET", "/v1/queue")[1]


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, between processes in real time")
@pytest.mark.parametrize("kind", kinds())
def test_on_a_full_disk_the_step_under_way_ends_and_none_begins(state: Path, kind: str) -> None:
    with disk(kind, state) as place:
        with up(TWIN) as robot:
            accepted = homing(robot)
            kept, refusal = fill(robot, place)
            assert refusal["code"] == 5007
            paused = paused_at_rest(robot)
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
        if isinstance(place, TinyDisk):
            place.fill(robot.pid)
            code, said = refused()
            assert (code, "error 5014" in said, "full" in said) == (1, True, True), said


@pytest.mark.parametrize("kind", kinds())
def test_disk_that_fills_up_at_rest_fails_readiness_and_halts_the_queue(state: Path, kind: str) -> None:
    with disk(kind, state) as place, up(TWIN) as robot:
        robot.until(lambda answer: answer["ready"], "/v1/ready")
        fill(robot, place)
        reasons = robot.until(lambda answer: not answer["ready"], "/v1/ready")["reasons"]
        assert [reason["code"] for reason in reasons] == [5007]
        queue = robot.ask("GET", "/v1/queue")[1]
        assert (queue["mode"], queue["reason"]) == ("paused", "storage")
        place.make_room(robot.pid)
        robot.until(lambda answer: answer["ready"], "/v1/ready")
        robot.end()


def test_full_disk_fails_readiness_before_the_next_write(state: Path) -> None:
    with disk("quota", state) as place, up(TWIN) as robot:
        robot.until(lambda answer: answer["ready"], "/v1/ready")
        place.fill(robot.pid)
        reasons = robot.until(lambda answer: not answer["ready"], "/v1/ready")["reasons"]
        assert [reason["code"] for reason in reasons] == [5007]
        assert robot.ask("GET", "/v1/queue")[1]["reason"] == "storage"
        place.make_room(robot.pid)
        robot.until(lambda answer: answer["ready"], "/v1/ready")
        robot.end()


@pytest.mark.skipif("tiny disk" not in kinds(), reason="mounting is not allowed here")
def test_start_on_a_read_only_disk_ends_so_that_systemd_tries_again(state: Path) -> None:
    with disk("tiny disk", state) as place:
        assert isinstance(place, TinyDisk)
        with up(TWIN) as robot:
            robot.end()
        place.remount("ro")
        code, said = refused()
        place.remount("rw")
        assert (code, "error 5014" in said) == (1, True), said
        assert "RestartPreventExitStatus=2" in UNIT.read_text(encoding="utf-8")
        with up(TWIN) as robot:
            robot.end()


def test_a_stop_needs_no_disk(state: Path) -> None:
    with disk("quota", state) as place, up(TWIN) as robot:
        homing(robot)
        fill(robot, place)
        assert robot.ask("POST", "/v1/stop")[0] < 300
        robot.until(lambda status: status["state"]["mode"] not in {"homing", "moving", "stopping"}, "/v1/status")
        assert robot.until(lambda queue: queue["mode"] == "paused")["running"] is None


def test_a_killed_one_on_a_full_disk_has_lost_nothing_that_was_acknowledged(state: Path) -> None:
    with disk("quota", state) as place:
        with up(TWIN) as robot:
            robot.ask("POST", "/v1/jobs", LONG)
            kept, _ = fill(robot, place)
            robot.process.kill()
        with up(TWIN) as robot:
            queue = robot.ask("GET", "/v1/queue")[1]
            assert (queue["mode"], queue["reason"]) == ("paused", "restart")
            known = {line["id"] for line in robot.ask("GET", "/v1/jobs?limit=1000")[1]}
            assert known == {1, *kept}


@pytest.mark.parametrize("rights", [(0o400, 0o700), (0o600, 0o500)], ids=["file", "folder"])
def test_read_only_file_is_reported_before_anything_begins(state: Path, rights: tuple[int, int]) -> None:
    with up(TWIN) as robot:
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
    with up(TWIN) as robot:
        robot.ask("POST", "/v1/jobs", SHORT)
        robot.end()
    before = damage(state / "maya.db")
    code, said = refused()
    assert code == 2, said
    assert "error 5008" in said
    assert content(state / "maya.db") == before
    overwrite(state / "maya.db", b"rubbish")
    assert "error 5008" in refused()[1]


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, between processes in real time")
@pytest.mark.parametrize("what", ["moved", "cut short"])
def test_file_lost_in_use_is_reported_and_nothing_more_begins(state: Path, what: str) -> None:
    with up(TWIN) as robot:
        homing(robot)
        if what == "moved":
            state.rename(state.with_name("elsewhere"))
        else:
            overwrite(state / "maya.db", b"")
        status, refusal = robot.ask("POST", "/v1/jobs", SHORT)
        assert (status, refusal["code"]) == (503, 5007)
        assert what in json.dumps(refusal)
        paused = paused_at_rest(robot)
        assert paused["reason"] == "storage"
        robot.process.send(signal.SIGTERM)
        robot.process.end()


def test_a_file_that_is_damaged_while_it_is_in_use_ends_in_refusals_and_rest(state: Path) -> None:
    with up(TWIN) as robot:
        numbers = [robot.ask("POST", "/v1/jobs", SHORT)[1]["id"] for _ in range(30)]
        robot.until(lambda queue: not queue["counts"])
        robot.end()
    with up(TWIN) as robot:
        homing(robot)
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
