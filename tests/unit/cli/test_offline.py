"""fk, ik, reach and config: no robot needed."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from maya_un.cli.main import main


def answered(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, object]:
    """Return what a command prints as JSON."""
    assert main([*line.split(), "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_fk_and_ik_are_each_others_inverse(capsys: pytest.CaptureFixture[str]) -> None:
    joints = answered("ik 0.5 1.2 0.4", capsys)
    point = answered(f"fk {joints['a']} {joints['b']} {joints['c']}", capsys)
    assert point == pytest.approx({"x": 0.5, "y": 1.2, "z": 0.4}, abs=1e-12)


def test_units_say_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert answered("ik 500mm 120cm 0.4m", capsys) == pytest.approx(answered("ik 0.5 1.2 0.4", capsys))


def test_a_negative_number_is_a_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ik", "-0.2", "1.1", "0.4"]) == 1
    assert "error 2101" in capsys.readouterr().err


def test_reach_names_reason_and_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    found = answered("reach 0 2.2 2.3", capsys, code=1)
    nearest = found["nearest"]
    assert found["reachable"] is False
    assert found["joints"] is None
    assert found["reason"]
    assert isinstance(nearest, dict)
    there = answered(f"reach {nearest['x']} {nearest['y']} {nearest['z']}", capsys)
    assert (there["reachable"], there["reason"]) == (True, None)


def test_people_get_degrees_and_millimetres(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reach", "0.5", "1.2", "0.4"]) == 0
    assert "reachable: a 22.6199°" in capsys.readouterr().out


def test_config_init_writes_what_check_accepts_and_never_overwrites(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "new" / "maya.toml")
    assert main(["config", "init", file]) == 0
    assert main(["config", "check", file]) == 0
    assert main(["config", "init", file]) == 2
    assert "error 5002" in capsys.readouterr().err


def test_config_show_is_toml_in_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    file.write_text("[cell]\nclearance = 0.2\n")
    assert main(["config", "show", "--config", str(file)]) == 0
    assert tomllib.loads(capsys.readouterr().out)["cell"]["clearance"] == 0.2


def test_config_check_without_a_file_says_that_the_defaults_hold(capsys: pytest.CaptureFixture[str]) -> None:
    assert answered("config check", capsys)["exists"] is False


def test_the_configuration_named_is_the_one_used(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    file.write_text("[safety]\ntension_limit = 2.0\n")
    assert answered("reach 0 1.3 2.0", capsys)["reachable"] is True
    assert answered(f"reach 0 1.3 2.0 --config {file}", capsys, code=1)["reachable"] is False
