"""Commands of a coordinate system, as far as `test_machine_sequences` does not run them."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("setup", "ask", "printed"),
    [
        ("", "CA ?", " 0"),
        ("CA T", "CA ?", " 1"),
        ("CA T", "MG _CA", " 1.0000"),
        ("CA T;CA S", "CA ?", " 0"),
        ("LM AB", "LM ?", " 511"),
        ("LM AB;LI 100,100;LI 5", "LM ?", " 509"),
        ("LM AB;LI 3000,4000", "LE ?", " 5000"),
        ("LM AB;LI 3000,4000", "VE ?", " 5000"),
        ("LM AB;LI 3000,4000;LE", "MG _LES,_VES,_LET", " 5000.0000 5000.0000 0.0000"),
        ("LM AB;LI 3000,4000", "MG _LMS,_LMT", " 510.0000 511.0000"),
        ("LM AB;LI 3000;CS", "LM ?", " 511"),
        ("LM AB;LI 3000;CS S", "LE ?", " 0"),
        ("LM AB;LI 3000;CS T", "LE ?", " 3000"),
        ("LM AB;LI 3000;LM AB", "LM ?", " 511"),
        ("LM AB;LI A=3000", "LE ?", " 3000"),
        ("LM AB;LI *=3000", None, ""),
        ("VV 501", "VV ?", " 500"),
    ],
)
def test_set_values_are_printed(setup: str, ask: str | None, printed: str) -> None:
    bench = Bench()
    if ask is None:
        assert bench.say(setup).endswith("?")
        return
    bench.do(*[setup] * bool(setup))
    assert bench.say(ask) == f"{printed}\r\n:"


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("CA U", ErrorCode.S_OPERAND_INVALID),
        ("CA ST", ErrorCode.S_OPERAND_INVALID),
        ("CA", ErrorCode.S_OPERAND_INVALID),
        ("LM D", ErrorCode.INVALID_AXIS),
        ("LM S", ErrorCode.S_OPERAND_INVALID),
        ("LI 1,2", ErrorCode.NO_SEQUENCE),
        ("CS A", ErrorCode.INVALID_AXIS),
        ("BGS", ErrorCode.NO_SEQUENCE),
        ("BGT", ErrorCode.NO_SEQUENCE),
        ("VSS=1", ErrorCode.OUT_OF_RANGE),
        ("VS 15000001", ErrorCode.OUT_OF_RANGE),
        ("VV -2", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


@pytest.mark.parametrize(
    ("segment", "code"),
    [
        ("LI 8388607,-8388607", None),
        ("LI 8388608", ErrorCode.OUT_OF_RANGE),
        ("LI ,-8388608", ErrorCode.OUT_OF_RANGE),
        ("LI 5<2", None),
        ("LI 5<1", ErrorCode.OUT_OF_RANGE),
        ("LI 5<-1", None),
        ("LI 5<-2", ErrorCode.OUT_OF_RANGE),
        ("LI 5<15000000>0", None),
        ("LI 5<15000001", ErrorCode.OUT_OF_RANGE),
        ("LI 5>100", None),
        ("LI 5>-1", ErrorCode.OUT_OF_RANGE),
        ("LI 5<100<200", ErrorCode.OPERAND_ERROR),
        ("LI 5>100<200", ErrorCode.OPERAND_ERROR),
        ("LI", ErrorCode.SEGMENT_TOO_SHORT),
        ("LI 0,0", ErrorCode.SEGMENT_TOO_SHORT),
        ("LI ,,5", ErrorCode.OPERAND_ERROR),
        ("LI 1,2,3,4", ErrorCode.OPERAND_ERROR),
        ("LI ?", ErrorCode.QUESTION_MARK_INVALID),
        ("LI v", ErrorCode.VARIABLE_ERROR),
    ],
)
def test_valid_segments(segment: str, code: ErrorCode | None) -> None:
    bench = Bench()
    bench.do("LM AB")
    if code is None:
        bench.do(segment)
    else:
        assert bench.code(segment) == code
    assert bench.value("_LMS") == (510.0 if code is None else 511.0)


def test_a_sequence_has_two_billion_counts_at_most() -> None:
    bench = Bench()
    bench.do("LM A", *["LI 8388607"] * 256)
    assert bench.code("LI 8388607") == ErrorCode.SEQUENCE_TOO_LONG
    assert bench.value("_LES") == 256 * 8_388_607


def test_segments_take_expressions() -> None:
    bench = Bench()
    bench.do("v=500", "LM AB", "LI v*2,(v+1)<v*4>v", "LE", "BGS")
    assert bench.at(9.0).positions() == [1000, 501, 0]


def test_each_plane_has_its_own_buffer_and_rates() -> None:
    bench = Bench()
    bench.do("VS 1000,2000", "LM A;LI 5000;LE", "CA T;LM B;LI ,5000;LE", "BGST")
    bench.at(1.0)
    assert (bench.value("_VMS"), bench.value("_VMT")) == (1000.0, 2000.0)
    assert bench.record().t.moving
    bench.do("STT")
    assert bench.say("SC") == " 100, 4, 1\r\n:"
    assert bench.at(9.0).positions()[0] == 5000


def test_one_axis_cannot_serve_two_planes() -> None:
    bench = Bench()
    bench.do("LM AB;LI 50000,50000;LE", "CA T;LM BC;LI ,5,5;LE", "BGS")
    assert bench.code("BGT") == ErrorCode.BEGIN_WHILE_RUNNING


def test_clearing_waits_for_the_end_of_the_sequence() -> None:
    bench = Bench()
    bench.do("LM AB;LI 50000,50000;LE", "BGS")
    assert bench.code("CS") == ErrorCode.NOT_WHILE_RUNNING
    assert bench.code("LM A") == ErrorCode.NOT_WHILE_RUNNING
    bench.do("CS T", "LM AB")
    bench.at(9.0).do("CS", "LM A")


def test_a_rate_may_change_on_one_plane_while_the_other_runs() -> None:
    bench = Bench()
    bench.do("LM AB;LI 50000,50000;LE", "BGS")
    assert bench.code("VDS=2048") == ErrorCode.NOT_WHILE_RUNNING
    assert bench.code("VD 2048,2048") == ErrorCode.NOT_WHILE_RUNNING
    bench.do("VDT=2048", "VAS=2048", "VSS=4000")
    assert (bench.value("_VDS"), bench.value("_VDT")) == (256_000.0, 2_048.0)
