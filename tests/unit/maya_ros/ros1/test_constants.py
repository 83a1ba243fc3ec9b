"""The manual's constants, from the configuration."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from math import pi
from pathlib import Path

import pytest

from maya_ros.ros1.constants import constants, main
from maya_un.config.files import parse

MANUAL = {
    "MAYA_ADDRESS": "192.168.1.156", "COMS_SERVER_ADDRESS": "http://localhost:3000",
    "PULSES_PER_M": 1_000_000.0, "PULSES_PER_DEG": 371.06, "MAYA_HEIGHT": 2.35, "MAYA_LENGTH": 2.3,
    "A_0": 0, "A_MAX": 2 * pi / 3, "B_0": 0.575, "C_0": 0.565, "B_MAX": 2.260, "C_MAX": 2.300,
    "DELTA": 0.30, "SIGMA": 0.20,
    "ACCEL_A": 1024, "ACCEL_B": 5120, "ACCEL_C": 5120, "DCEL_A": 1024, "DCEL_B": 5120, "DCEL_C": 5120,
    "SP_A": 1000, "SP_B": 45000, "SP_C": 45000,
}  # fmt: skip


def test_without_a_configuration_they_are_the_manuals() -> None:
    assert constants(parse({})) == MANUAL


def test_configuration_changes_the_constants() -> None:
    machine = parse({"geometry": {"height": 2.5}, "axes": {"c": {"maximum": 2.2}}})
    changed = {name: value for name, value in constants(machine).items() if value != MANUAL[name]}
    assert changed == {"MAYA_HEIGHT": 2.5, "C_MAX": 2.2}


def test_they_are_printed_for_other_pythons(tmp_path: Path) -> None:
    file = tmp_path / "maya.toml"
    file.write_text("[geometry]\nheight = 2.5\n")
    told = subprocess.run(
        [sys.executable, "-m", "maya_ros.ros1.constants"],
        env={**os.environ, "MAYA_CONFIG": str(file)}, stdout=subprocess.PIPE, check=True,
    )  # fmt: skip
    assert json.loads(told.stdout) == {**MANUAL, "MAYA_HEIGHT": 2.5}


def test_broken_configuration_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MAYA_CONFIG", str(tmp_path / "missing.toml"))
    assert main() == 1
    assert "missing.toml" in capsys.readouterr().err
