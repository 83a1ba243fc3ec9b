"""`maya calibrate collect` with a scripted service and a scripted person."""

from __future__ import annotations

import io
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.cli.main import main
from maya_un.client import requests
from maya_un.config import Config, Units
from maya_un.errors import EndNotReached, MayaError, PathRefused, Unreachable
from maya_un.kinematics import Mechanism, Workspace
from maya_un.service.calibration import points
from maya_un.values import Joints
from tests.unit.cli.servers import http_service

CONFIG = Config()
UNITS = Units.of(CONFIG)
MECHANISM = Mechanism.of(CONFIG)
THERE = "{x} {y} {z}\n"
HOME = Joints(0.035, 1.5, 1.3)
Capture = pytest.CaptureFixture[str]


class ScriptedRobot:
    """A robot that reaches each target at once, and its requests."""

    def __init__(self) -> None:
        self.config = CONFIG
        self.homed = True
        self.at = HOME
        self.told: list[Joints] = []
        self.refuse: dict[int, tuple[MayaError, bool]] = {}
        """By number of the command: the error, and whether it comes at once or as the end of the job."""
        self._ended: dict[str, Any] = {}

    def says(self, method: str, path: str, body: Any) -> tuple[int, object]:
        if (method, path) == ("POST", "/v1/tasks"):
            return self._go(Joints(*body["joints"]))
        if path.startswith("/v1/jobs/"):
            return 200, self._ended
        if path == "/v1/status":
            return 200, {"state": self._state(), "last_event": 0, "progress": None}
        return 404, {}

    def _go(self, target: Joints) -> tuple[int, object]:
        self.told.append(target)
        error, at_once = self.refuse.get(len(self.told), (None, False))
        if error is not None and at_once:
            return 409, {"code": error.code, "details": error.details}
        code, message = (0, "") if error is None else (error.code, str(error))
        self._ended = {"state": "failed" if code else "done", "code": code, "message": message, "steps": []}
        if error is None:
            self.at = target
        return 202, {"id": len(self.told)}

    def _state(self) -> dict[str, Any]:
        units = Units.of(self.config)
        counts = units.to_counts(self.at)
        here = units.to_joints(counts)
        place = Mechanism.of(self.config).fk(here)
        return {"counts": counts, "joints": here if self.homed else None, "point": place if self.homed else None}


@pytest.fixture
def scripted_robot() -> Iterator[ScriptedRobot]:
    found = ScriptedRobot()
    with http_service(found.says) as url, runtime.claimed():
        runtime.publish(runtime.Running(url, os.getpid(), None))
        yield found


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "points.csv"


class Person(io.StringIO):
    """Types what the test wants, with {x} or {x_mm} for what is measured where the robot is."""

    def readline(self, size: int | None = -1, /) -> str:
        said = super().readline()
        if "{" not in said:
            return said
        place = dict(zip("xyz", ServiceClient.find().ask(requests.status())["state"]["point"], strict=True))
        return said.format(**place, **{f"{axis}_mm": value * 1e3 for axis, value in place.items()})


def collect(monkeypatch: pytest.MonkeyPatch, file: Path, typed: str, *more: str) -> int:
    monkeypatch.setattr("sys.stdin", Person(typed))
    return main(["calibrate", "collect", str(file), *more])


def refused_path() -> PathRefused:
    return PathRefused(target="there", reason="it leaves the workspace")


def test_typed_values_are_written_with_the_counts_of_the_pose(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    typed = "{x} {y} {z}\n{x_mm}mm, {y_mm}mm, {z_mm}mm\n {x_mm}mm {y}m   {z} \n{x},{y},{z}\n"
    assert collect(monkeypatch, file, typed, "--points", "4") == 0
    seen = points.read(file, CONFIG).observations
    expected = [MECHANISM.fk(UNITS.to_joints(UNITS.to_counts(pose))) for pose in scripted_robot.told]
    assert seen.points == pytest.approx(np.array(expected), abs=1e-6)
    assert [tuple(row) for row in seen.counts.tolist()] == [UNITS.to_counts(pose) for pose in scripted_robot.told]
    assert f"4 points in {file}" in capsys.readouterr().out


def test_poses_are_inside_the_workspace_and_informative(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect(monkeypatch, file, THERE * 10, "--points", "10")
    collect(monkeypatch, file, THERE * 10, "--points", "16")
    assert len(scripted_robot.told) == 16
    assert all(Workspace.of(CONFIG).contains(pose) for pose in scripted_robot.told)
    assert len({tuple(round(value, 6) for value in pose) for pose in scripted_robot.told}) == 16
    assert min(MECHANISM.fk(pose).z for pose in scripted_robot.told) >= 0.25 - 1e-9


def test_a_file_that_is_full_moves_nothing(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect(monkeypatch, file, THERE * 5, "--points", "5")
    del scripted_robot.told[:]
    assert collect(monkeypatch, file, "", "--points", "5") == 0
    assert scripted_robot.told == []


def test_a_pose_is_skipped_and_the_rest_is_left(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert collect(monkeypatch, file, f"s\n{THERE}SKIP\nq\n", "--points", "9") == 0
    assert len(scripted_robot.told) == 4
    (kept,) = points.read(file, CONFIG).observations.counts
    assert tuple(kept.tolist()) == UNITS.to_counts(scripted_robot.told[1])


def test_end_of_input_ends_the_round(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert collect(monkeypatch, file, THERE) == 0
    assert (len(scripted_robot.told), len(points.read(file, CONFIG).observations)) == (2, 1)


def test_a_round_that_brought_nothing_can_be_gone_on_with(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect(monkeypatch, file, "q\n")
    collect(monkeypatch, file, THERE, "--points", "4")
    assert len(points.read(file, CONFIG).observations) == 1
    assert len(scripted_robot.told) == 3


@pytest.mark.parametrize(
    "wrong", ["1 1", "1 1 1 1", "here", "1 1 1deg", "1 1 nan", "1100 700 800", "2 2 2", "{x} -{y} {z}", ""]
)
def test_invalid_input_is_asked_again(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, wrong: str
) -> None:
    collect(monkeypatch, file, f"{wrong}\n{THERE}q\n")
    place = MECHANISM.fk(UNITS.to_joints(UNITS.to_counts(scripted_robot.told[0])))
    assert points.read(file, CONFIG).observations.points == pytest.approx(np.array([place]), abs=1e-6)
    assert "Enter it again" in capsys.readouterr().out
    assert len(scripted_robot.told) == 2


@pytest.mark.parametrize("at_once", [True, False])
def test_a_way_that_is_refused_is_tried_over_the_middle(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    scripted_robot.refuse[1] = refused_path(), at_once
    collect(monkeypatch, file, f"{THERE}q\n")
    first, middle, again, _ = scripted_robot.told
    assert first == again
    assert middle == pytest.approx(Joints(first.a, 1.5, 1.3))
    assert points.read(file, CONFIG).observations.counts[0].tolist() == list(UNITS.to_counts(first))


def test_a_pose_that_cannot_be_reached_at_all_is_left_out(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    scripted_robot.refuse = {
        1: (refused_path(), False),
        2: (Unreachable(target="it", reason="a zone", nearest="none"), True),
    }
    collect(monkeypatch, file, f"{THERE}q\n")
    assert "Left out: The path to there leaves the workspace" in capsys.readouterr().out
    assert points.read(file, CONFIG).observations.counts[0].tolist() == list(UNITS.to_counts(scripted_robot.told[2]))


def test_a_motion_that_fails_ends_the_round_and_keeps_the_points(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    scripted_robot.refuse[3] = EndNotReached(axis="b", distance="3 mm"), False
    assert collect(monkeypatch, file, THERE * 3) == 1
    assert "error 2308" in capsys.readouterr().err
    assert len(points.read(file, CONFIG).observations) == 2


def test_ctrl_c_while_it_asks_ends_the_round(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Impatient(io.StringIO):
        def readline(self, size: int | None = -1, /) -> str:
            raise KeyboardInterrupt

    monkeypatch.setattr("sys.stdin", Impatient())
    assert main(["calibrate", "collect", str(file)]) == 130
    assert len(scripted_robot.told) == 1


def test_a_motion_that_ctrl_c_ends_is_cancelled(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> tuple[dict[str, object], bool]:
        return {"state": "cancelled", "code": 2202, "message": "", "steps": []}, True

    monkeypatch.setattr("maya_un.cli.calibrate.collect.follow", interrupted)
    assert collect(monkeypatch, file, THERE) == 130
    assert len(scripted_robot.told) == 1


def test_a_file_that_cannot_be_read_is_not_gone_on_with(
    scripted_robot: ScriptedRobot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    assert collect(monkeypatch, tmp_path, THERE) == 2
    assert "error 4007" in capsys.readouterr().err
    assert scripted_robot.told == []


def test_json_output_has_only_the_result(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    collect(monkeypatch, file, f"{THERE}s\nq\n", "--json")
    assert json.loads(capsys.readouterr().out) == {"path": str(file), "points": 1, "written": 1}


def test_spanish_is_spoken(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    collect(monkeypatch, file, f"{THERE}q\n", "--lang", "es")
    assert "x y z medidos" in capsys.readouterr().out


def test_a_robot_that_is_not_homed_is_refused(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    scripted_robot.homed = False
    assert collect(monkeypatch, file, "") == 1
    assert "error 2103" in capsys.readouterr().err
    assert not file.exists()


@pytest.mark.parametrize(
    ("section", "key", "value"), [("geometry", "height", 2.36), ("scale", "pulses_per_metre", 1.001e6)]
)
def test_a_robot_that_runs_with_other_constants_is_refused(
    scripted_robot: ScriptedRobot,
    file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: Capture,
    section: str,
    key: str,
    value: float,
) -> None:
    changed = getattr(CONFIG, section).model_copy(update={key: value})
    scripted_robot.config = CONFIG.model_copy(update={section: changed})
    assert collect(monkeypatch, file, THERE) == 2
    assert "another configuration" in capsys.readouterr().err
    assert scripted_robot.told == []


@pytest.mark.parametrize(
    "text",
    [
        "a,b,c,x,y,z\n21261,1500000,1400000,1.1,0.7,0.8\n",
        "# datum 0 574000 565000\na_counts,b_counts,c_counts,x,y,z\n21261,1500000,1400000,1.1,0.7,0.8\n",
        "a_counts,b_counts,c_counts,x,y,z\n21261,1500000,1400000,1.1,0.7,0.8\n",
    ],
    ids=["other head", "other datum", "no datum"],
)
def test_foreign_file_is_not_continued(
    scripted_robot: ScriptedRobot, file: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture, text: str
) -> None:
    file.write_text(text)
    assert collect(monkeypatch, file, THERE) == 2
    assert "give another file" in capsys.readouterr().err
    assert (file.read_text(), scripted_robot.told) == (text, [])


def test_without_a_running_robot_nothing_begins(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert collect(monkeypatch, file, THERE) == 1
    assert not file.exists()


def test_too_few_points_are_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert collect(monkeypatch, file, "", "--points", "3") == 2
