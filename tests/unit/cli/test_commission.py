"""`maya commission` on a twin: answers from a file, report, configuration, and the page that lists the steps."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from maya_un.cli import output
from maya_un.cli.commission.people import TerminalPerson
from maya_un.cli.main import main
from maya_un.cli.settings import OutputSettings
from maya_un.commission.progress import FILE
from maya_un.commission.questions import KEY_PARTS, QUESTIONS, PossibleAnswer, Question, QuestionKind
from maya_un.commission.steps import STEPS
from maya_un.config import load
from tests.conventions.source import ROOT

PAGE = ROOT / "docs" / "how-to" / "commission-a-robot.md"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with an empty configuration, which also has the state."""
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))
    monkeypatch.setenv("MAYA_CONFIG", str(tmp_path / "maya.toml"))
    (tmp_path / "maya.toml").write_text("# mine\n", encoding="utf-8")
    return tmp_path


def answers(folder: Path, **given: str) -> list[str]:
    """Return the options of a rehearsal with some answers; `_` in their names stands for a dot."""
    file = folder / "answers.toml"
    lines = [f'"{name.replace("_", ".")}" = "{value}"' for name, value in given.items()]
    file.write_text("\n".join(lines), encoding="utf-8")
    return ["commission", "--address", "sim", "--speed", "1000", "--answers", str(file)]


def run(words: Sequence[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any]]:
    """Run the command, and return its exit code and its answer as JSON."""
    capsys.readouterr()
    code = main([*words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def states(report: Path) -> dict[str, str]:
    """Return the results in a report, by the key of the step."""
    rows = [row for row in report.read_text(encoding="utf-8").splitlines() if row.startswith("| ")]
    return {step.key: row.split("|")[2].strip() for step, row in zip(STEPS, rows[1:], strict=True)}


def test_a_rehearsal_begins_with_the_first_step_and_stores_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    real = {"address": "192.0.2.1", "steps": {}, "changes": {}}
    (folder / FILE).write_text(json.dumps(real), encoding="utf-8")
    for _ in range(2):
        code, found = run(answers(folder, limits_ready="quit"), capsys)
        assert code == output.FAILED
        assert {key: one["state"] for key, one in found["steps"].items()} == {
            "connection": "passed",
            "stop": "passed",
            "limits": "interrupted",
        }
    assert json.loads((folder / FILE).read_text(encoding="utf-8")) == real


def test_a_rehearsal_does_not_promise_to_continue(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(answers(folder, limits_ready="quit")) == output.FAILED
    shown = capsys.readouterr().out
    assert shown.endswith("Not complete. A rehearsal always begins with the first step.\n")
    assert "continue" not in shown


def test_an_interrupted_commissioning_continues(folder: Path) -> None:
    with served(folder) as address:
        first = typed_ahead(folder, address, LOOKED)
        assert first.count(": passed before.") == 0
        second = typed_ahead(folder, address, "q\n")
        assert [line for line in second.splitlines() if "passed before" in line] == ["Controller: passed before."]
        assert second.endswith("Not complete. Run `maya commission` again to continue.\n")
        again = typed_ahead(folder, address, "q\n", "--restart")
        assert "passed before" not in again
    assert json.loads((folder / FILE).read_text(encoding="utf-8"))["steps"].keys() == {"connection"}


def test_the_configuration_is_written_only_if_confirmed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = folder / "truth.toml"
    truth.write_text("[gripper]\noutput = 5\n[wiring]\nlimit_active_level = 1\n", encoding="utf-8")
    words = ["--truth", str(truth), "--report", str(folder / "report.md")]
    code, found = run([*answers(folder, home_ready="skip"), *words], capsys)
    assert code == output.FAILED
    assert not found["written"]
    assert (folder / "maya.toml").read_text(encoding="utf-8") == "# mine\n"
    code, found = run([*answers(folder, home_ready="skip", configuration_write="yes"), *words], capsys)
    assert found["written"]
    assert {one["name"]: one["after"] for one in found["changes"]} == {
        "gripper.output": 5,
        "wiring.limit_active_level": 1,
    }
    config = load(folder / "maya.toml")
    assert (config.gripper.output, config.wiring.limit_active_level) == (5, 1)
    assert (folder / "maya.toml").read_text(encoding="utf-8").startswith("# mine\n")
    report = (folder / "report.md").read_text(encoding="utf-8")
    assert "2611 Output 1 does not move the gripper, and output 5 does." in report
    assert "- `gripper.output`: 1 → 5" in report


def test_a_mistake_is_named_and_the_steps_that_need_it_wait(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = folder / "truth.toml"
    truth.write_text('[miswired]\nencoder_dead = ["b"]\n', encoding="utf-8")
    code, found = run([*answers(folder, direction_a_ready="skip"), "--truth", str(truth)], capsys)
    assert code == output.FAILED
    assert [error["code"] for error in found["steps"]["direction.b"]["errors"]] == [2616]
    assert found["steps"]["direction.a"]["state"] == "skipped"
    assert found["steps"]["home"]["state"] == "blocked"
    assert main([*answers(folder, direction_c_ready="quit"), "--truth", str(truth)]) == output.FAILED
    assert "Not complete. Remove the mistakes, then run `maya commission` again.\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('"gripper.ready" = "perhaps"', 4001),
        ('"gripper.redy" = "quit"', 4003),
        ('"gripper.9.set" = "open"', 4003),
        ("gripper", 4007),
        ('[miswired]\nencoder_dead = ["x"]', None),
    ],
)
def test_wrong_answers_are_refused(
    text: str, code: int | None, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = answers(folder)
    (folder / "answers.toml").write_text(text, encoding="utf-8")
    if code is None:
        words, code = [*answers(folder), "--truth", str(folder / "truth.toml")], 5001
        (folder / "truth.toml").write_text(text, encoding="utf-8")
    status, found = run([*words, "--restart"], capsys)
    assert status != output.DONE
    assert found["error"]["code"] == code


def test_a_mistyped_key_of_an_answer_is_refused_with_the_keys(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(answers(folder, gripper_redy="quit")) == output.REFUSED
    told = capsys.readouterr()
    assert told.out == ""
    assert "There is no 'gripper.redy'. Known: connection.ready, " in told.err
    assert " direction.AXIS.TRY.seen," in told.err


def test_answers_are_for_the_twin(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = answers(folder)
    words[2] = "192.0.2.1"
    status, found = run([word for word in words if word not in {"--speed", "1000"}], capsys)
    assert status == output.REFUSED
    assert found["error"]["code"] == 4008


def test_ctrl_c_ends_the_command_and_reports_its_results(folder: Path) -> None:
    command = [*MAYA, "commission", "--address", "sim", "--speed", "5", "--report", str(folder / "report.md")]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, env=own(folder), text=True
    ) as running:
        assert running.stdout is not None
        for line in running.stdout:
            if line.startswith("Slow motion of line b"):
                running.send_signal(signal.SIGINT)
                break
        rest = running.stdout.read()
        assert running.wait() == output.INTERRUPTED
    assert "Stopped. A rehearsal always begins with the first step." in rest
    found = states(folder / "report.md")
    assert (found["travel.a"], found["travel.b"]) == ("passed", "interrupted")


def table(title: str) -> list[str]:
    """Return the rows of the table in a section of the page."""
    section = PAGE.read_text(encoding="utf-8").partition(f"\n{title}\n")[2].partition("\n## ")[0]
    return [line for line in section.splitlines() if line.startswith("| `")]


def test_the_page_lists_the_keys_and_answers_of_all_questions() -> None:
    shown: dict[str, str] = {}
    for row in table("## Rehearse it"):
        keys, given = row.strip("|").split("|")
        shown |= dict.fromkeys([key.strip("` ") for key in keys.split(",")], given.strip())
    assert shown == {key: ", ".join(f"`{one}`" for one in given) or "a number" for key, given in QUESTIONS.items()}
    page = PAGE.read_text(encoding="utf-8")
    for name, values in KEY_PARTS.items():
        assert f"`{name}` is {', '.join(f'`{value}`' for value in values)}" in page


def test_a_question_that_is_not_declared_cannot_be_asked() -> None:
    with pytest.raises(ValueError, match=r"direction\.d\.seen"):
        Question("direction.d.seen", QuestionKind.SEEN, "What moved?", PLAIN)
    with pytest.raises(ValueError, match="perhaps"):
        Question("gripper.ready", QuestionKind.READY, "Ready?", (PossibleAnswer("perhaps", "p: perhaps"),))


def test_the_page_lists_the_declared_steps() -> None:
    shown = []
    for row in table("## The steps"):
        key, does, needs = (cell.strip() for cell in row.strip("|").split("|"))
        shown.append((key.strip("`"), does, needs))
    for step, (key, does, needs) in zip(STEPS, shown, strict=True):
        assert (key, does) == (step.key, step.does)
        if key == "home":
            assert needs == "all before it"
            assert set(step.needs) == {one.key for one in STEPS[: STEPS.index(step)]}
        else:
            assert [name.strip("` ") for name in needs.split(",") if name] == list(step.needs)


def asked(question: Question, typed: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the answer of a person whose lines come through a pipe."""
    read, write = os.pipe()
    os.write(write, typed.encode())
    os.close(write)
    with os.fdopen(read, "rb") as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        return asyncio.run(TerminalPerson(OutputSettings()).ask(question))


CHOICES = (PossibleAnswer("go", "Enter: go on"), PossibleAnswer("skip", "s: skip this step"))
PLAIN = (PossibleAnswer("b+", "line b moved (longer)"), PossibleAnswer("b-", "line b moved (shorter)"))


@pytest.mark.parametrize(
    ("choices", "typed", "answer"),
    [
        (CHOICES, "\n", "go"),
        (CHOICES, "S\n", "skip"),
        (CHOICES, "what\n\n", "go"),
        (CHOICES, "q\n", "quit"),
        (CHOICES, "", "quit"),
        (PLAIN, "2\n", "b-"),
        (PLAIN, "\n7\n1\n", "b+"),
        ((), "two\n2.5\n", "2.5"),
        ((), "-1\nq\n", "quit"),
    ],
)
def test_a_person_at_the_terminal_answers_by_letter_or_number(
    choices: tuple[PossibleAnswer, ...], typed: str, answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = "limits.ready" if choices == CHOICES else "direction.b.seen" if choices else "direction.b.length"
    question = Question(key, QuestionKind.SEEN, "What moved?", choices, 1)
    assert asked(question, typed, monkeypatch) == answer


CHOICE = "[Enter: go on | s: skip this step | q: quit"
"""The choices of the question whether a step may begin."""


MAYA = (sys.executable, "-m", "maya_un.cli.main")


def own(folder: Path) -> dict[str, str]:
    """Return an environment in which all files of the commands are in a folder."""
    return {**os.environ, "MAYA_STATE_DIR": str(folder), "MAYA_RUNTIME_DIR": str(folder)}


class Terminal(NamedTuple):
    """A rehearsal at a terminal: what it shows, and the keyboard."""

    running: subprocess.Popen[str]
    keyboard: int

    def until(self, text: str) -> list[str]:
        """Return the lines up to the one that contains a text."""
        assert self.running.stdout is not None
        lines: list[str] = []
        for line in self.running.stdout:
            lines.append(line)
            if text in line:
                return lines
        raise AssertionError(f"never showed {text!r}, but:\n{''.join(lines)}")

    def enter(self, line: str) -> None:
        """Type a line."""
        os.write(self.keyboard, f"{line}\n".encode())

    def end(self) -> tuple[int, str]:
        """Return the exit code, and the rest of what shows."""
        assert self.running.stdout is not None
        rest = self.running.stdout.read()
        return self.running.wait(), rest


@contextmanager
def terminal(folder: Path, words: Sequence[str], typed: str = "") -> Iterator[Terminal]:
    """Run a command at a terminal at which lines were typed before it starts."""
    ours, theirs = os.openpty()
    os.write(ours, typed.encode())
    command = [*MAYA, *words]
    with subprocess.Popen(command, stdin=theirs, stdout=subprocess.PIPE, env=own(folder), text=True) as running:
        os.close(theirs)
        try:
            yield Terminal(running, ours)
        finally:
            running.kill()
            os.close(ours)


REHEARSAL = ("commission", "--address", "sim", "--speed", "1000")


def test_at_a_terminal_a_person_says_whether_a_step_may_begin(folder: Path) -> None:
    with terminal(folder, (*REHEARSAL, "--report", str(folder / "report.md"))) as person:
        for line in ("", "", "q"):
            person.until(CHOICE)
            person.enter(line)
        assert person.end()[0] == output.FAILED
    found = list(states(folder / "report.md").values())
    assert found == ["passed", "passed", "interrupted", *["not begun"] * (len(STEPS) - 3)]


def test_enters_that_were_typed_before_a_question_begin_no_step(folder: Path) -> None:
    with terminal(folder, REHEARSAL, typed="\n" * 40) as person:
        person.until(CHOICE)
        person.enter("\n\n\n")  # the first is the answer; the others come before the next question
        assert "--- Emergency stop\n" in person.until(CHOICE)
        person.enter("q")
        assert person.end()[1].count(CHOICE) == 0


def test_enters_that_were_typed_before_it_say_nothing_about_the_emergency_stop(folder: Path) -> None:
    with served(folder) as address, terminal(folder, ("commission", "--address", address)) as person:
        for _ in range(2):
            person.until(CHOICE)
            person.enter("\n\n\n\n\n")
        person.until("[Enter: done]")
        person.enter("q")
        assert "[Enter: done]" not in person.end()[1]


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Yield the address of a twin in the network."""
    serving = [*MAYA, "dmc", "serve", "--port", "0"]
    with subprocess.Popen(serving, stdout=subprocess.PIPE, env=own(folder), text=True) as twin:
        try:
            assert twin.stdout is not None
            yield twin.stdout.readline().strip()
        finally:
            twin.terminate()


LOOKED = "\ns\ns\n\no\nc\n"
"""Connects, skips the emergency stop and the switches, and looks at the gripper; no axis may move then."""


def typed_ahead(folder: Path, address: str, lines: str, *words: str) -> str:
    """Commission a controller with lines from a pipe, and return what shows; fails if all steps have passed."""
    command = [*MAYA, "commission", "--address", address, *words]
    ended = subprocess.run(command, input=lines, capture_output=True, env=own(folder), text=True, check=False)
    assert ended.returncode == output.FAILED, ended.stderr
    return ended.stdout


def test_a_controller_in_the_network_is_commissioned_by_a_person_at_the_terminal(folder: Path) -> None:
    with served(folder) as address:
        shown = typed_ahead(folder, address, LOOKED)
    found = json.loads((folder / FILE).read_text(encoding="utf-8"))
    assert found["address"] == address
    states = {key: one["state"] for key, one in found["steps"].items()}
    assert (states["connection"], states["gripper"]) == ("passed", "passed")
    assert {states[key] for key in ("stop", "limits")} == {"skipped"}
    assert {states[step.key] for step in STEPS[4:]} == {"blocked"}
    assert "| Gripper | passed | output 1, closed_by clear |" in shown


def test_a_controller_with_an_owner_is_commissioned_with_take_over(folder: Path) -> None:
    with served(folder) as address, terminal(folder, ("commission", "--address", address)) as owner:
        owner.until(CHOICE)
        owner.enter("")
        owner.until(CHOICE)  # it owns the controller now
        command = [*MAYA, "commission", "--address", address, "--restart"]
        refused = subprocess.run(command, input="\n", capture_output=True, env=own(folder), text=True, check=False)
        assert refused.returncode == output.FAILED
        assert "1030" in refused.stderr
        assert "`--take-over`" in refused.stderr
        shown = typed_ahead(folder, address, "\nq\n", "--restart", "--take-over")
    assert "| Controller | passed | firmware " in shown


NEVER = "192.0.2.1"
"""The address of a controller that nothing connects to, because the person quits before."""

PASSED = {"state": "passed", "errors": [], "readings": {}}


def at_once_quit(
    folder: Path, stored: bytes, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> list[str]:
    """Return what shows to a person who quits at the first question, with a stored progress."""
    (folder / FILE).write_bytes(stored)
    read, write = os.pipe()
    os.write(write, b"q\n")
    os.close(write)
    with os.fdopen(read, "rb") as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        assert main(["commission", "--address", NEVER]) == output.FAILED
    return capsys.readouterr().out.splitlines()


def progress_file(steps: object, changes: object) -> bytes:
    """Return a stored progress."""
    return json.dumps({"address": NEVER, "steps": steps, "changes": changes}).encode()


@pytest.mark.parametrize(
    "stored",
    [
        progress_file({}, {"gripper": 1, "gripper.output": 2}),
        progress_file({}, {"gripper.output": 2, "gripper": 1}),
        progress_file({}, {"gripper.no_such_key": 1}),
        progress_file({"connection": {**PASSED, "errors": [{"code": float("inf"), "message": "?"}]}}, {}),
        progress_file({"connection": {**PASSED, "errors": [{"code": 2601, "message": "\ud800"}]}}, {}),
        progress_file({"connection": {**PASSED, "state": "perhaps"}}, {}),
        progress_file({"connection": 1}, {}),
        b"[" * 100_000,
        b"[]",
        b"{",
        b'{"address": "\xff"}',
    ],
    ids=range(11),
)
def test_a_damaged_progress_means_to_begin_again(
    stored: bytes, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = at_once_quit(folder, stored, capsys, monkeypatch)
    damaged = f"The stored progress in {folder / FILE} is damaged, or does not fit the configuration. The "
    assert shown[0] == f"{damaged}commissioning begins with the first step."
    assert shown[1] == "--- Controller"
    assert json.loads((folder / FILE).read_text(encoding="utf-8"))["steps"].keys() == {"connection"}


def test_a_progress_that_is_whole_is_continued_without_a_word(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    stored = progress_file({"connection": PASSED}, {"gripper.output": 5})
    assert at_once_quit(folder, stored, capsys, monkeypatch)[0] == "Controller: passed before."
    other = json.dumps({"address": "192.0.2.2", "steps": 7}).encode()
    assert at_once_quit(folder, other, capsys, monkeypatch)[0] == "--- Controller"


def test_the_titles_of_the_steps_are_translated(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["--lang", "es", *answers(folder, stop_ready="skip", limits_ready="quit")])
    titles = [line for line in capsys.readouterr().out.splitlines() if line.startswith("--- ")]
    assert titles == ["--- Controlador", "--- Parada de emergencia", "--- Finales de carrera"]
