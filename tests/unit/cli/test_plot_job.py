"""`maya plot job` and `maya run --dry-run --plot`: jobs as pictures, whole or up to where they are refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from maya_un.cli.main import main
from maya_un.client.pictures import phases
from maya_un.schema.previews import Band, JobInspection, JobPreview, StepPreview
from tests.conventions.source import ROOT

EXAMPLE = str(ROOT / "examples" / "01_pick_and_place.yaml")


def job_of(folder: Path, steps: str) -> str:
    file = folder / "mine.yaml"
    file.write_text(f"parts: {{cube: [0.41, 1.13]}}\nsteps:\n{steps}", encoding="utf-8")
    return str(file)


def test_job_is_drawn_and_summarised(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "job.svg"
    assert main(["plot", "job", EXAMPLE, "--output", str(file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["path"] == str(file)
    assert told["refusal"] is None
    assert told["lowest"] == pytest.approx(0.40, abs=1e-4)
    svg = file.read_text(encoding="utf-8")
    assert f"pick and place, {told['duration']:.1f} s" in svg
    assert all(phase in svg for phase in ("approach", "down", "up"))


def test_dry_run_draws_the_same_next_to_its_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, other = tmp_path / "one.svg", tmp_path / "other.svg"
    assert main(["plot", "job", EXAMPLE, "--output", str(one)]) == 0
    assert main(["run", EXAMPLE, "--dry-run", "--plot", str(other)]) == 0
    assert one.read_bytes() == other.read_bytes()
    said = capsys.readouterr().out
    assert f"Picture: {other}" in said
    assert "pick and place: done" in said


def test_without_a_name_it_goes_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plot", "job", job_of(tmp_path, "  - approach: cube\n")]) == 0
    assert capsys.readouterr().out == "Picture: maya-job.svg\n"
    assert "mine, " in (tmp_path / "maya-job.svg").read_text(encoding="utf-8")


def test_job_is_drawn_up_to_the_refused_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "job.svg"
    steps = "  - pick: cube\n  - place: [0.5, 3.0]\n"
    assert main(["plot", "job", job_of(tmp_path, steps), "--output", str(file)]) == 1
    assert "error 2101" in capsys.readouterr().err
    assert "approach" in file.read_text(encoding="utf-8")


def test_a_job_that_is_refused_at_once_or_goes_nowhere_leaves_no_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "job.svg"
    refused, still = "  - approach: [0.5, 3.0]\n", "  - gripper: close\n"
    for steps, reason in ((refused, "error 4002"), (still, "nothing in it moves")):
        assert main(["plot", "job", job_of(tmp_path, steps), "--output", str(file)]) == 2
        assert reason in capsys.readouterr().err
        assert not file.exists()
    assert main(["run", job_of(tmp_path, still), "--dry-run", "--plot", str(file)]) == 0
    assert not file.exists()


def test_a_real_run_has_no_picture(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", EXAMPLE, "--plot", "x.svg"]) == 2
    assert "--dry-run" in capsys.readouterr().err


def test_a_picture_that_cannot_be_written_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for name, code in (("/nowhere/x.svg", "5002"), ("x.jpg", "4001")):
        assert main(["plot", "job", EXAMPLE, "--output", name]) == 2
        assert f"error {code}" in capsys.readouterr().err


def test_dry_run_with_an_impossible_picture_is_refused_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", EXAMPLE, "--dry-run", "--plot", "x.jpg"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "error 4001" in said.err


def inspection(bands: list[Band]) -> JobInspection:
    steps = tuple(StepPreview(index, f"steps.{index}", f"step {index}", 2.0, (), None, None, None) for index in (1, 2))
    return JobInspection(JobPreview(4.0, None, None, steps, None), tuple(bands), (), 0.0, 0.0, ())


def test_few_phases_are_named_and_homing_takes_no_time() -> None:
    bands = [Band(1, "home", 0.0, 0.0), Band(2, "down", 0.0, 2.0), Band(2, "up", 2.0, 4.0)]
    assert [tuple(phase) for phase in phases(inspection(bands))] == [("down", 0.0, 2.0, ""), ("up", 2.0, 4.0, "")]


def test_of_many_phases_only_the_steps_are_named() -> None:
    bands = [Band(1 + i // 10, "on", 0.2 * i, 0.2 * (i + 1)) for i in range(20)]
    found = phases(inspection(bands))
    assert [(phase.name, phase.short) for phase in found] == [("step 1", "1"), ("step 2", "2")]
    assert [(phase.start, phase.end) for phase in found] == [(0.0, 2.0), (2.0, pytest.approx(4.0))]
