"""The scripts complete what the parser knows; each is asked by its own shell where that is there."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from maya_un import runtime
from maya_un.cli import app
from maya_un.cli.completion import bash, fish, tree, values
from maya_un.cli.main import main
from tests.unit.cli.servers import http_service

BASH, ZSH, FISH = (shutil.which(shell) for shell in ("bash", "zsh", "fish"))

LINES = [
    ("q", {"queue"}),
    ("sto", {"stop"}),
    ("job s", {"show", "submit"}),
    ("gripper ", {"open", "close"}),
    ("queue move 3 b", {"before"}),
    ("--lang ", {"en", "es"}),
    ("--lang es user role bob s", {"student"}),
    ("job again --from 3 --j", {"--json"}),
    ("plot workspace --view s", {"section"}),
    ("logs --level w", {"warning"}),
    ("dmc gclib st", {"status"}),
    ("up --address ", {"sim", "real"}),
    ("home x", set()),
]


@functools.cache
def all_commands() -> tuple[tree.CompletionCommand, ...]:
    return tuple(tree.commands(typer.main.get_command(app.app)))


def test_tree_has_every_command_and_its_options() -> None:
    known = {command.path: command for command in all_commands()}
    assert {"maya", "maya status", "maya stop", "maya job show", "maya dmc gclib run"} <= known.keys()
    assert known["maya job show"].arguments == (tree.JOBS,)
    assert known["maya run"].arguments == (tree.FILES,)
    assert known["maya pick"].arguments[0] == tree.PLACES
    up = {option.name: option for option in known["maya up"].options}
    assert (up["--address"].values, up["--speed"].valued, up["--skip-home"].valued) == ("sim real", True, False)
    assert {"--json", "--lang", "--config"} <= up.keys()


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_command_prints_the_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    known = all_commands()
    script = fish.script(known) if shell == "fish" else bash.script(known, shell)
    assert capsys.readouterr().out == f"{script}\n"


@pytest.mark.skipif(BASH is None, reason="there is no bash")
@pytest.mark.parametrize(("line", "offered"), LINES)
def test_bash_offers(line: str, offered: set[str], tmp_path: Path) -> None:
    ask = 'source ./script; COMP_WORDS=(maya "$@"); COMP_CWORD=$#; _maya; printf \'%s\\n\' "${COMPREPLY[@]}"'
    (tmp_path / "script").write_text(bash.script(all_commands()))
    words = line.split(" ")
    done = subprocess.run(
        [str(BASH), "-c", ask, "bash", *words], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert (set(done.stdout.split()), done.stderr) == (offered, "")


@pytest.mark.skipif(BASH is None, reason="there is no bash")
def test_bash_offers_files_for_file_arguments(tmp_path: Path) -> None:
    (tmp_path / "my job.yaml").touch()
    test_bash_offers("run my", {"my", "job.yaml"}, tmp_path)


@pytest.mark.skipif(FISH is None, reason="there is no fish")
@pytest.mark.parametrize(("line", "offered"), LINES)
def test_fish_offers(line: str, offered: set[str], tmp_path: Path) -> None:
    (tmp_path / "script").write_text(fish.script(all_commands()))
    ask = f"source ./script; complete -C 'maya {line}'"
    done = subprocess.run(
        [str(FISH), "--no-config", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert {answer.partition("\t")[0] for answer in done.stdout.splitlines()} == offered


@pytest.mark.skipif(ZSH is None, reason="there is no zsh")
def test_zsh_reads_the_script(tmp_path: Path) -> None:
    (tmp_path / "script").write_text(bash.script(all_commands(), "zsh"))
    ask = "autoload -U compinit && compinit -u -d dump && source ./script && echo $_comps[maya]"
    done = subprocess.run([str(ZSH), "-f", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "_maya" in done.stdout


def test_values_are_from_the_running_robot(capsys: pytest.CaptureFixture[str]) -> None:
    def says(_: str, path: str, __: object) -> tuple[int, object]:
        return 200, [{"id": 8}, {"id": 7}] if path.startswith("/v1/jobs") else [{"name": "shelf"}]

    with http_service(says) as url, runtime.claimed():
        runtime.publish(runtime.Running(url, os.getpid(), None))
        assert (values.run(["jobs"]), capsys.readouterr().out) == (0, "8\n7\n")
        assert main(["completion", "values", "places"]) == 0
        assert capsys.readouterr().out == "shelf\n"


@pytest.mark.parametrize("kind", [["jobs"], ["what"], []])
def test_without_a_service_there_are_no_values(kind: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert values.run(kind) == 0
    assert capsys.readouterr() == ("", "")


def test_completion_loads_no_parser() -> None:
    ask = (
        "import sys; from maya_un.cli.main import main; main(['completion', 'values', 'jobs']); "
        "print(sorted({'typer', 'asyncio', 'pydantic', 'numpy'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
