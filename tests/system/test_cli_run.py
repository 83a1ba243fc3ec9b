"""`maya run`: the same job dry, scaled, interrupted, refused; on the twin, and by a robot that runs."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import pytest

from maya_un.cli.main import main
from maya_un.errors import NotHomed
from tests.system.processes import CALM, done, running

pytestmark = pytest.mark.system

JOB = """
name: one cube
parts: {cube: [0.50, 1.10]}
places: {tray: [1.10, 0.50, 0.40]}
steps: [home, {gripper: open}, {pick: cube}, {place: tray}]
"""


@pytest.fixture(autouse=True)
def job(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)


def report(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, Any]:
    """Return the report that a command prints as JSON."""
    assert main([*line.split(), "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_dry_run_shows_everything(capsys: pytest.CaptureFixture[str]) -> None:
    found = report("run job.yaml --dry-run", capsys)
    assert (found["job"], found["state"], found["code"]) == ("one cube", "done", 0)
    assert [step["step"] for step in found["steps"]] == ["home", "gripper open", "pick cube", "place tray"]
    assert {step["state"] for step in found["steps"]} == {"done"}
    assert 0.3 < found["lowest"] <= 0.4001 < found["highest"] < 2.0
    assert found["parts"]["cube"]["commanded"] == [1.1, 0.5, 0.4]
    assert found["parts"]["cube"]["error"] < 2e-4
    predicted = [step["predicted"] for step in found["steps"][1:]]
    assert [step["duration"] for step in found["steps"][1:]] == pytest.approx(predicted, rel=0.01)


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, which is what is tested")
def test_scaled_run_ends_at_the_place_of_the_dry_run(capsys: pytest.CaptureFixture[str]) -> None:
    dry = report("run job.yaml --dry-run --seed 3", capsys)
    scaled = report("run job.yaml --speed 100 --seed 3", capsys)
    for one, other in zip(dry["steps"], scaled["steps"], strict=True):
        assert (one["step"], one["state"]) == (other["step"], other["state"])
    for one, other in zip(dry["steps"][1:], scaled["steps"][1:], strict=True):
        assert one["end_counts"] == pytest.approx(other["end_counts"], abs=1)
    assert dry["parts"]["cube"]["place"] == pytest.approx(scaled["parts"]["cube"]["place"], abs=1e-4)


def test_twin_may_differ_from_the_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The robot has wrong constants, and the part stands elsewhere; drawn differences are those of a seed."""
    (tmp_path / "truth.toml").write_text('[geometry]\nlength = "2310 mm"\n')
    for truth in ("truth.toml", "drawn"):
        found = report(f"run job.yaml --dry-run --truth {truth}", capsys)["parts"]["cube"]
        assert found["commanded"] == [1.1, 0.5, 0.4]
        assert 1e-3 < found["error"] < 0.05
    assert report("run job.yaml --dry-run --truth drawn", capsys)["parts"]["cube"] == found
    assert report("run job.yaml --dry-run --truth drawn --seed 1", capsys)["parts"]["cube"] != found


def test_truth_of_a_twin_is_checked_like_a_configuration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "truth.toml").write_text("[geometry]\nlength = 2310\n")
    assert main(["run", "job.yaml", "--dry-run", "--truth", "truth.toml"]) == 2
    said = capsys.readouterr().err
    assert "geometry.length (truth.toml, line 2) = 2310: no robot reaches 2310 m; for mm write 2310 mm" in said
    assert main(["run", "job.yaml", "--address", "10.0.0.9", "--truth", "drawn"]) == 2
    assert "--truth is for the twin" in capsys.readouterr().err


def test_the_seed_draws_the_start(capsys: pytest.CaptureFixture[str]) -> None:
    first, again, other = (report(f"run job.yaml --dry-run --seed {seed}", capsys) for seed in (1, 1, 2))
    assert first == again
    assert first["duration"] != other["duration"]


@pytest.mark.waits("2 s at ten times real speed for an input that stays as it is")
def test_a_job_that_began_and_failed_was_not_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text("steps: [{wait_for: {input: 1, is: off, within: 2 s}}]")
    found = report("run job.yaml --speed 10", capsys, code=1)
    assert (found["state"], found["code"]) == ("failed", 4024)
    assert main(["run", "job.yaml", "--truth", "nowhere.toml"]) == 2


def test_people_get_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "job.yaml", "--dry-run"]) == 0
    text = capsys.readouterr().out
    assert "one cube: done in" in text
    assert "3   pick cube" in text


def test_a_job_that_is_refused_moves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "far.yaml").write_text("steps: [home, {approach: [5, 5, 5]}]")
    found = report("run far.yaml --dry-run", capsys, code=1)
    assert (found["state"], found["code"]) == ("failed", 2101)
    assert [step["state"] for step in found["steps"]] == ["skipped", "failed"]
    assert "nearest reachable" in found["message"]


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_stops_and_reports(kind: signal.Signals) -> None:
    with running("run job.yaml --speed 20") as process:
        process.until("raise")
        process.send(kind)
        code, text = process.end()
    assert code == 130
    assert "home   " in text
    assert "cancelled (2202)" in text
    assert "Traceback" not in text


def test_a_second_signal_does_not_cut_the_stop_short() -> None:
    with running("run job.yaml --speed 1") as process:
        process.until("raise")
        process.send(signal.SIGTERM)
        process.until("Interrupted")
        process.send(signal.SIGTERM)
        code, text = process.end()
    assert (code, "cancelled (2202)" in text, "Traceback" in text) == (130, True, False)
    assert [line.split()[-1] for line in text.splitlines() if line.startswith("cube ")] == ["–"]


@pytest.mark.waits("2 s: twice 1 s until an owner that was killed counts as dead")
def test_homing_is_taken_over_only_with_a_valid_mark(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text("steps: [{gripper: open}]")
    with running("dmc serve --port 0") as twin:
        address = twin.until(":")
        code, text = done(f"run job.yaml --skip-home --address {address}")
        assert (code, "error 2106" in text) == (1, True)
        with running(f"up --port 0 --skip-home --address {address}") as up:
            up.until("error 2106")
            up.until("maya home")
            assert done("status")[1].startswith("not homed")
        mark = "DP,1500000,1500000 mayaendb=2260000 mayaendc=2300000 ZAA=7 mayahome=7"
        assert done(f"dmc send {address} {mark}")[0] == 0
        with running(f"up --port 0 --skip-home --address {address} --json") as up:
            up.until('"code": 0')
            assert done("status")[1].startswith("idle")
        assert done(f"run job.yaml --skip-home --address {address}")[0] == 0


def test_interrupted_command_stops_the_running_robot() -> None:
    with running(f"up --port 0 --speed 20 {CALM}") as up:
        up.until("maya home")
        with running("run job.yaml") as process:
            process.until("raise")
            process.send(signal.SIGINT)
            code, text = process.end()
        assert (code, "cancelled (2202)" in text) == (130, True)
        assert done("status")[1].startswith("not homed")
        up.send(signal.SIGTERM)
        assert up.end()[0] == 0


@pytest.mark.waits("about 8 s of homing, a pick and a place at fifty times real speed, through HTTP")
def test_a_robot_that_runs_takes_the_job(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Once it is homed, a dry run begins where it stands."""
    (tmp_path / "on.yaml").write_text("steps: [{approach: [0.5, 1.1, 0.5]}]")
    assert report("run on.yaml --dry-run", capsys, code=1)["code"] == NotHomed.code
    with running(f"up --port 0 --speed 50 --table job.yaml {CALM}") as up:
        up.until("Ctrl-C ends")
        found = report("run job.yaml", capsys)
        assert (found["state"], found["parts"]["cube"]["error"] < 2e-4) == ("done", True)
        code, text = done("approach 0.5 1.1 0.5")
        assert (code, text.splitlines()[-1]) == (0, "Done.")
        code, text = done("pick 0.5 1.1 5")
        assert (code, "error 2101" in text) == (1, True)
        code, text = done("jog a 2deg")
        assert (code, text) == (0, "Moved a by 2.00°.\n")
        code, text = done("status")
        assert (code, text.startswith("idle")) == (0, True)
        [step] = report("run on.yaml --dry-run", capsys)["steps"]
        assert (step["state"], step["duration"] < 5.0) == ("done", True)
        up.send(signal.SIGTERM)
        assert up.end() == (0, "Ending.\n")
    assert done("status")[0] == 1
