"""`maya doctor` as a command: its output, its exit code, and a text for every finding."""

from __future__ import annotations

import inspect
import json
import os
import re
from pathlib import Path
from types import ModuleType
from typing import get_args

import pytest

from maya_un import runtime
from maya_un.cli.doctor import controller, service, show
from maya_un.cli.main import main
from maya_un.http.doctor import certificate, finding, host, robot, words
from maya_un.http.doctor.finding import Finding, ok
from maya_un.schema.diagnosis import CheckName, FindingOutcome
from tests.ports import free_port
from tests.unit.cli.servers import http_service

MODULES = (service, controller, host, certificate, robot, finding, show)


def test_every_check_runs_and_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["doctor"])
    lines = capsys.readouterr().out.splitlines()
    named = {line.split()[1].rstrip(":") for line in lines if not line.startswith(" ")}
    assert {"service", "configuration", "controller", "storage", "disk", "ports", "clock", "ROS"} <= named
    assert code == int(any(line.startswith("FAIL") for line in lines))


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ("theirs.toml", "ok    configuration: The running service uses the configuration {path}, which is valid."),
        ("", "ok    configuration: The running service uses no configuration file: the manual's values apply."),
    ],
)
def test_the_configuration_is_that_of_the_running_service(
    config: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "ours.toml").touch()
    (tmp_path / "theirs.toml").touch()
    monkeypatch.setenv("MAYA_CONFIG", str(tmp_path / "ours.toml"))
    path = str(tmp_path / config) if config else ""
    with http_service(lambda *_: (200, {})) as url, runtime.claimed():
        runtime.publish(runtime.Running(url, os.getpid(), None, path))
        main(["doctor"])
    assert said.format(path=path) in capsys.readouterr().out.splitlines()


def test_failed_check_sets_the_exit_code(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    address = f"127.0.0.1:{free_port()}"
    assert main(["doctor", "--address", address, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)["findings"]
    (failed,) = [one for one in found if one["check"] == "controller"]
    assert (failed["outcome"], failed["key"]) == ("fail", "controller_silent")
    assert address in failed["meaning"]
    assert failed["remedy"]
    assert list(tmp_path.glob("**/maya.db")) == []


def test_it_speaks_spanish(capsys: pytest.CaptureFixture[str]) -> None:
    main(["doctor", "--lang", "es"])
    assert "configuración: " in capsys.readouterr().out


def test_no_address_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--address", "not an address"]) == 2
    assert "4001" in capsys.readouterr().err


def test_a_check_that_fails_itself_does_not_keep_the_others_from_helping(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> None:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(host, "disk", broken)
    assert main(["doctor"]) == 1
    printed = capsys.readouterr().out
    assert "FAIL  disk: This could not be checked (ZeroDivisionError: on purpose)." in printed
    assert "ROS: " in printed


@pytest.mark.parametrize("module", MODULES)
def test_every_finding_has_a_name_and_words_in_both_languages(module: ModuleType) -> None:
    source = inspect.getsource(module)
    named = re.findall(r'(?:ok|warn|fail|skipped|found)\(\s*"([^"]+)"', source)
    keys = set(re.findall(r'"((?:[a-z]+_)+[a-z]+)"', source)) & words._TEXTS.keys()
    assert named or keys
    assert [check for check in named if check not in get_args(CheckName)] == []


def test_every_text_is_used() -> None:
    source = "".join(
        inspect.getsource(module) for module in (service, controller, host, certificate, robot, finding, show)
    )
    assert [key for key in words._TEXTS if f'"{key}"' not in source] == []


def test_details_are_filled_in() -> None:
    finding = ok("firmware", "firmware", firmware="DMC4133 Rev 1.3k")
    assert words.meaning(finding, "en") == "It is DMC4133 Rev 1.3k."
    assert words.remedy(finding, "es") == ""
    assert Finding("disk", FindingOutcome.OK, "disk_room", {"free": 5.04}).details == {"free": 5.04}
    assert words.meaning(Finding("disk", FindingOutcome.OK, "disk_room", {"free": 5.04}), "es").startswith(
        "Quedan 5.0 GB"
    )
