"""The terminal as a filter, as scripts use it."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

Run = Callable[[Sequence[str]], int]


def filtered(
    run: Run, text: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[int, list[str], str]:
    """Return exit code, the lines of standard output, and standard error."""
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    code = run(["terminal", "sim"])
    said = capsys.readouterr()
    return code, said.out.splitlines(), said.err


def test_answers_go_out_line_by_line(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = filtered(run, "x=5\nMG x*2;TP\n\nID\n", monkeypatch, capsys)
    assert (code, out[:3]) == (0, [":", " 10.0000", " 0, 0, 0"])
    assert out[3:5] == ["FW, DMC4133 Rev 1.3k", "DMC, 4103, Rev 11"]
    assert err == "DMC4133 Rev 1.3k at sim\n"


def test_a_refusal_shows_in_the_exit_code_and_ends_nothing(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = filtered(run, "MOA;BGA\nMG 1\n", monkeypatch, capsys)
    assert (code, out) == (1, [":", "? 20 Begin not valid with motor off", " 1.0000"])


def test_quit_ends_it_before_the_input_does(
    run: Run, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert filtered(run, "MG 1\n:quit\nMG 2\n", monkeypatch, capsys)[:2] == (0, [" 1.0000"])


def test_recording_goes_on_during_lines_and_is_awaited(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.csv"
    code, out, err = filtered(run, f":scope x --rate 50 --for 0.1 --trigger x=2 --csv {file}\n", monkeypatch, capsys)
    assert (code, out) == (0, [])  # the controller has no x: reported, and not the end
    assert "refused" in err
    lines = f"x=1\n:scope x --rate 50 --for 0.1 --trigger x=2 --csv {file}\nx=2\n"
    assert filtered(run, lines, monkeypatch, capsys)[0] == 0
    assert file.read_text(encoding="utf-8").splitlines()[0:2] == ["time [s],x", "0.000000,2"]


def test_own_commands_work_too(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.dmc"
    file.write_text('#A\nMG "hi"\nEN\n', encoding="ascii")
    code, out, err = filtered(run, f":download {file}\nXQ #A\n:wait 0.2\n:upload\n:nonsense\n", monkeypatch, capsys)
    assert (code, out) == (1, [":", "#A", 'MG "hi"', "EN"])
    assert f"Downloaded: 3 lines from {file}\n" in err
    assert "message: hi\n" in err
    assert "There is no ':nonsense'" in err
