"""`maya dmc send`: what a controller answers, for people and for programs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches, DataRecord, encode
from maya_un.cli.main import main
from tests.unit.cli.servers import controller

RECORD = encode(
    DataRecord(
        (
            AxisRecord(AxisStatus.MOVING, position=-120, reference=-118, error=-2),
            AxisRecord(AxisStatus.MOTOR_OFF, AxisSwitches.FORWARD_INACTIVE, stop_code=1),
            AxisRecord(),
        )
    )
)


def test_a_record_is_a_line_an_axis(capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, _):
        assert main(["dmc", "send", f"127.0.0.1:{port}", "QR"]) == 0
    a, b, c = capsys.readouterr().out.splitlines()
    assert a.startswith("A  position -120  reference -118  error -2  ")
    assert a.endswith("moving")
    assert b.endswith("stop code 1  motor off  reverse limit")
    assert c.endswith("stop code 0")


def test_a_record_is_json_whole(capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, _):
        assert main(["dmc", "send", f"127.0.0.1:{port}", "qr", "--json"]) == 0
    (reply,) = json.loads(capsys.readouterr().out)["replies"]
    assert reply["command"] == "qr"
    assert reply["reply"]["axes"][0]["position"] == -120
    assert reply["reply"]["s"]["free"] == 511


def test_send_takes_several_commands_between_semicolons(capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, said):
        assert main(["dmc", "send", f"127.0.0.1:{port}", "SH A;TP;", "MG 1", "--json"]) == 0
    assert said == [b"SH A", b"TP", b"MG 1"]
    replies = json.loads(capsys.readouterr().out)["replies"]
    assert [reply["command"] for reply in replies] == ["SH A", "TP", "MG 1"]


def test_real_is_the_configured_controller(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    with controller(RECORD) as (port, said):
        file.write_text(f'[controller]\naddress = "127.0.0.1:{port}"\n')
        assert main(["dmc", "send", "real", "TP", "--config", str(file)]) == 0
    assert said[0] == b"TP"
    assert capsys.readouterr().out == ":\n"
