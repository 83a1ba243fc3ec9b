"""`maya queue backup|restore|export` on a file that a journal has written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dmc41x3.loops import run
from maya_un.cli.main import main
from maya_un.cli.queueing.commands import export
from maya_un.config.state_folder import queue_file
from maya_un.process.journal.protocol import JobOptions, JobRow, RequestOwner
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.jobs import TaskState
from tests.unit.cli.queueing.answers import printed


def job(number: int, state: TaskState) -> JobRow:
    return JobRow(
        number, "x", {"steps": ["home"]}, JobOptions(), RequestOwner("ana"), state, float(number), "2026-03-01", 1
    )


@pytest.fixture
def written() -> None:
    """A journal with two jobs, one of them unfinished."""

    async def write() -> None:
        queue_file().parent.mkdir(parents=True, exist_ok=True)
        journal = await SqliteJournal.open(queue_file())
        await journal.add(job(1, TaskState.DONE), job(2, TaskState.QUEUED))
        await journal.close()

    run(write())


@pytest.mark.usefixtures("written")
def test_a_backup_is_made_and_put_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "copy.db"
    assert f"{copy}: 2 jobs, 1 of them unfinished" in printed(["queue", "backup", str(copy)], capsys)
    queue_file().unlink()
    said = printed(["queue", "restore", str(copy)], capsys)
    assert "2 jobs, 1 of them unfinished. The former file is kept as nothing" in said
    assert queue_file().exists()
    assert json.loads(printed(["queue", "restore", str(copy), "--json"], capsys))["aside"] is not None


@pytest.mark.usefixtures("written")
def test_history_is_exported_in_the_format_of_the_file_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, lines in (("all.csv", 3), ("all.jsonl", 2)):
        place = tmp_path / name
        assert printed(["queue", "export", str(place)], capsys) == f"{place}: 2 jobs.\n"
        assert len(place.read_text(encoding="utf-8").splitlines()) == lines


@pytest.mark.usefixtures("written")
def test_the_example_in_the_help_of_export_writes_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    *command, name = (export.__doc__ or "").rpartition("Example: maya ")[2].split()
    assert printed([*command, name], capsys) == f"{name}: 2 jobs.\n"


@pytest.mark.usefixtures("written")
@pytest.mark.parametrize(("name", "code"), [("all.txt", 4001), ("none/all.csv", 5002)])
def test_unwritable_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, code: int) -> None:
    assert printed(["queue", "export", str(tmp_path / name)], capsys, 2).startswith(f"maya: error {code}:")


def test_without_a_file_there_is_nothing_to_copy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["queue", "backup", str(tmp_path / "copy.db")]) != 0
    assert capsys.readouterr().err.startswith("maya: error ")
    assert not (tmp_path / "copy.db").exists()
