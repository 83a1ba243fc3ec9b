from __future__ import annotations

import json

import pytest

from maya_un.cli.main import main
from maya_un.cli.settings import OutputSettings, from_environment, split
from maya_un.errors import InvalidCommandLine, InvalidValue


@pytest.mark.parametrize(
    "line",
    [
        "--json --lang es --config c.toml pick 1 -2",
        "pick --json 1 --lang=es -2 --config=c.toml",
        "pick 1 -2 --config c.toml --lang es --json",
    ],
)
def test_global_option_may_stand_anywhere(line: str) -> None:
    assert split(line.split(), OutputSettings()) == (OutputSettings("es", True, "c.toml"), ["pick", "1", "-2"])


def test_nothing_is_taken_behind_two_dashes() -> None:
    assert split(["dmc", "send", "h", "--", "--json"], OutputSettings()) == (
        OutputSettings(),
        ["dmc", "send", "h", "--json"],
    )


@pytest.mark.parametrize("line", [["--lang"], ["--lang="], ["status", "--config"]])
def test_an_option_needs_its_value(line: list[str]) -> None:
    with pytest.raises(InvalidCommandLine):
        split(line, OutputSettings())


def test_an_unknown_language_is_refused() -> None:
    with pytest.raises(InvalidValue, match="en, es"):
        split(["--lang", "fr"], OutputSettings())


@pytest.mark.parametrize(("value", "language"), [("es", "es"), ("es_CO.UTF-8", "es"), ("fr", "en"), ("", "en")])
def test_the_environment_chooses_a_language_we_have(value: str, language: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_LANG", value)
    assert from_environment().language == language


@pytest.mark.parametrize("line", ["--json poses --config", "poses --lang xx --json", "--config= --json poses"])
def test_a_line_that_is_not_understood_is_answered_as_it_asks(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 2
    said = capsys.readouterr()
    assert json.loads(said.out)["error"]["code"] in {4001, 4008}
    assert said.err == ""
