"""`maya logs`, on files that a service left behind."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from maya_un.cli.logs.show import LogFilter, show
from maya_un.cli.main import main
from maya_un.cli.settings import OutputSettings
from maya_un.process.journal.protocol import EventRow
from maya_un.process.journal.sqlite import SqliteJournal


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "kept"
    place.mkdir()
    monkeypatch.setenv("MAYA_STATE_DIR", str(place))
    monkeypatch.setenv("TZ", "UTC")
    return place


def event(seq: int, kind: str, second: int, code: int = 0, **detail: object) -> EventRow:
    return EventRow(1, seq, f"2026-11-21T10:00:{second:02d}+00:00", 0.0, kind, code, detail)


def kept(folder: Path, *events: EventRow) -> None:
    async def write() -> None:
        journal = await SqliteJournal.open(folder / "maya.db")
        journal.note(*events)
        await journal.close()

    asyncio.run(write())


def logged(folder: Path, second: int, message: str, level: str = "info", **more: object) -> None:
    about = {"time": f"2026-11-21T10:00:{second:02d}.500Z", "level": level, "logger": "maya.http", "message": message}
    with (folder / "maya.log").open("a", encoding="utf-8") as file:
        file.write(json.dumps(about | more) + "\n")


def output_of(capsys: pytest.CaptureFixture[str], line: str, code: int = 0) -> list[str]:
    """Carry a command line out and return the lines that it prints."""
    assert main(line.split()) == code
    return capsys.readouterr().out.splitlines()


def test_events_and_the_log_are_shown_in_one_order(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept(folder, event(1, "homed", 1), event(2, "fault", 3, 2306, message="The motor of axis b is off."))
    logged(folder, 2, "POST /v1/tasks 202")
    lines = output_of(capsys, "logs")
    assert [line.split()[3] for line in lines] == ["homed", "http", "fault"]
    assert lines[-1].endswith("The motor of axis b is off. (2306)")


def test_as_json_every_entry_is_one_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept(folder, event(7, "job", 1, job=3, state="done"))
    (entry,) = map(json.loads, output_of(capsys, "logs --json"))
    assert (entry["run"], entry["seq"], entry["kind"], entry["level"]) == (1, 7, "job", "info")
    assert entry["detail"] == {"job": 3, "state": "done"}


def test_entries_are_chosen_by_kind_gravity_number_and_date(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kinds = ("phase", "job", "limit", "fault", "job")
    kept(folder, *(event(number, kind, number) for number, kind in enumerate(kinds, 1)))

    def told(options: str) -> list[int]:
        return [json.loads(line)["seq"] for line in output_of(capsys, f"logs --json {options}")]

    assert told("") == [2, 3, 4, 5]
    assert told("--level debug") == [1, 2, 3, 4, 5]
    assert told("--level warning") == [3, 4]
    assert told("--kind job --kind fault") == [2, 4, 5]
    assert told("--lines 2") == [4, 5]
    assert told("--since 2026-11-21T10:00:04Z") == [4, 5]


def test_missing_logs_are_reported(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["logs"]) == 2
    assert str(folder) in capsys.readouterr().err


def test_a_damaged_journal_does_not_hide_the_log(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "maya.db").write_bytes(b"not a database, but long enough to be read as one" * 100)
    logged(folder, 1, "homed", logger="maya.events")
    assert main(["logs"]) == 0
    printed = capsys.readouterr()
    assert "homed" in printed.out
    assert "5008" in printed.err


def test_defect_is_shown_with_its_traceback(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logged(folder, 1, "ZeroDivisionError: division by zero", "error", traceback="Traceback:\n  1 / 0")
    assert output_of(capsys, "logs")[1:] == ["    Traceback:", "      1 / 0"]


def test_new_entries_are_shown_as_they_come_until_ctrl_c(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept(folder, event(1, "homed", 1))
    turns = iter(range(3))

    def wait(_: float) -> None:
        turn = next(turns)
        if turn == 0:
            kept(folder, event(1, "job", 2))
            logged(folder, 3, "GET /v1/status 200")
        elif turn == 2:
            raise KeyboardInterrupt

    wanted = LogFilter(50, "", (), "info")
    assert show(wanted, OutputSettings(json=True), follow=True, wait=wait) == 0
    assert [json.loads(line)["kind"] for line in capsys.readouterr().out.splitlines()] == ["homed", "job", "http"]


def test_dates_have_one_form_wherever_they_are_from(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept(folder, event(1, "homed", 1))
    logged(folder, 2, "POST /v1/tasks 202")
    times = [json.loads(line)["time"] for line in output_of(capsys, "logs --json")]
    assert times == ["2026-11-21T10:00:01.000Z", "2026-11-21T10:00:02.500Z"]


def test_a_kind_that_there_is_not_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept(folder, event(1, "homed", 1), event(2, "novel", 2))
    assert main(["logs", "--kind", "falt"]) == 2
    assert "There is no 'falt'. Known:" in capsys.readouterr().err
    assert len(output_of(capsys, "logs --kind novel")) == 1
    assert output_of(capsys, "logs --kind fault") == []
