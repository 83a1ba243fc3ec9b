"""Taught places on the command line, without a robot: the pose file next to the configuration is used."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from maya_un.cli.main import main
from maya_un.config import Config
from maya_un.kinematics.mechanism import Mechanism
from maya_un.process.spec.poses import PoseStore
from maya_un.values import Joints, Point

SHELF, BENCH, DESK = Point(0.3, 1.0, 0.4), Point(0.6, 1.0, 0.4), Point(0.3, 1.2, 0.4)


@pytest.fixture
def pose_file(tmp_path: Path) -> Path:
    """Teach three poses in the user's book, and return where it is."""
    place = tmp_path / "config" / "maya" / "poses.toml"
    mechanism = Mechanism.of(Config())
    kept = PoseStore(mechanism, place)
    for name, point in (("shelf", SHELF), ("bench", BENCH), ("desk", DESK)):
        kept.teach(name, mechanism.ik(point), "2026-11-21T16:02:21+00:00")
    return place


def printed(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    assert main(line.split()) == code
    out, err = capsys.readouterr()
    return out + err


def data(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> Any:
    return json.loads(printed(f"{line} --json", capsys, code))


def test_poses_are_listed_renamed_and_removed(pose_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    poses = data("poses", capsys)["poses"]
    assert [(pose["name"], pose["point"]) for pose in poses] == [
        ("shelf", pytest.approx(list(SHELF))),
        ("bench", pytest.approx(list(BENCH))),
        ("desk", pytest.approx(list(DESK))),
    ]
    assert "shelf   300.0 1000.0 400.0" in printed("poses", capsys)
    assert printed("poses rename shelf ledge", capsys) == "shelf is now ledge.\n"
    assert data("poses remove bench", capsys) == {"forgotten": "bench"}
    assert [pose["name"] for pose in data("poses", capsys)["poses"]] == ["ledge", "desk"]


def test_without_a_file_there_are_no_poses(capsys: pytest.CaptureFixture[str]) -> None:
    assert data("poses", capsys) == {"poses": []}
    assert "maya teach NAME" in printed("poses", capsys)
    assert "maya teach-pallet" in printed("pallets", capsys)


def test_a_pallet_is_taught_of_poses(pose_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed("teach-pallet tray --rows 3 --columns 4 shelf bench desk", capsys)
    assert said == "tray, 3 x 4: 300.0 1000.0 400.0 … 600.0 1200.0 400.0 mm\n"
    (pallet,) = data("pallets", capsys)["pallets"]
    assert (pallet["rows"], pallet["columns"], pallet["remarks"]) == (3, 4, [])
    assert "error 4011" in printed("teach-pallet tray --rows 2 --columns 4 shelf bench desk", capsys, 2)
    assert data("teach-pallet tray --rows 2 --columns 4 shelf bench desk --replace", capsys)["rows"] == 2
    assert "error 4001" in printed("poses remove desk", capsys, 2)
    assert printed("pallets rename tray box", capsys) == "tray is now box.\n"
    assert printed("pallets remove box", capsys) == "Removed: box\n"
    assert data("pallets", capsys) == {"pallets": []}


def test_a_pallet_out_of_shape_is_remarked(pose_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mechanism = Mechanism.of(Config())
    PoseStore(mechanism, pose_file).teach("high", mechanism.ik(Point(0.6, 1.2, 0.42)), "")
    said = printed("teach-pallet tray --rows 3 --columns 4 shelf bench desk high", capsys)
    assert said.splitlines()[1] == "  not quite a rectangle: its corners are 5.0 mm off a plane"
    assert printed("pallets --lang es", capsys).splitlines()[1].startswith("  no es del todo")


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("poses remove tray", 4010),
        ("poses rename tray x", 4010),
        ("poses rename shelf bench", 4011),
        ("poses rename shelf 2", 4001),
        ("pallets remove shelf", 4010),
        ("teach-pallet tray --rows 3 --columns 4 shelf bench", 4008),
        ("teach-pallet tray --rows 0 --columns 4", 4008),
        ("teach-pallet tray --rows 3 --columns 4 shelf bench tisch", 4001),
        ("teach-pallet tray --rows 3 shelf bench", 4008),
        ("pick 0.3", 4008),
        ("pick -0.3", 4008),
        ("approach 0.3 1.0", 4008),
        ("move 0.3", 4008),
        ("move shelf 1.2", 4008),
        ("place shelf 1.0", 4001),
    ],
)
def test_impossible_request_is_refused_with_its_code(
    line: str, error: int, pose_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = pose_file.read_text(encoding="utf-8")
    assert f"error {error}: " in printed(line, capsys, 2)
    assert pose_file.read_text(encoding="utf-8") == before


@pytest.mark.parametrize("line", ["teach shelf", "teach-pallet tray --rows 3 --columns 4", "pick shelf", "move shelf"])
def test_command_that_needs_the_robot_reports_it(
    line: str, pose_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "error 1020" in printed(line, capsys, 1)


def test_broken_pose_file_is_reported(pose_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pose_file.write_text("[poses.shelf]\njoints = [1, 2]\n", encoding="utf-8")
    assert f"error 4007: Reading {pose_file} failed: poses.shelf.joints" in printed("poses", capsys, 2)


def test_pose_file_lies_next_to_the_named_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "machine.toml").write_text("")
    PoseStore(Mechanism.of(Config()), tmp_path / "poses.toml").teach("ledge", Joints(0.4, 1.6, 1.3), "")
    named = data(f"poses --config {tmp_path / 'machine.toml'}", capsys)["poses"]
    assert [pose["name"] for pose in named] == ["ledge"]
