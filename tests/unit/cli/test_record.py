"""`maya record`: recordings are listed, shown and exported without a robot; saving needs a running one."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from maya_un import runtime
from maya_un.cli.main import main
from maya_un.cli.recordings import recordings
from maya_un.config import RecorderConfig
from maya_un.recorder import mcap_file
from maya_un.runtime import Running
from tests.unit.cli.servers import http_service
from tests.unit.recorder.recordings import RECORDING


@pytest.fixture
def name() -> str:
    return recordings.store(RecorderConfig()).save(RECORDING).name


def printed(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    assert main(line.split()[1:]) == code
    out, err = capsys.readouterr()
    return out + err


def test_recordings_are_in_the_folder_of_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert recordings.folder() == tmp_path / "state" / "maya" / "recordings"
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "elsewhere"))
    assert recordings.folder() == tmp_path / "elsewhere" / "recordings"


def test_saved_recordings_are_listed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert name in printed("maya record", capsys)
    assert "limit" in printed("maya record list", capsys)
    (line,) = json.loads(printed("maya record list --json", capsys))["recordings"]
    assert (line["name"], line["date"], line["reason"]) == (name, "2026-11-21T19:25:20Z", "limit")


def test_missing_recordings_are_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed("maya record", capsys).startswith("There are no recordings in ")


def test_recording_shows_its_cause_and_content(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = printed(f"maya record show {name}", capsys)
    assert "limit, saved 2026-11-21T19:25:20.339Z, the last 10.0 s" in said
    assert "Axis b met its forward limit switch." in said
    told = json.loads(printed(f"maya record show {name} --json", capsys))
    assert told["cause"] == {"seq": 7, "kind": "limit", "code": 2301, "message": RECORDING.header.cause.message}
    assert (told["states"], told["events"], told["begin"], told["end"]) == (3, {"phase": 1, "limit": 1}, 90.0, 100.0)
    assert told["wire"]["pieces"] == len(RECORDING.wire)


def test_it_is_exported_for_other_programs(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = {key: tmp_path / f"out.{key}" for key in ("mcap", "csv", "wire")}
    options = " ".join(f"--{key} {place}" for key, place in places.items())
    written = json.loads(printed(f"maya record export {name} {options} --json", capsys))["written"]
    assert written == [str(place) for place in places.values()]
    assert mcap_file.read(places["mcap"]) == RECORDING
    with places["csv"].open(newline="", encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == len(RECORDING.states)
    with places["wire"].open(newline="", encoding="utf-8") as file:
        assert [bytes.fromhex(row["hexadecimal"]) for row in csv.DictReader(file)][1] == b"MG TIME\r"


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("maya record export {name}", 2, "--mcap, --csv or --wire is missing"),
        ("maya record show none.mcap", 2, "There is no recording none.mcap"),
        ("maya record show no/such/file.mcap", 2, "There is no recording"),
        ("maya record export {name} --csv no/such/folder/out.csv", 2, "Writing no/such/folder/out."),
        ("maya record export {name} --mcap no/such/folder/out.mcap", 2, "Writing no/such/folder/out."),
        ("maya record show pyproject.toml", 2, "it is no recording"),
        ("maya record save", 1, "`maya up` does not run on this computer"),
    ],
)
def test_impossible_request_is_refused_with_a_sentence(
    line: str, code: int, said: str, name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).parents[3])
    assert said in printed(line.format(name=name), capsys, code)


def test_the_running_robot_saves_now(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    asked: list[tuple[str, str]] = []

    def says(method: str, path: str, body: Any) -> tuple[int, object]:
        asked.append((method, path))
        return 201, {"name": "2026-11-21T19-25-20Z-asked.mcap", "date": "…", "reason": "asked", "bytes": 5}

    with http_service(says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        assert printed("maya record save", capsys) == "Saved: 2026-11-21T19-25-20Z-asked.mcap\n"
    assert asked == [("POST", "/v1/recordings")]
