"""The tools as commands, each with a twin of its own in the process."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

Run = Callable[[Sequence[str]], int]


PROGRAM = "#A\nx=1\nEN\n"


def refused(run: Run, line: list[str], capsys: pytest.CaptureFixture[str]) -> int:
    """Run a command that must be refused as asked and return the code of its error."""
    assert run([*line, "--json"]) == 2
    return json.loads(capsys.readouterr().out)["error"]["code"]


def test_watch_prints_one_json_line_a_sample(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["watch", "sim", "_TPA", "@IN[1]", "--rate", "50", "--for", "0.1", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[0] == {"time": 0.0, "_TPA": 0.0, "@IN[1]": 1.0}
    assert 2 <= len(lines) <= 6
    assert [line["time"] for line in lines] == sorted(line["time"] for line in lines)


def test_watch_shows_the_axes_by_default(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["watch", "sim", "--for", "0.01"]) == 0
    line = capsys.readouterr().out.splitlines()[0]
    assert line.startswith("0.000  _TPA 0  _TEA 0  _TVA 0  _TTA 0  _TPB 0")
    assert "_TTC" in line


def test_scope_without_files_prints_the_table(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["scope", "sim", "--channels", "_TPA,_TTB", "--rate", "50", "--for", "0.1"]) == 0
    table = list(csv.reader(capsys.readouterr().out.splitlines()))
    assert table[0] == ["time [s]", "_TPA [counts]", "_TTB [V]"]
    assert table[1] == ["0.000000", "0", "0"]


def test_scope_names_its_file(run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(tmp_path / "a.csv")
    assert run(["scope", "sim", "--channels", "_TPA", "--for", "0.1", "--csv", file, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["csv"] == file
    assert said["png"] is None
    assert said["samples"] == len(Path(file).read_text(encoding="utf-8").splitlines()) - 1


def test_a_program_is_loaded_run_and_shown(run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.dmc"
    file.write_text(PROGRAM, encoding="ascii")
    assert run(["download", "sim", str(file), "--run", "#A"]) == 0
    assert capsys.readouterr().out == f"{file}: 3 lines downloaded, XQ #A\n"
    assert run(["upload", "sim", str(tmp_path / "b.dmc"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(tmp_path / "b.dmc"), "lines": 0}
    assert (tmp_path / "b.dmc").read_text(encoding="ascii") == ""


def test_a_label_that_is_not_there_is_the_controllers_refusal(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.dmc"
    file.write_text(PROGRAM, encoding="ascii")
    assert run(["download", "sim", str(file), "--run", "NONE", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["error"]["code"] == 1004


def test_error_is_reported_before_anything_is_sent(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.dmc"
    file.write_text('#A\nMG "ñ"\n', encoding="utf-8")
    assert refused(run, ["download", "sim", str(file)], capsys) == 4007
    assert refused(run, ["download", "sim", str(tmp_path / "no.dmc")], capsys) == 4007
    file.write_text(PROGRAM, encoding="ascii")
    assert refused(run, ["download", "sim", str(file), "--run", "#MUCHTOOLONG"], capsys) == 4001
    assert refused(run, ["upload", "sim", str(tmp_path / "no" / "b.dmc")], capsys) == 5002
    assert refused(run, ["watch", "sim", "--rate", "0"], capsys) == 4001
    assert refused(run, ["watch", "sim", "--for", "-1"], capsys) == 4001
    assert refused(run, ["watch", "sim", "--for", "nan"], capsys) == 4001
    assert refused(run, ["replay", str(file), "--tolerance", "nan"], capsys) == 4001
    assert refused(run, ["scope", "sim", "--channels", ","], capsys) == 4001
    assert refused(run, ["watch", "no host"], capsys) == 4001
    assert refused(run, ["capture", "sim", "--listen", "0", "--out", str(tmp_path / "no" / "w")], capsys) == 5002
    assert refused(run, ["replay", str(tmp_path / "no.jsonl")], capsys) == 4007
