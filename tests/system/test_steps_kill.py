"""Steps in a program that is killed at any instant: none is carried out twice, each has one result in the end."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from maya_un.steps.text import INTERRUPTED
from tests.campaign import Campaign
from tests.fork_server import WarmPopen
from tests.system.disks import Disk, Quota, TinyDisk, disk, kinds

pytestmark = pytest.mark.system

WORKER = Path(__file__).with_name("step_worker.py")


class Bridge:
    """The program, and its output so far."""

    def __init__(self, place: Path) -> None:
        self.said: list[str] = []
        self._popen = WarmPopen([str(WORKER), str(place)], with_input=True)
        self._output = io.TextIOWrapper(io.BufferedReader(self._popen.stdout), encoding="utf-8")

    def say(self, line: str) -> None:
        assert self._popen.stdin is not None
        self._popen.stdin.write(line.encode() + b"\n")

    def command(self, id_: str, name: str = "home") -> None:
        self.say(json.dumps({"id": id_, "command": name, "args": {}}))

    def hear(self, begins: str) -> str:
        """Return the rest of the next line that begins so; fails where there is none."""
        for line in self._output:
            self.said.append(line)
            if line.startswith(begins):
                return line.removeprefix(begins).strip()
        raise AssertionError(f"it ended without {begins!r}")

    def result(self) -> dict[str, Any]:
        return json.loads(self.hear("result "))

    @property
    def pid(self) -> int:
        return self._popen.pid

    def kill(self) -> str:
        """Kill it with -9; return the rest of its output."""
        if self._output.closed:
            return ""
        self._popen.kill()
        rest = self._output.read()
        self._popen.wait(timeout=30.0)
        self._popen.close()
        self._output.close()
        self.said += rest.splitlines()
        return rest


@contextmanager
def bridge(place: Path) -> Iterator[Bridge]:
    program = Bridge(place)
    try:
        program.hear("ready")
        yield program
    finally:
        program.kill()


def test_step_running_at_the_kill_is_interrupted_and_never_repeated(tmp_path: Path) -> None:
    place = tmp_path / "steps.db"
    with bridge(place) as program:
        program.command("1")
        assert program.hear("begun ") == "home"
    with bridge(place) as program:
        told = program.result()
        assert (told["id"], told["success"], told["code"]) == ("1", False, INTERRUPTED)
        program.command("1")
        assert program.result() == told
        program.command("2")
        assert program.hear("begun ") == "home"
        program.say("end")
        assert (program.result()["id"], "begun" in program.kill()) == ("2", False)


def test_step_done_before_the_kill_stays_done(tmp_path: Path) -> None:
    place = tmp_path / "steps.db"
    with bridge(place) as program:
        program.command("1")
        program.hear("begun ")
        program.say("end")
        told = program.result()
    with bridge(place) as program:
        program.command("1")
        assert program.result() == told
        assert "begun" not in program.kill()


def ended_on_a_full_disk(program: Bridge, place: Disk) -> None:
    """Carry out step 1 while there is no room for its result."""
    program.command("1")
    program.hear("begun ")
    place.fill(program.pid)
    program.say("end")
    assert "full" in program.hear("problem the result of step 1 ") or isinstance(place, Quota)
    program.command("2")
    refused = program.result()  # the first reported one
    assert (refused["id"], refused["code"]) == ("2", "5007")


@pytest.mark.parametrize("kind", kinds())
def test_result_waits_for_space_on_a_full_disk_and_is_unchanged(tmp_path: Path, kind: str) -> None:
    with disk(kind, tmp_path / "disk") as place:
        with bridge(place.folder / "steps.db") as program:
            ended_on_a_full_disk(program, place)
            place.make_room(program.pid)
            told = program.result()
            assert (told["id"], told["success"]) == ("1", True)
            program.command("1")
            assert program.result() == told
        with bridge(place.folder / "steps.db") as program:
            program.command("1")
            assert program.result() == told
            assert "begun" not in program.kill()


@pytest.mark.parametrize("kind", kinds())
def test_killed_on_a_full_disk_a_step_has_one_result_in_the_end(tmp_path: Path, kind: str) -> None:
    with disk(kind, tmp_path / "disk") as place:
        with bridge(place.folder / "steps.db") as program:
            ended_on_a_full_disk(program, place)
            assert "result" not in program.kill()
        if isinstance(place, TinyDisk):
            place.make_room(program.pid)
        with bridge(place.folder / "steps.db") as program:
            told = program.result()
            assert (told["id"], told["code"]) == ("1", INTERRUPTED)
            program.command("1")
            assert program.result() == told


def test_step_killed_at_any_instant_begins_at_most_once(campaign: Campaign, tmp_path: Path) -> None:
    """The kill comes with the command, with the end of its task, or after its result."""
    for case in range(campaign.size(ci=4, long=200)):
        rng = campaign.rng(case)
        begun, results = 0, set[str]()
        for _ in range(3):
            with bridge(tmp_path / f"{case}.db") as program:
                program.command("1")
                if rng.random() < 0.6:
                    program.say("end")
                    if rng.random() < 0.5:
                        program.result()
                program.kill()
            begun += sum(line.startswith("begun") for line in program.said)
            results |= {line.strip() for line in program.said if line.startswith("result ")}
        assert begun <= 1
        assert len(results) <= 1
