"""Commands of independent motion, as far as `test_machine_motion` does not run them."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("setup", "ask", "printed"),
    [
        ("DP 10000;PA 8000", "PR ?", "-2000"),
        ("PRB=-70", "PR ,?", "-70"),
        ("DPB=500;PAB=800", "PA ,?", " 500"),
        ("DPA=500", "DP ?", " 500"),
        ("DPA=500", "TPA", " 500"),
        ("DPA=500", "RPA", " 500"),
        ("DEA=-3", "TDA", "-3"),
        ("JG -500", "JG ?", " 500"),
        ("JG -500", "SP ?", " 500"),
        ("PTA=1", "PT ?,?", " 1, 0"),
        ("DPA=7", "IP ?", " 7"),
        ("ALA", "MG _ALA,_ALB", " 1.0000 0.0000"),
        ("AL", "MG _ALA,_ALC", " 1.0000 1.0000"),
        ("ALA", "RLA", " 0"),
        ("MOA", "MG _MOA,_MOB", " 1.0000 0.0000"),
        ("MO", "MG _MOA,_MOB,_MOC", " 1.0000 1.0000 1.0000"),
    ],
)
def test_set_values_are_printed(setup: str, ask: str, printed: str) -> None:
    bench = Bench()
    bench.do(setup)
    assert bench.say(ask) == f"{printed}\r\n:"


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("PTA=2", ErrorCode.OUT_OF_RANGE),
        ("PAA=2147483648", ErrorCode.OUT_OF_RANGE),
        ("PA 1,2,3,4", ErrorCode.OPERAND_ERROR),
        ("PAD=1", ErrorCode.INVALID_AXIS),
        ("PAS=1", ErrorCode.S_OPERAND_INVALID),
        ("PA", ErrorCode.NOT_ENOUGH_FIELDS),
        ("BGD", ErrorCode.INVALID_AXIS),
        ("SHS", ErrorCode.S_OPERAND_INVALID),
        ("BG 1", ErrorCode.OPERAND_ERROR),
        ("AB 2", ErrorCode.OUT_OF_RANGE),
        ("AB -1", ErrorCode.OUT_OF_RANGE),
        ("ALD", ErrorCode.INVALID_AXIS),
        ("FES", ErrorCode.S_OPERAND_INVALID),
        ("JGA=16000000", ErrorCode.OUT_OF_RANGE),
        ("BGT", ErrorCode.NO_SEQUENCE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


def test_begin_and_servo_without_names_mean_all_axes() -> None:
    bench = Bench(servo=False)
    assert [bench.value(f"_MO{axis}") for axis in "ABC"] == [1.0, 1.0, 1.0]
    bench.do("SH", "PR 100,200,300", "BG")
    assert [bench.value(f"_BG{axis}") for axis in "ABC"] == [1.0, 1.0, 1.0]
    assert bench.at(5.0).positions() == [100, 200, 300]


def test_a_relative_move_repeats_and_an_absolute_one_does_not() -> None:
    bench = Bench()
    bench.do("PRA=100;PAB=100", "BGAB")
    bench.at(1.0).do("BGAB")
    assert bench.at(2.0).positions() == [200, 100, 0]


def test_a_move_of_nothing_is_over_within_a_sample() -> None:
    bench = Bench()
    bench.do("PAA=0", "BGA")
    assert bench.value("_BGA") == 1.0
    assert bench.at(0.002).value("_BGA") == 0.0
    assert bench.value("_SCA") == 1.0


def test_pa_returns_the_end_of_the_last_motion_and_not_its_target() -> None:
    bench = Bench()
    bench.do("SP 10240;AC 10240;DC 10240", "PAA=102400;BGA")
    bench.at(2.0).do("STA")
    bench.at(4.0)
    assert bench.value("_PAA") == bench.value("_RPA") == 5_120 + 10_240 + 5_120
    bench.do("PAA=0")
    assert bench.value("_PAA") == 20_480.0
    assert bench.say("PR ?") == "-20480\r\n:"


@pytest.mark.parametrize("names", ["", "A", "AB", "S", "T"])
def test_a_stop_at_rest_is_harmless(names: str) -> None:
    bench = Bench()
    bench.do(f"ST {names}")
    assert bench.say("SC") == " 1, 1, 1\r\n:"


def test_stop_names_axes_and_planes_together() -> None:
    bench = Bench()
    bench.do("LM AB;LI 90000,90000;LE", "PRC=90000", "BGSC")
    bench.at(1.0).do("STCS")
    assert bench.say("SC") == " 4, 4, 4\r\n:"


@pytest.mark.parametrize("argument", ["", " 0", " 1"])
def test_abort_stops_every_axis(argument: str) -> None:
    bench = Bench()
    bench.do("JG 5000,-5000;BGAB", "OEA=1;OEB=2;OEC=3")
    bench.at(1.0)
    before = bench.positions()
    bench.do(f"AB{argument}")
    assert bench.say("SC") == " 7, 7, 7\r\n:"
    assert [bench.value(f"_MO{axis}") for axis in "ABC"] == [1.0, 0.0, 1.0]
    assert bench.at(5.0).positions() == before


def test_servo_off_and_on_keeps_the_place() -> None:
    bench = Bench()
    bench.do("PRA=500;BGA")
    bench.at(3.0).do("MOA", "SHA")
    assert bench.positions() == [500, 0, 0]
    assert bench.value("_SCA") == 1.0


@pytest.mark.parametrize("command", ["IPA=-5", "IPA=5"])
def test_an_ip_during_a_stop_has_the_wrong_sign(command: str) -> None:
    bench = Bench()
    bench.do("SP 10240;AC 10240;DC 10240", "PRA=102400;BGA")
    bench.at(2.0).do("STA")
    assert bench.code(command) == ErrorCode.IP_WRONG_SIGN


@pytest.mark.parametrize("command", ["IPA=5", "JGA=5", "DCA=2048"])
def test_homing_allows_commands(command: str) -> None:
    bench = Bench()
    bench.do("FEA;BGA")
    reply = bench.at(0.5).say(command)
    assert (reply == ":") is (command[:2] == "DC")


def test_an_ip_at_rest_needs_the_servo() -> None:
    bench = Bench()
    bench.do("MOA")
    assert bench.code("IPA=5") == ErrorCode.BEGIN_MOTOR_OFF


def test_a_tracking_axis_turns_round_and_stops_tracking_with_its_motor() -> None:
    bench = Bench()
    bench.do("PTA=1", "SP 10240;AC 10240;DC 10240", "PAA=50000")
    bench.at(2.0).do("PAA=0")
    assert bench.at(10.0).positions()[0] == 0
    assert bench.value("_PTA") == 1.0
    bench.do("MOA")
    assert bench.value("_PTA") == 0.0


def test_a_tracking_axis_needs_the_servo() -> None:
    bench = Bench()
    bench.do("PTA=1", "AB 1", "PTA=1", "MOA")
    bench.do("PTA=1")
    assert bench.code("PAA=5") == ErrorCode.BEGIN_MOTOR_OFF


@pytest.mark.parametrize(
    ("soft", "way", "code"),
    [("FLA=-1", 5, 22), ("FLA=-1", -5, 0), ("BLA=1", -5, 22), ("BLA=1", 5, 0), ("FLA=0", 5, 0), ("BLA=0", -5, 0)],
)
def test_begin_looks_at_the_soft_limits(soft: str, way: int, code: int) -> None:
    bench = Bench()
    bench.do(soft, f"PRA={way}")
    if code:
        assert bench.code("BGA") == code
    else:
        bench.do("BGA")


@pytest.mark.parametrize(("disabled", "forward", "reverse"), [(0, 22, 22), (1, 0, 22), (2, 22, 0), (3, 0, 0)])
def test_ld_disables_switches_by_their_side(disabled: int, forward: int, reverse: int) -> None:
    for way, code in ((9, forward), (-9, reverse)):
        bench = Bench()
        bench.switch(0, forward=False, reverse=False)
        bench.do(f"LDA={disabled}", f"PRA={way}")
        assert (bench.code("BGA") if code else bench.say("BGA")) == (code or ":")
