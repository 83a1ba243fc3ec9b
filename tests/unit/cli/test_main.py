"""The entry point: its imports, answers and failures."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

import maya_un
from maya_un.cli import app, quick
from maya_un.cli.help import EVERYWHERE
from maya_un.cli.main import main


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    names = [command.name or command.callback.__name__ for command in app.app.registered_commands if command.callback]
    assert [name for name in names if f"{name} " not in text and f"{name}\n" not in text] == []


@pytest.mark.parametrize("line", ["", "-h", "help", "pick --help", "dmc serve --help", "config --help", "run --help"])
def test_help_is_an_answer(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 0
    assert "maya" in capsys.readouterr().out


@pytest.mark.parametrize("line", ["dmc --help", "dmc gclib --help", "config --help", "plot --help"])
def test_list_of_commands_has_a_sentence_for_each(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 0
    commands = capsys.readouterr().out.partition("Commands:\n")[2].partition("\n\n")[0]
    assert [text for text in commands.splitlines() if text.endswith("...") or not text.endswith(".")] == []


def test_every_group_shows_the_global_options(capsys: pytest.CaptureFixture[str]) -> None:
    silent = list[str]()
    for line in [group.name for group in app.app.registered_groups] + ["dmc gclib"]:
        assert line is not None
        assert main([*line.split(), "--help"]) == 0
        if not capsys.readouterr().out.replace("\n  ", " ").endswith(f"{EVERYWHERE}\n"):
            silent.append(line)
    assert silent == []


def test_a_mistyped_command_gets_a_proposal(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dmc", "sned"]) == 2
    assert capsys.readouterr().err == (
        "maya: error 4008: No such command 'sned'. Perhaps you meant 'send'. See `maya dmc --help`.\n"
    )


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"version": maya_un.__version__}


def test_command_without_a_robot_names_the_program_to_start(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pick", "0.5", "1.2"]) == 1
    assert capsys.readouterr().err == (
        "maya: error 1020: `maya up` does not run on this computer. Start it, then run the command again. "
        "To stop a robot without `maya up`, run `maya stop --address real` (or HOST:PORT).\n"
    )


def test_an_error_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["pick", "0.5", "12parsec", "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["code"] == 4001
    assert error["details"]["key"] == "y"


def test_an_error_in_spanish(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--lang", "es", "home"]) == 1
    assert "`maya up` no está en marcha en este ordenador" in capsys.readouterr().err


def test_terminal_without_accents_gets_ascii(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = TextIOWrapper(BytesIO(), encoding="ascii")
    monkeypatch.setattr("sys.stdout", terminal)
    assert main(["--lang", "es", "reach", "3", "3", "3"]) == 1
    terminal.seek(0)
    assert "?" in terminal.read()


def test_unexpected_error_is_one_sentence_and_a_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> int:
        raise ZeroDivisionError("surprise")

    monkeypatch.setattr(quick, "run", broken)
    assert main(["status"]) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("maya: error 5999: ")
    assert "Traceback" not in captured.err + captured.out
    assert "surprise" in (tmp_path / "state" / "maya" / "maya.log").read_text()


def unheard(line: str, nobody: int) -> subprocess.CompletedProcess[str]:
    """Run a command whose answers go to a file or pipe that takes none."""
    command = [sys.executable, "-m", "maya_un.cli.main", *line.split()]
    return subprocess.run(command, stdout=nobody, stderr=subprocess.PIPE, text=True, check=False, timeout=50)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
@pytest.mark.parametrize(
    ("line", "code", "error"),
    [("dmc fault", 2, 5002), ("dmc fault --json", 2, 5002), ("dmc fault nope --json", 2, 4003)],
)
def test_answers_that_cannot_be_written_are_an_error_line(line: str, code: int, error: int) -> None:
    with Path("/dev/full").open("w") as full:
        done = unheard(line, full.fileno())
    assert done.returncode == code
    assert done.stderr.startswith(f"maya: error {error}: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(("line", "code"), [("dmc fault", 1), ("dmc fault nope --json", 2)])
def test_closed_output_ends_silently(line: str, code: int) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = unheard(line, writing)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (code, "")


@pytest.mark.parametrize("end", [KeyboardInterrupt, asyncio.CancelledError])
def test_ctrl_c_has_its_exit_code(end: type[BaseException], monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> int:
        raise end

    monkeypatch.setattr(quick, "run", interrupted)
    assert main(["status"]) == 130


@pytest.mark.parametrize("closed", [True, False])
def test_questions_survive_an_input_that_is_closed_or_no_text(closed: bool, tmp_path: Path) -> None:
    code = (
        "import sys; from maya_un.cli import output; output.tolerate_any_terminal(); "
        "print(ascii(sys.stdin.readline()), ascii(sys.stdin.readline()))"
    )
    (tmp_path / "typed").write_bytes(b"\xff\n")
    line = f'exec "$0" -c "$1" {"<&-" if closed else "< typed"}'
    done = subprocess.run(
        ["/bin/sh", "-c", line, sys.executable, code],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env={"PYTHONIOENCODING": "utf-8:strict"},
        timeout=30,
    )
    assert done.stdout == ("'' ''\n" if closed else "'\\ufffd\\n' ''\n")
