from __future__ import annotations

import json
import logging
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from maya_un.events import FaultEntered, HomingDone, MotionBegun
from maya_un.http import log


@pytest.fixture(autouse=True)
def own_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))


def lines() -> list[dict[str, Any]]:
    """Return the content of the file."""
    return [json.loads(line) for line in log.log_path().read_text(encoding="utf-8").splitlines()]


def test_log_line_is_json_with_its_own_fields(capsys: pytest.CaptureFixture[str]) -> None:
    with log.kept():
        log.note("http", logging.WARNING, "POST /v1/stop 409", request="a-1", code=1010)
    (line,) = lines()
    date = line.pop("time")
    assert (len(date), date[10], date[-1]) == (24, "T", "Z")
    assert line == {
        "level": "warning",
        "logger": "maya.http",
        "message": "POST /v1/stop 409",
        "request": "a-1",
        "code": 1010,
    }
    assert capsys.readouterr().err == f"{date} warning maya.http: POST /v1/stop 409 (1010)\n"


def test_control_characters_of_a_client_neither_reach_the_terminal_nor_make_a_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with log.kept():
        log.note("http", logging.WARNING, "POST /v1/\x1b]0;mine\x07\n<3>forged\t 503")
    (told,) = capsys.readouterr().err.splitlines()
    assert told.endswith(r"POST /v1/\x1b]0;mine\x07\x0a<3>forged\x09 503")
    assert lines()[0]["message"] == "POST /v1/\x1b]0;mine\x07\n<3>forged\t 503"


def test_robot_events_are_logged_and_single_motions_are_not() -> None:
    with log.kept(people=False):
        log.note_event(MotionBegun("x", seq=1))
        log.note_event(FaultEntered(seq=2, code=2302, more={"axis": "b"}))
        log.note_event(HomingDone(seq=3))
    assert [(line["seq"], line["level"], line["kind"], line["code"]) for line in lines()] == [
        (2, "error", "fault", 2302),
        (3, "info", "homed", 0),
    ]
    assert lines()[0]["detail"] == {"axis": "b"}


@pytest.mark.parametrize(("under_systemd", "told"), [(True, 2), (False, 1)])
def test_terminal_shows_problems_and_systemd_gets_everything(
    under_systemd: bool, told: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("JOURNAL_STREAM", raising=False)
    if under_systemd:
        monkeypatch.setenv("JOURNAL_STREAM", "8:12345")
    with log.kept():
        log.note("http", logging.INFO, "ordinary")
        log.note("http", logging.WARNING, "trouble")
    assert len(capsys.readouterr().err.splitlines()) == told
    assert len(lines()) == 2


def test_a_defect_has_its_traceback_in_the_line() -> None:
    with pytest.raises(ZeroDivisionError) as caught:
        _ = 1 / 0
    with log.kept(people=False):
        assert log.note_defect(caught.value) == ""
    (line,) = lines()
    assert (line["level"], line["message"]) == ("error", "ZeroDivisionError: division by zero")
    assert "Traceback" in line["traceback"]


def test_the_file_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log, "MOST_BYTES", 2_000)
    with log.kept(people=False):
        for number in range(400):
            log.note("http", logging.INFO, "x" * 50, number=number)
    files = sorted(log.log_path().parent.glob("maya.log*"))
    assert len(files) == 1 + log.MOST_FILES
    assert all(file.stat().st_size <= 2_000 for file in files)
    assert lines()[-1]["number"] == 399


def test_unwritable_log_fails_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "file" / "folder"))
    with log.kept(people=False):
        log.note("http", logging.INFO, "lost")
        assert log.note_defect(ValueError("x")) != ""


def test_a_library_complains_to_the_file_and_not_to_the_screen(capsys: pytest.CaptureFixture[str]) -> None:
    log.hand_over("a.library")
    library = logging.getLogger("a.library")
    library.error("only words")
    library.error("it failed", exc_info=ValueError("a defect of it"))
    assert [line["message"] for line in lines()] == ["ValueError: a defect of it"]
    assert capsys.readouterr() == ("", "")


def test_blocked_terminal_delays_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()
    stuck = os.fdopen(writing, "w")
    monkeypatch.setattr("sys.stderr", stuck)
    monkeypatch.setattr(log, "LAST_WORDS", 0.05)
    with log.kept():
        for number in range(3_000):
            log.note("http", logging.WARNING, "x" * 100, number=number)
    written = len(lines())
    os.close(reading)  # lets the writer go
    with suppress(BrokenPipeError):
        stuck.close()
    assert 0 < written < 3_000
