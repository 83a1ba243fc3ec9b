"""Teaching as people do it: drive there, say what it is called, and use the name."""

from __future__ import annotations

import io
import json
import os
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from maya_un.cli.main import main
from tests.system.processes import running

pytestmark = pytest.mark.system

TABLE = "parts: {cube: [0.50, 1.10]}\nsteps: [home]\n"
JOB = """
steps:
  - pick: shelf
  - place: "tray[2,1]"
  - move: above
"""

Say = Callable[..., str]
"""Gives a command and returns what it prints; `code` is how it is to end."""


@pytest.fixture
def say(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Iterator[Say]:
    """Keep a homed twin running with a cube on its table."""

    def said(line: str, code: int = 0) -> str:
        ended = main(shlex.split(line))
        out, err = capsys.readouterr()
        assert ended == code, out + err
        return out + err

    (tmp_path / "table.yaml").write_text(TABLE)
    (tmp_path / "job.yaml").write_text(JOB)
    with running("up --port 0 --speed 100 --table table.yaml") as up:
        up.until("maya home")
        said("home")
        yield said


def json_of(say: Say, line: str) -> Any:
    """Return what a command prints as JSON."""
    return json.loads(say(f"{line} --json"))


def driven_to(say: Say, x: float, y: float, name: str | None = None) -> None:
    """Have the gripper stand at a place of the table, and teach it."""
    a, b, c = json_of(say, f"ik {x} {y} 0.4").values()
    say(f"move {a} {b} {c}")
    if name is not None:
        assert json_of(say, f"teach {name}")["point"] == pytest.approx([x, y, 0.4], abs=1e-3)


@pytest.mark.waits("2.4 s of homing at a hundred times real speed and about 4 s of motion, through HTTP")
def test_places_are_taught_and_a_job_finds_them(say: Say) -> None:
    assert say("teach above").startswith("Taught above: ")
    driven_to(say, 0.5, 1.1, "shelf")
    assert say("teach shelf", 2).startswith("maya: error 4011: ")
    for name, x, y in (("near", 1.0, 0.47), ("right", 1.12, 0.47), ("far", 1.0, 0.35)):
        driven_to(say, x, y, name)
    corners = json_of(say, "teach-pallet tray --rows 2 --columns 2 near right far")["corners"]
    assert corners[3] == pytest.approx([1.12, 0.35, 0.4], abs=2e-3)
    report = json_of(say, "run job.yaml")
    assert [step["step"] for step in report["steps"]] == ["pick shelf", "place tray[2,1]", "move above"]
    above = json_of(say, "poses")["poses"][0]
    assert report["steps"][2]["end_point"] == pytest.approx(above["point"], abs=2e-4)
    assert say("pick tray[2,1]").endswith("Done.\n")
    assert say("place shelf").endswith("Done.\n")
    assert "rows 1 to 2 and columns 1 to 2" in say("approach tray[3,1]", 2)


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, through HTTP")
def test_poses_taught_to_one_robot_are_known_to_the_next(say: Say) -> None:
    say("teach above")
    book = Path(os.environ["XDG_CONFIG_HOME"]) / "maya" / "poses.toml"
    assert book.read_text(encoding="utf-8").count("[poses.") == 1
    Path("next.yaml").write_text("steps: [home, {approach: above}, {move: above}]", encoding="utf-8")
    assert json_of(say, "run next.yaml --dry-run")["state"] == "done"
    say("poses rename above ledge")
    assert "error 4003: There is no 'above'. Known: ledge." in say("run next.yaml --dry-run", 2)


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, through HTTP")
def test_a_pallet_is_taught_by_driving_to_its_corners(say: Say, monkeypatch: pytest.MonkeyPatch) -> None:
    driven_to(say, 0.47, 1.1, "right")
    driven_to(say, 0.23, 1.1)
    monkeypatch.setattr("sys.stdin", io.StringIO("\nright\n"))
    spoken = say("teach-pallet row --rows 1 --columns 3")
    assert "Drive the gripper to cell [1,1]" in spoken
    assert "Taught row.1-1: 230.0 1100.0 400.0 mm" in spoken
    assert [pose["name"] for pose in json_of(say, "poses")["poses"]] == ["right", "row.1-1"]
    say("teach-pallet row --rows 1 --columns 3 --replace", 130)
    assert "error 4011" in say("teach-pallet row --rows 1 --columns 3", 2)
