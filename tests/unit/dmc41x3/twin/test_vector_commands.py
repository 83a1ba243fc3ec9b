"""Commands of vector sequences, as far as `test_vector_sequences` does not run them."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("setup", "ask", "printed"),
    [
        ("VM AB", "LM ?", " 511"),
        ("VM AB;VP 3,4", "LM ?", " 510"),
        ("VM AB;VP 3000,4000", "VE ?", " 5000"),
        ("VM AB;VP 3000,4000", "MG _LES,_VES,_VET", " 5000.0000 5000.0000 0.0000"),
        ("VM AB;VP 3000,4000;CS S", "VE ?", " 0"),
        ("VM AB;VP 3000,4000;VM AB", "VE ?", " 0"),
        ("VM AB;CR 100,0,360", "MG _VES", " 628.3185"),
        ("VM AB;VP 3000,4000;VP 3000,4001", "MG _VES", " 5001.0000"),
        ("", "TN ?,?", " 0.0000, 0.0000"),
        ("TN 2000/360,-500", "TN ?,?", " 5.5555, -500.0000"),
        ("TN 4,7;TN ,9", "TN ?,?", " 4.0000, 9.0000"),
        ("TN 2,7", "MG _TNS", " 7.0000"),
        ("TN 2,7;VM ABC;VP 0,5", "MG _TNS,_TNT", " 187.0000 0.0000"),
        ("CA T;TN 2,7;CA S", "MG _TNS,_TNT", " 0.0000 7.0000"),
    ],
)
def test_set_values_are_printed(setup: str, ask: str, printed: str) -> None:
    bench = Bench()
    bench.do(*[setup] * bool(setup))
    assert bench.say(ask) == f"{printed}\r\n:"


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("VM", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VM A", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VM AA", ErrorCode.OPERAND_ERROR),
        ("VM ABA", ErrorCode.OPERAND_ERROR),
        ("VM ABCD", ErrorCode.OPERAND_ERROR),
        ("VM AD", ErrorCode.INVALID_AXIS),
        ("VM S", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VM ST", ErrorCode.S_OPERAND_INVALID),
        ("VM AS", ErrorCode.S_OPERAND_INVALID),
        ("VM ?", ErrorCode.QUESTION_MARK_INVALID),
        ("VM A,B", ErrorCode.OPERAND_ERROR),
        ("VP 1,2", ErrorCode.NO_SEQUENCE),
        ("CR 100,0,90", ErrorCode.NO_SEQUENCE),
        ("LM AB;VP 1,2", ErrorCode.SEGMENT_KINDS_MIXED),
        ("LM AB;CR 100,0,90", ErrorCode.SEGMENT_KINDS_MIXED),
        ("VM AB;LI 1,2", ErrorCode.SEGMENT_KINDS_MIXED),
        ("VM AB;BGS", ErrorCode.NO_SEQUENCE),
        ("VM AB;BGT", ErrorCode.NO_SEQUENCE),
        ("TN 128", ErrorCode.OUT_OF_RANGE),
        ("TN 1,2,3", ErrorCode.OPERAND_ERROR),
        ("ES 0,1", ErrorCode.OUT_OF_RANGE),
        ("ES 1,65536", ErrorCode.OUT_OF_RANGE),
        ("ES 1", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VM AB;MG _VPS", ErrorCode.BAD_OPERAND),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    bench = Bench()
    *before, last = command.split(";")
    bench.do(*before)
    assert bench.code(last) == code


@pytest.mark.parametrize(
    ("segment", "code"),
    [
        ("VP 8388607,0", None),
        ("VP 8388608,0", ErrorCode.OUT_OF_RANGE),
        ("VP 6000000,6000000", ErrorCode.OUT_OF_RANGE),
        ("VP 0,0", ErrorCode.SEGMENT_TOO_SHORT),
        ("VP 1", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VP", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VP ,1", ErrorCode.NOT_ENOUGH_FIELDS),
        ("VP 1,2,3", ErrorCode.OPERAND_ERROR),
        ("VP ?,1", ErrorCode.QUESTION_MARK_INVALID),
        ("VP 5,5<100>50", None),
        ("VP 5,5<-1", None),
        ("VP 5,5<1", ErrorCode.OUT_OF_RANGE),
        ("VP 5,5>50<100", ErrorCode.OPERAND_ERROR),
        ("VP v,1", ErrorCode.VARIABLE_ERROR),
        ("CR 10,0,90", None),
        ("CR 9.99,0,90", ErrorCode.OUT_OF_RANGE),
        ("CR 6000000,0,74.99", None),
        ("CR 6000000,0,75", ErrorCode.OUT_OF_RANGE),
        ("CR 6000001,0,1", ErrorCode.OUT_OF_RANGE),
        ("CR 100,32000,-32000", None),
        ("CR 100,32001,1", ErrorCode.OUT_OF_RANGE),
        ("CR 100,0,-32001", ErrorCode.OUT_OF_RANGE),
        ("CR 100,0,0", ErrorCode.SEGMENT_TOO_SHORT),
        ("CR 100,0", ErrorCode.NOT_ENOUGH_FIELDS),
        ("CR 100,0,90,5", ErrorCode.OPERAND_ERROR),
        ("CR 100,0,?", ErrorCode.QUESTION_MARK_INVALID),
        ("CR 100,0,90<5000>0", None),
    ],
)
def test_valid_segments(segment: str, code: ErrorCode | None) -> None:
    bench = Bench()
    bench.do("VM AB")
    if code is None:
        bench.do(segment)
    else:
        assert bench.code(segment) == code
    assert bench.value("_LMS") == (510.0 if code is None else 511.0)


def test_a_closed_circle_leaves_no_way_back_to_its_start() -> None:
    bench = Bench()
    bench.do("VM AB", "CR 1000,0,360")
    assert bench.code("VP 0,0") == ErrorCode.SEGMENT_TOO_SHORT


def test_vp_counts_from_the_end_of_the_arc() -> None:
    bench = Bench()
    bench.do("VM AB", "CR 1000,0,90", "VP -1000,8389607")
    assert bench.code("VP -1000,16778215") == ErrorCode.OUT_OF_RANGE


def test_buffer_holds_511_segments_of_any_kind() -> None:
    bench = Bench()
    bench.do("VM AB", *["CR 1000,0,300"] * 511)
    assert bench.code("VP 1,1") == ErrorCode.SEGMENT_BUFFER_FULL


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("VM AB", ErrorCode.NOT_WHILE_RUNNING),
        ("VM BC", ErrorCode.NOT_WHILE_RUNNING),
        ("LM AB", ErrorCode.NOT_WHILE_RUNNING),
        ("ES 1,2", ErrorCode.NOT_WHILE_RUNNING),
        ("CS", ErrorCode.NOT_WHILE_RUNNING),
        ("VD 2048", ErrorCode.NOT_WHILE_RUNNING),
        ("LI 1,1", ErrorCode.SEGMENT_KINDS_MIXED),
        ("BGS", ErrorCode.BEGIN_WHILE_RUNNING),
        ("BTA", ErrorCode.BEGIN_WHILE_RUNNING),
        ("CM AC", ErrorCode.NOT_IN_COORDINATED_MOVE),
    ],
)
def test_running_sequence_refuses_commands(command: str, code: ErrorCode) -> None:
    bench = Bench()
    bench.do("PVA=5,0,2", "VM AB", "VP 50000,0", "BGS")
    assert bench.at(0.5).code(command) == code


@pytest.mark.parametrize("command", ["VP 60000,0", "CR 100,0,90", "TN 5", "VS 500", "VA 2048", "VR 0.5", "VE", "CM C"])
def test_running_sequence_accepts_commands(command: str) -> None:
    bench = Bench()
    bench.do("VM AB", "VP 50000,0", "BGS")
    bench.at(0.5).do(command)


def test_both_planes_run_side_by_side_on_axes_of_their_own() -> None:
    bench = Bench(axes=4)
    bench.do("VM AB;VP 3000,4000;VE", "CA T;VM CD;CR 1000,0,90;VE", "BGST")
    assert bench.say("SC") == " 100, 100, 100, 100\r\n:"
    assert bench.record().t.moving
    bench.at(9.0)
    assert bench.positions() == [3000, 4000, -1000, 1000]


def test_begin_needs_a_ready_axis_in_the_direction_of_an_arc() -> None:
    bench = Bench()
    bench.do("VM AB", "CR 1000,0,90", "VE")
    bench.switch(0, reverse=False)
    assert bench.code("BGS") == ErrorCode.BEGIN_AT_LIMIT
    bench.switch(0, forward=False)
    bench.do("BGS")
