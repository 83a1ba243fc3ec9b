"""The log is read on while it is written, and over the change to a new file."""

from __future__ import annotations

import json
from pathlib import Path

from maya_un.cli.logs.show import LogReader


def line(message: str, logger: str = "maya.http") -> str:
    about = {"time": "2026-11-21T10:00:00.000Z", "level": "info", "logger": logger, "message": message}
    return json.dumps(about) + "\n"


def texts(log: LogReader) -> list[str]:
    return [entry.text for entry in log.read()]


def test_new_lines_are_read_once(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    log = LogReader(path)
    assert texts(log) == []
    path.write_text(line("one"))
    assert texts(log) == ["one"]
    with path.open("a") as file:
        file.write(line("two") + line("three")[:20])
    assert texts(log) == ["two"]
    with path.open("a") as file:
        file.write(line("three")[20:])
    assert texts(log) == ["three"]
    assert texts(log) == []


def test_older_files_are_first(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    path.write_text(line("newest"))
    for number in (1, 2, 10):
        (tmp_path / f"maya.log.{number}").write_text(line(f"{number} ago"))
    (tmp_path / "maya.log.old").write_text(line("not ours"))
    assert texts(LogReader(path)) == ["10 ago", "2 ago", "1 ago", "newest"]


def test_nothing_is_lost_when_a_new_file_begins(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    path.write_text(line("one"))
    log = LogReader(path)
    assert texts(log) == ["one"]
    with path.open("a") as file:
        file.write(line("two"))
    path.rename(tmp_path / "maya.log.1")
    path.write_text(line("three"))
    assert texts(log) == ["two", "three"]
    with path.open("a") as file:
        file.write(line("four"))
    assert texts(log) == ["four"]


def test_lines_that_are_not_ours_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    path.write_bytes(b"Traceback (most recent call last):\n[1]\n\xff\xfe\n{}\n" + line("ours").encode())
    assert texts(LogReader(path)) == ["ours"]


def test_entries_of_the_journal_are_omitted_unless_requested(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    path.write_text(line("homed", "maya.events") + line("GET /v1/status 200"))
    assert texts(LogReader(path)) == ["GET /v1/status 200"]
    assert texts(LogReader(path, events=True)) == ["homed", "GET /v1/status 200"]
