"""The log is read on while it is written, and over the change to a new file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from maya_un.http import log_reader
from maya_un.http.log_reader import LogReader, newest


def line(message: str, logger: str = "maya.http", level: str = "info", time: str = "10:00:00.000") -> str:
    about = {"time": f"2026-11-21T{time}Z", "level": level, "logger": logger, "message": message}
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


@pytest.mark.parametrize("block", [7, 100, 1 << 16])
def test_newest_entries_of_all_files_are_found_from_the_end(
    block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_reader, "_BLOCK", block)
    path = tmp_path / "maya.log"
    assert newest(path, 3) == []
    (tmp_path / "maya.log.2").write_text("".join(line(f"old {number}") for number in range(3)))
    (tmp_path / "maya.log.1").write_text(line("seven") + "no line of ours\n" + line("eight"))
    path.write_text(line("nine") + line("homed", "maya.events") + line("still being written")[:30])
    every = ["old 0", "old 1", "old 2", "seven", "eight", "nine", "homed"]
    for limit in range(1, 9):
        assert [entry.text for entry in newest(path, limit)] == every[-limit:]


def test_newest_entries_are_chosen_by_level_and_date(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    levels = ("error", "debug", "critical", "info", "warning", "error")
    path.write_text("".join(line(one, level=one, time=f"10:00:0{at}.500") for at, one in enumerate(levels)))
    assert [entry.level for entry in newest(path, 10, level="warning")] == ["error", "critical", "warning", "error"]
    assert [entry.level for entry in newest(path, 1, level="critical")] == ["critical"]
    since = log_reader.utc("2026-11-21T12:00:03.5+02:00")
    assert [entry.level for entry in newest(path, 10, since)] == ["info", "warning", "error"]


def test_level_in_the_text_of_an_entry_is_not_its_level(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    path.write_text(line('"error"'))
    assert newest(path, 10, level="error") == []


def test_file_that_is_renamed_while_it_is_read_is_read_once(tmp_path: Path) -> None:
    path = tmp_path / "maya.log"
    (tmp_path / "maya.log.1").write_text(line("one"))
    path.hardlink_to(tmp_path / "maya.log.1")
    assert [entry.text for entry in newest(path, 10)] == ["one"]
