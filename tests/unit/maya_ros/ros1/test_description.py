"""The program that launch files take the robot's description from."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from maya_ros.graph.urdf import GRIPPER, NAMES, positions
from maya_ros.ros1.description import main
from maya_un.kinematics import Mechanism
from maya_un.values import Joints
from tests.description import MACROS, Tree
from tests.strategies import configuration


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return where the configuration is looked for; the program is called as the launch file calls it."""
    place = tmp_path / "config.toml"
    monkeypatch.setenv("MAYA_CONFIG", str(place))
    monkeypatch.setattr(sys, "argv", ["describe.py", str(MACROS)])
    return place


def test_it_prints_the_description_in_the_configuration_that_is_in_force(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text("[geometry]\nheight = 2.6\n", encoding="utf-8")
    assert main() == 0
    mechanism = Mechanism.of(configuration(geometry={"height": 2.6}))
    joints = Joints(0.5, 2.0, 2.0)
    frame = Tree(capsys.readouterr().out).frame(GRIPPER, dict(zip(NAMES, positions(mechanism, joints), strict=True)))
    assert frame[:3, 3] == pytest.approx(mechanism.fk(joints), abs=1e-9)


def test_a_configuration_that_is_wrong_is_refused_with_its_code(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config.write_text("[geometry]\nheight = -1.0\n", encoding="utf-8")
    assert main() == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("50")
    assert "geometry.height" in told.err


def test_missing_xacro_is_reported(
    config: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    config.write_text("", encoding="utf-8")
    monkeypatch.setitem(sys.modules, "xacro", None)
    assert main() == 1
    told = capsys.readouterr().err
    assert told.startswith("5012 ")
    assert "xacro" in told


def test_closed_output_ends_it_silently(config: Path) -> None:
    config.write_text("", encoding="utf-8")
    script = MACROS.parents[1] / "src" / "maya_controller" / "describe.py"
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, str(script), str(MACROS)], stdout=writing, stderr=subprocess.PIPE, timeout=50, check=False
        )
    finally:
        os.close(writing)
    assert done.stderr == b""
    assert done.returncode != 0
