from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from maya_un.cli.main import main
from maya_un.config import default_path, load
from maya_un.kinematics.calibration import Observations
from tests.unit.kinematics.calibration.bench import TRUTH, measured, random_counts

Capture = pytest.CaptureFixture[str]


def written(tmp_path: Path, seen: Observations, head: str = "a,b,c,x,y,z") -> str:
    rows = [
        ",".join(f"{value:.6f}" for value in (*counts, *place))
        for counts, place in zip(seen.counts, seen.points, strict=True)
    ]
    path = tmp_path / "points.csv"
    path.write_text("\n".join([head, *rows]) + "\n")
    return str(path)


@pytest.fixture
def points(tmp_path: Path) -> str:
    """A good file of 30 points, the fifth of which is wrong by a hand's breadth."""
    rng = np.random.default_rng(21)
    seen = measured(TRUTH, random_counts(rng, 30), rng)
    places = seen.points.copy()
    places[4] += np.array([0.08, 0.0, -0.05])
    return written(tmp_path, Observations(seen.counts, places))


def output_of(capsys: Capture, *arguments: str, code: int = 0) -> str:
    assert main(list(arguments)) == code
    out, err = capsys.readouterr()
    return out if code == 0 else err


def data(capsys: Capture, *arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(output_of(capsys, *arguments, "--json"))
    return found


def test_table_shows_target_values_and_uncertainty(points: str, capsys: Capture) -> None:
    shown = output_of(capsys, "calibrate", points)
    rows = {line[:18].strip(): line[18:].split() for line in shown.splitlines()[1:10]}
    assert rows["height (H)"][:2] == ["mm", "2350.00"]
    assert float(rows["height (H)"][2]) == pytest.approx(2362.0, abs=5.0)
    assert rows["gripper_height (Φ)"] == ["mm", "200.00", "200.00", "fixed"]
    assert float(rows["zero of a"][2]) == pytest.approx(0.573, abs=0.1)
    assert "29 of 30 points" in shown
    assert "The fit ignored these rows as outliers: 6 (9" in shown
    assert "only their difference" in shown
    assert not default_path().exists()


def test_as_json_it_is_si(points: str, capsys: Capture) -> None:
    found = data(capsys, "calibrate", points)
    constants = {constant["name"]: constant for constant in found["constants"]}
    assert constants["zero_a"]["fitted"] == pytest.approx(TRUTH.zero_a, abs=5.0 * constants["zero_a"]["error"])
    assert constants["gripper_height"] == {
        "name": "gripper_height", "now": 0.2, "fitted": 0.2, "error": None, "held": True
    }  # fmt: skip
    assert (found["outliers"], found["used"], found["measured"], found["applied"]) == ([6], 29, 30, None)
    assert found["rms_after"] < 0.003
    assert found["rms_before"] > 0.01
    assert found["keys"]["geometry.height"] == pytest.approx(constants["height"]["fitted"])
    assert np.array(found["correlations"]).shape == (8, 8)


def test_spanish_is_spoken(points: str, capsys: Capture) -> None:
    shown = output_of(capsys, "calibrate", points, "--lang", "es")
    assert "29 de 30 puntos" in shown
    assert "El ajuste ignoró estas filas" in shown


def test_fit_option_may_be_given_or_omitted(points: str, capsys: Capture) -> None:
    assert output_of(capsys, "calibrate", "fit", points) == output_of(capsys, "calibrate", points)


def test_held_parameter_is_shown_as_held(points: str, capsys: Capture) -> None:
    found = data(capsys, "calibrate", points, "--hold", "H", "--hold", "zero-b")
    assert [constant["name"] for constant in found["constants"] if constant["held"]] == ["height", "zero_b"]


def test_applied_and_taken_back(points: str, capsys: Capture) -> None:
    output_of(capsys, "calibrate", points, "--apply", "--author", "ana")
    height = load().geometry.height
    assert height == pytest.approx(2.362, abs=5e-3)
    assert load().axes.a.minimum == pytest.approx(0.01, abs=2e-3)
    (step,) = data(capsys, "calibrate", "history")["steps"]
    assert (step["author"], step["points"], step["used"], step["in_force"]) == ("ana", points, 29, True)
    assert "applied, in force" in output_of(capsys, "calibrate", "history")
    output_of(capsys, "calibrate", "--revert", "--author", "ben")
    assert load().geometry.height == 2.35
    assert "reverted 1" in output_of(capsys, "calibrate", "history")
    assert "error 5006" in output_of(capsys, "calibrate", "--revert", code=2)


@pytest.mark.parametrize("head", ["a,b,c,x,y,z", "# datum 0 575000 565000\na,b,c,x,y,z"])
def test_points_that_are_applied_already_say_nothing_new(tmp_path: Path, capsys: Capture, head: str) -> None:
    """Their counts belong to the zeros before: the history, or the file itself, moves them along."""
    rng = np.random.default_rng(22)
    file = written(tmp_path, measured(TRUTH, random_counts(rng, 20), rng), head)
    assert data(capsys, "calibrate", file, "--apply")["applied"] == 1
    again = data(capsys, "calibrate", file, "--apply")
    assert (again["keys"], again["applied"]) == ({}, None)
    assert again["rms_before"] == pytest.approx(again["rms_after"], rel=1e-4)
    assert "has these values already" in output_of(capsys, "calibrate", file, "--apply")


def test_joints_applied_already_say_nothing_new_either(tmp_path: Path, capsys: Capture) -> None:
    rng = np.random.default_rng(23)
    seen = measured(TRUTH, random_counts(rng, 20), rng)
    joints = seen.counts / np.array([371.06 * 180.0 / np.pi, 1e6, 1e6])
    file = written(tmp_path, Observations(joints, seen.points), "a_rad,b_m,c_m,x,y,z")
    output_of(capsys, "calibrate", file, "--apply")
    again = data(capsys, "calibrate", file)
    assert again["rms_before"] == pytest.approx(again["rms_after"], rel=1e-3)


def test_a_result_that_makes_no_machine_is_not_applied(tmp_path: Path, capsys: Capture) -> None:
    rng = np.random.default_rng(24)
    default_path().parent.mkdir(parents=True)
    high = "[cell]\ngrasp_height = 2.04\n"
    default_path().write_text(high)
    file = written(tmp_path, measured(TRUTH._replace(height=2.33), random_counts(rng, 20), rng))
    assert "cell.grasp_height" in output_of(capsys, "calibrate", file, "--apply", code=2)
    assert default_path().read_text() == high
    assert "No calibration was ever applied" in output_of(capsys, "calibrate", "history")


def test_insufficient_points_are_refused_with_points_to_measure(tmp_path: Path, capsys: Capture) -> None:
    rng = np.random.default_rng(25)
    counts = random_counts(rng, 20)
    counts[:, 0] = 20_000.0
    error = output_of(capsys, "calibrate", written(tmp_path, measured(TRUTH, counts, rng)), code=2)
    assert "error 4009" in error
    assert "counts per degree and zero of a" in error
    assert "angles of the boom farther apart" in error


def test_picture_is_written(points: str, tmp_path: Path, capsys: Capture) -> None:
    assert "Written" in output_of(capsys, "calibrate", points, "--plot", str(tmp_path / "left.svg"))
    assert (tmp_path / "left.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["none.csv"], "4007"),
        ([], "4008"),
        (["--revert", "points.csv"], "4008"),
        (["--revert", "--apply"], "4008"),
        (["--hold", "width", "POINTS"], "4003"),
        (["--plot", "left.txt", "POINTS"], "4001"),
        (["POINTS", "more.csv"], "4008"),
        (["--revert"], "5006"),
    ],
)
def test_impossible_fit_is_refused(points: str, capsys: Capture, arguments: list[str], code: str) -> None:
    asked = [points if word == "POINTS" else word for word in arguments]
    assert f"error {code}" in output_of(capsys, "calibrate", *asked, code=2)


def test_all_that_is_needed_to_know_is_in_the_help(capsys: Capture) -> None:
    assert "collect" in output_of(capsys, "calibrate", "--help")
    assert "--revert" in output_of(capsys, "calibrate", "fit", "--help")
