"""The command `dmc` by itself: its pages, its errors, and what it imports."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from dmc41x3 import __version__
from dmc41x3.cli import commands
from dmc41x3.cli.main import main
from maya_un.cli.main import main as maya_main

WITHOUT_MAYA = """
import sys
sys.modules["maya_un"] = None  # importing it fails
from dmc41x3.cli.main import main
sys.exit(main())
"""


@contextmanager
def process(*line: str) -> Iterator[subprocess.Popen[str]]:
    """Run `dmc` where no maya_un is installed, at most while the block runs."""
    command = [sys.executable, "-c", WITHOUT_MAYA, *line]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        try:
            yield running
        finally:
            running.kill()


def test_every_command_is_in_the_overview(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    page = capsys.readouterr().out
    names = {command.callback.__name__ for command in commands.group().registered_commands if command.callback}
    assert len(names) == 13
    assert {name for name in names | {"gclib"} if f"\n  {name} " not in page} == set()


def test_no_page_of_help_names_maya(capsys: pytest.CaptureFixture[str]) -> None:
    names = [command.callback.__name__ for command in commands.group().registered_commands if command.callback]
    for name in ["--help", *names, "gclib"]:
        assert main([name] if name == "--help" else [name, "--help"]) == 0
    assert "maya" not in capsys.readouterr().out.lower()


@pytest.mark.parametrize("name", ["send", "terminal", "conform"])
def test_help_says_what_real_means_for_a_command_without_a_configuration(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "--help"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    assert "real (the controller at $DMC_ADDRESS)" in page
    assert "configuration" not in page


@pytest.mark.parametrize(("begin", "words"), [(main, "dmc"), (maya_main, "maya dmc")])
def test_help_of_a_parameter_names_the_tools_of_its_group(
    begin: Callable[[list[str]], int], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert begin([*words.split()[1:], "replay", "--help"]) == 0
    assert f"written by `{words} capture`" in " ".join(capsys.readouterr().out.split())


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"version": __version__}


def test_an_unknown_command_is_refused_with_a_hint(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["frobnicate"]) == 2
    assert capsys.readouterr().err == "dmc: error 4008: No such command 'frobnicate'. See `dmc --help`.\n"


def test_an_error_is_in_the_language_of_the_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--firmware", "ñ", "--lang", "es", "--json"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert (error["code"], error["message"]) == (4001, "--firmware = ñ no es válido: debe ser una línea en ASCII.")


def test_a_defect_is_one_sentence_behind_its_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: object) -> int:
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(commands, "run", broken)
    assert main(["watch", "sim"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("Traceback")
    assert "dmc: error 5999: An internal error happened (ZeroDivisionError: a defect)." in said.splitlines()[-1]


def test_a_served_twin_needs_no_maya_and_ends_on_sigterm(tmp_path: Path) -> None:
    memory = tmp_path / "burned"
    with process("serve", "--port", "0", "--axes", "4", "--memory", str(memory), "--json") as twin:
        assert twin.stdout is not None
        said = ""
        while not said.endswith("}\n"):
            said += twin.stdout.readline()
        address = json.loads(said)["address"]
        with process("send", address, "SHD;DPD=400", "TPD", "BN") as client:
            out, err = client.communicate(timeout=60.0)
        assert (client.returncode, err) == (0, "")
        assert out.splitlines() == [":", ":", "400", ":"]
        os.kill(twin.pid, signal.SIGTERM)
        out, err = twin.communicate(timeout=60.0)
    assert (twin.returncode, out, err) == (0, "", "")
    assert memory.exists()
