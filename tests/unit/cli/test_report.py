from __future__ import annotations

from typing import Any

import pytest

from maya_un.cli import progress
from maya_un.cli.output import concluded, exit_code
from maya_un.cli.progress import FactLines, ProgressBars, line, tell
from maya_un.cli.report import as_data, as_text, table
from maya_un.cli.settings import OutputSettings
from maya_un.errors import by_code
from maya_un.events import (
    Event,
    FaultEntered,
    GripperOpened,
    MotionBegun,
    MotionPaused,
    PhaseBegun,
    SpeedChanged,
    StepAdvanced,
    event_of,
)  # fmt: skip

STEP: dict[str, Any] = {
    "index": 1,
    "key": "steps.0",
    "step": "pick cube",
    "state": "failed",
    "code": 2101,
    "message": "Too far.",
    "predicted": None,
    "duration": 12.34,
    "end_counts": [1, 2, 3],
    "end_point": [0.5, 1.0, 0.4],
    "phase": "up",
}
REPORT: dict[str, Any] = {
    "id": 4,
    "name": "cubes",
    "state": "failed",
    "code": 2101,
    "message": "Too far.",
    "predicted": 10.0,
    "duration": 12.5,
    "lowest": 0.4,
    "highest": 0.5,
    "steps": [STEP],
    "parts": {"cube": [1.0, 0.5, 0.4], "lost": None},
    "remarks": [],
}


def test_data_has_the_parts_by_both_records() -> None:
    data = as_data(REPORT, {"cube": (1.0, 0.5, 0.403), "lost": (0.0, 0.0, 0.0)})
    assert data["parts"]["cube"] == {
        "place": [1.0, 0.5, 0.403],
        "commanded": [1.0, 0.5, 0.4],
        "error": pytest.approx(0.003),
    }
    assert data["parts"]["lost"]["error"] is None
    assert list(data["steps"][0]) == [key for key in STEP if key != "key"]


def test_report_names_misshapen_pallets() -> None:
    remarked = as_data({**REPORT, "remarks": ["tray: its corners are 3.0 mm off a plane"]}, None)
    assert remarked["remarks"] == ["tray: its corners are 3.0 mm off a plane"]
    assert as_text(remarked, "en").endswith("\n\nnote: tray: its corners are 3.0 mm off a plane")


def test_a_real_machine_has_no_record_of_parts() -> None:
    assert as_data(REPORT, None)["parts"]["cube"] == {"place": None, "commanded": [1.0, 0.5, 0.4], "error": None}


def test_text_report_has_the_important_values() -> None:
    text = as_text(as_data(REPORT, {"cube": (1.0, 0.5, 0.403)}), "en")
    assert text.startswith("cubes: failed in 12.5 s; gripper between 400.0 mm and 500.0 mm")
    assert "pick cube   failed (2101)" in text
    assert "1000.0 500.0 403.0" in text
    assert "3.000" in text


def test_a_job_that_never_began_has_a_report_too() -> None:
    early = {**REPORT, "duration": None, "lowest": None, "highest": None, "steps": [], "parts": {}}
    assert as_text(as_data(early, None), "es").startswith("cubes: fallido en 0.0 s")


def test_states_in_the_report_are_translated() -> None:
    steps = [STEP, {**STEP, "state": "done", "code": 0}, {**STEP, "state": "skipped", "code": 0}]
    text = as_text(as_data({**REPORT, "steps": steps}, None), "es")
    assert text.startswith("cubes: fallido en 12.5 s")
    assert [word for word in ("fallido (2101)", "hecho", "omitido") if word not in text] == []


def test_columns_line_up() -> None:
    assert table(("n", "name"), [("1", "a"), ("10", "bcdef")], right=(0,)) == " n   name\n 1   a\n10   bcdef"


@pytest.mark.parametrize(
    ("event", "english", "spanish"),
    [
        (StepAdvanced(1, 3, "home", "done"), "   3 home: done", "   3 home: hecho"),
        (StepAdvanced(1, 3, "home", "failed", code=2101), "   3 home: failed (2101)", "   3 home: fallido (2101)"),
        (StepAdvanced(1, 3, "home", "queued"), None, None),
        (PhaseBegun("down"), "       go down", "       bajar"),
        (FaultEntered("Stuck.", code=2302), "       fault (2302) Stuck.", "       fallo (2302) Stuck."),
        (GripperOpened(), "       gripper open", "       pinza abierta"),
        (MotionBegun("x"), None, None),
        (MotionPaused(), "       paused", "       en pausa"),
        (SpeedChanged(0.5), "       speed 50%", "       velocidad 50%"),
        (event_of("dance", {"name": "tango"}), None, None),
    ],
)
def test_events_as_lines(event: Event, english: str | None, spanish: str | None) -> None:
    assert (line(event, "en"), line(event, "es")) == (english, spanish)


def test_only_done_is_success(capsys: pytest.CaptureFixture[str]) -> None:
    assert concluded({**REPORT, "state": "done", "code": 0}, OutputSettings()) == 0
    assert concluded(REPORT, OutputSettings()) == 1
    assert capsys.readouterr().err == "maya: error 2101: Too far.\n"


def test_the_report_says_why_a_deviation_is_unknown_after_a_branch() -> None:
    steps = [{**STEP, "step": "if answer yes", "state": "done", "code": 0, "phase": "then"}]
    report = {**REPORT, "state": "done", "code": 0, "steps": steps}
    text = as_text(as_data(report, {"cube": (1.0, 0.5, 0.4), "lost": (0.0, 0.0, 0.0)}), "en")
    assert text.count("note: ") == 1
    assert "note: the deviation of lost is unknown: a branch decides whether and where the job puts it down" in text
    assert "note: " not in as_text(as_data({**report, "steps": [STEP]}, {"lost": (0.0, 0.0, 0.0)}), "en")


@pytest.mark.parametrize(("took", "code"), [(None, 2), (10.0, 1)])
def test_a_job_was_refused_only_if_none_of_its_steps_has_begun(took: float | None, code: int) -> None:
    report = {**REPORT, "code": 4024, "steps": [{**STEP, "code": 4024, "duration": took}]}
    assert concluded(report, OutputSettings()) == code


def test_every_error_has_an_exit_code() -> None:
    codes = {code: exit_code(code) for code in by_code()}
    assert set(codes.values()) == {1, 2}
    assert (codes[4001], codes[5001], codes[5999], codes[2101], codes[1020]) == (2, 2, 1, 1, 1)


def test_the_display_suits_the_screen(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert type(progress.chosen(OutputSettings(json=True))) is progress.Display
    assert type(progress.chosen(OutputSettings())) is FactLines
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert type(progress.chosen(OutputSettings())) is ProgressBars


def test_bars_print_facts_and_leave_the_screen_clean(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressBars("en") as bars:
        tell(PhaseBegun("down"), bars, "en")
        bars.motion("follow", 3.0, 10.0)
        bars.note("a [fact] is not markup")
        bars.rest()
    assert "a [fact] is not markup" in capsys.readouterr().out
    assert bars.phase == "down"


def test_a_motion_of_unknown_duration_pulses_and_counts_up() -> None:
    with ProgressBars("en") as bars:
        bars.motion("down", 3.0, 10.0)
        bars.motion("stroke_c", 42.0, 0.0)
        shown = [bar for bar in bars._progress.tasks if bar.visible]
    assert [(bar.total, bar.fields["clock"].strip()) for bar in shown] == [(None, "42.0 s")]
