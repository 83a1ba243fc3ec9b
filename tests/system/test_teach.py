"""Teaching as people do it: drive there, say what it is called, and use the name."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.system.processes import MAYA, done, running

pytestmark = pytest.mark.system

TABLE = "parts: {cube: [0.50, 1.10]}\nsteps: [home]\n"
JOB = """
steps:
  - pick: shelf
  - place: "tray[2,1]"
  - move: above
"""


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Path]:
    """Keep a homed twin running with a cube on its table; yield the book of taught places."""
    (tmp_path / "table.yaml").write_text(TABLE)
    (tmp_path / "job.yaml").write_text(JOB)
    with running("up --port 0 --speed 200 --table table.yaml") as up:
        up.until("maya home")
        assert done("home")[0] == 0
        yield Path(os.environ["XDG_CONFIG_HOME"]) / "maya" / "poses.toml"


def told(line: str) -> Any:
    """Return what a command prints as JSON."""
    code, text = done(f"{line} --json")
    assert code == 0, text
    return json.loads(text)


def lowered_to(x: float, y: float, z: float, name: str) -> None:
    """Have the gripper go to a place and teach it, as one who drives by hand would end up with."""
    a, b, c = told(f"ik {x} {y} {z}").values()
    assert done(f"move {a} {b} {c}")[0] == 0
    assert told(f"teach {name}")["point"] == pytest.approx([x, y, z], abs=1e-3)


def test_places_are_taught_and_a_job_finds_them(robot: Path) -> None:
    assert "Taught above: " in done("teach above")[1]
    lowered_to(0.5, 1.1, 0.4, "shelf")
    assert done("teach shelf")[1].startswith("maya: error 4011: ")
    lowered_to(1.0, 0.47, 0.4, "near")
    lowered_to(1.12, 0.35, 0.4, "far")
    lowered_to(1.12, 0.47, 0.4, "right")
    assert told("teach-pallet tray --rows 2 --columns 2 near right far")["corners"][3] == pytest.approx(
        [1.24, 0.35, 0.4], abs=2e-3
    )
    code, text = done("run job.yaml --json")
    report = json.loads(text)
    assert (code, report["state"]) == (0, "done"), report["message"]
    assert [step["step"] for step in report["steps"]] == ["pick shelf", "place tray[2,1]", "move above"]
    place = told("poses")["poses"][3]["point"]
    assert report["steps"][1]["end_point"][:2] == pytest.approx(place[:2], abs=1e-3)
    assert done("pick tray[2,1]")[1].endswith("Done.\n")
    assert done("place shelf")[1].endswith("Done.\n")
    assert "rows 1 to 2 and columns 1 to 2" in done("approach tray[3,1]")[1]
    assert robot.read_text(encoding="utf-8").count("[poses.") == 5


def test_what_one_robot_was_taught_the_next_one_knows(robot: Path) -> None:
    assert done("teach above")[0] == 0
    (Path.cwd() / "next.yaml").write_text("steps: [home, {approach: above}, {move: above}]")
    code, text = done("run next.yaml --dry-run --json")
    assert (code, json.loads(text)["state"]) == (0, "done")
    assert done("poses rename above ledge")[0] == 0
    code, text = done("run next.yaml --dry-run")
    assert (code, "error 4003: 'above' is not known; there are ledge." in text) == (2, True)


def test_a_pallet_is_taught_by_driving_to_its_corners(robot: Path) -> None:
    lowered_to(0.47, 1.1, 0.4, "right")
    lowered_to(0.23, 1.1, 0.4, "left")
    command = [MAYA, "teach-pallet", "row", "--rows", "1", "--columns", "3"]
    spoken = subprocess.run(command, input="\nright\n", capture_output=True, text=True, timeout=30, check=False)
    assert spoken.returncode == 0, spoken.stderr
    assert "Drive the gripper to cell [1,1]" in spoken.stderr
    assert "Taught row.1-1: 0.2300 1.1000 0.4000 m" in spoken.stdout
    assert [pose["name"] for pose in told("poses")["poses"]] == ["right", "left", "row.1-1"]
    ended = subprocess.run([*command, "--replace"], input="", capture_output=True, text=True, timeout=30, check=False)
    assert ended.returncode == 130
    again = subprocess.run(command, input="\n\n", capture_output=True, text=True, timeout=30, check=False)
    assert (again.returncode, "error 4011" in again.stderr) == (2, True)
