"""Odd names of files on the command line: nothing is made, nothing but a regular file is written."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from tests.system.processes import done

pytestmark = pytest.mark.system

NOBODY = "--port 0 --address 127.0.0.1:1"
"""No controller answers there, so `maya up` does not start."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder of its own, where some odd things stand already."""
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    work = tmp_path / "work"
    (work / "folder").mkdir(parents=True)
    (work / "junk").write_bytes(b"no database, but longer than a header" * 100)
    (work / "victim").write_text("kept")
    (work / "linked.db.lock").symlink_to("victim")
    os.mkfifo(work / "pipe")
    monkeypatch.chdir(work)
    return work


@pytest.mark.parametrize("name", ["inf", "..", "junk", "/dev/null", "linked.db"])
def test_failed_up_leaves_nothing_next_to_the_named_journal(name: str, folder: Path) -> None:
    before = {path: path.lstat().st_mtime_ns for path in folder.iterdir() if path.is_file()}
    names = sorted(path.name for path in folder.parent.iterdir() if path.name not in {"state", "run"})
    code, said = done(f"up --journal {name} {NOBODY}")
    assert code in {1, 2}, said
    assert "5999" not in said
    assert {path: path.lstat().st_mtime_ns for path in folder.iterdir() if path.is_file()} == before
    assert sorted(path.name for path in folder.parent.iterdir() if path.name not in {"state", "run"}) == names
    assert (folder / "victim").read_text() == "kept"


def test_backup_of_the_queue_refuses_irregular_files(folder: Path) -> None:
    code, said = done("user reset --all")  # makes the file of the queue
    assert code == 0, said
    for name in ("pipe", "folder", "/dev/null"):
        kind = stat.S_IFMT(Path(name).stat().st_mode)
        code, said = done(f"queue backup {name}")
        assert code == 2, said
        assert stat.S_IFMT(Path(name).stat().st_mode) == kind
    code, said = done("queue backup copy.db")
    assert code == 0, said
    assert stat.S_IMODE((folder.parent / "state").stat().st_mode) == 0o700
