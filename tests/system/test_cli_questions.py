"""Questions of a job in the terminal of `maya run`: typed answers, the end of the input, and dry runs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from maya_un.cli.main import main
from tests.system.processes import MAYA
from tests.waiting import eventually

pytestmark = pytest.mark.system

JOB = """
steps:
  - ask: {question: "Which tray?", choices: [left, right]}
  - if: {answer: right}
    then:
      - wait: 2 s
    else:
      - wait_for: {input: 3, is: off, within: 1 min}
"""


@pytest.fixture(autouse=True)
def job(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Return the descriptor to which a person types."""
    read, write = os.pipe()
    with os.fdopen(read, "rb") as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        yield write


def report(line: str, capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, Any]:
    """Return the report that a command prints as JSON."""
    assert main([*line.split(), "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_a_typed_answer_chooses_the_branch(typed: int, capsys: pytest.CaptureFixture[str]) -> None:
    os.write(typed, b"middle\nright\n")
    found = report("run job.yaml --speed 200", capsys)
    os.close(typed)
    assert [step["state"] for step in found["steps"]] == ["done", "done", "done", "skipped"]
    assert found["steps"][0]["phase"] == "right"


def test_at_a_terminal_an_answer_that_was_typed_before_its_question_is_discarded(tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    os.write(ours, b"left\n")
    command = [MAYA, "run", str(tmp_path / "job.yaml"), "--speed", "200", "--json"]
    with subprocess.Popen(
        command, stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=tmp_path, text=True
    ) as running:
        os.close(theirs)
        assert running.stderr is not None
        assert any("Type one of left, right" in line for line in running.stderr)

        def answered() -> bool:
            os.write(ours, b"right\n")  # again and again: the first may come before the terminal is listened to
            return running.poll() is not None

        eventually(answered, "the end of the job")
        assert running.stdout is not None
        assert json.loads(running.stdout.read())["steps"][0]["phase"] == "right"
    os.close(ours)


def test_the_end_of_the_input_cancels_the_job(typed: int, capsys: pytest.CaptureFixture[str]) -> None:
    os.close(typed)
    assert main(["run", "job.yaml", "--speed", "200", "--json"]) != 0
    assert '"state": "cancelled"' in capsys.readouterr().out


def test_a_dry_run_gives_the_first_answer_and_changes_the_input(capsys: pytest.CaptureFixture[str]) -> None:
    found = report("run job.yaml --dry-run", capsys)
    assert [step["state"] for step in found["steps"]] == ["done", "done", "skipped", "done"]
    assert found["duration"] == pytest.approx(found["predicted"], abs=0.2)
    assert [remark.partition(":")[0] for remark in found["remarks"]] == ["step 1", "step 2", "step 4"]


def test_a_dry_run_refuses_an_unknown_output_at_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "job.yaml").write_text("steps:\n  - wait: 1\n  - set:\n      output: pump\n      to: on\n")
    assert main(["run", "job.yaml", "--dry-run"]) == 2
    assert "step 2, set.output (job.yaml, line 4, column 7)" in capsys.readouterr().err
