"""`maya dmc send`: answers of a controller, for people and for programs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

import pytest

from dmc41x3.cli import main as dmc
from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches, DataRecord, encode
from tests.unit.cli.servers import controller

Run = Callable[[Sequence[str]], int]

RECORD = encode(
    DataRecord(
        (
            AxisRecord(AxisStatus.MOVING, position=-120, reference=-118, error=-2),
            AxisRecord(AxisStatus.MOTOR_OFF, AxisSwitches.FORWARD_INACTIVE, stop_code=1),
            AxisRecord(),
        )
    )
)


def test_a_record_is_a_line_an_axis(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, _):
        assert run(["send", f"127.0.0.1:{port}", "QR"]) == 0
    a, b, c = capsys.readouterr().out.splitlines()
    assert a.startswith("A  position -120  reference -118  error -2  ")
    assert a.endswith("moving")
    assert b.endswith("stop code 1  motor off  reverse limit")
    assert c.endswith("stop code 0")


def test_a_record_is_json_whole(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, _):
        assert run(["send", f"127.0.0.1:{port}", "qr", "--json"]) == 0
    (reply,) = json.loads(capsys.readouterr().out)["replies"]
    assert reply["command"] == "qr"
    assert reply["reply"]["axes"][0]["position"] == -120
    assert reply["reply"]["s"]["free"] == 511


def test_send_takes_several_commands_between_semicolons(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with controller(RECORD) as (port, said):
        assert run(["send", f"127.0.0.1:{port}", "SH A;TP;", "MG 1", "--json"]) == 0
    assert said == [b"SH A", b"TP", b"MG 1"]
    replies = json.loads(capsys.readouterr().out)["replies"]
    assert [reply["command"] for reply in replies] == ["SH A", "TP", "MG 1"]


def test_real_is_the_controller_in_the_environment(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with controller(RECORD) as (port, said):
        monkeypatch.setenv("DMC_ADDRESS", f"127.0.0.1:{port}")
        assert dmc.main(["send", "real", "TP"]) == 0
    assert said[0] == b"TP"
    assert capsys.readouterr().out == ":\n"


def test_real_without_an_address_is_refused(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert dmc.main(["send", "real", "TP"]) == 2
    assert capsys.readouterr().err == (
        "dmc: error 4001: HOST = 'real' is not valid: $DMC_ADDRESS does not name a controller.\n"
    )
