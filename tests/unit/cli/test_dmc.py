"""`maya dmc`: its commands in addition to the tools of `dmc`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dmc41x3.language.record import AxisRecord, DataRecord, encode
from maya_un.cli.main import main
from maya_un.controller import watchdog_program
from tests.unit.cli.servers import controller

PROGRAM = "#A\nx=1\nEN\n"
RECORD = encode(DataRecord((AxisRecord(), AxisRecord(), AxisRecord())))


def test_real_is_the_configured_controller(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    with controller(RECORD) as (port, said):
        file.write_text(f'[controller]\naddress = "127.0.0.1:{port}"\n')
        assert main(["dmc", "send", "real", "TP", "--config", str(file)]) == 0
    assert said[0] == b"TP"
    assert capsys.readouterr().out == ":\n"


def test_watchdog_is_put_after_a_program_that_allows_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.dmc"
    file.write_text(PROGRAM, encoding="ascii")
    assert main(["dmc", "download", "sim", str(file), "--guard", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lines"] == 3 + len(watchdog_program.text(0.5))
    file.write_text("#LIMSWI\nRE\n", encoding="ascii")
    assert main(["dmc", "download", "sim", str(file), "--guard", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["error"]["code"] == 2109
