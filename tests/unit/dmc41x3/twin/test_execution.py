"""Assignments, and the variables `~a` that stand for axes."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import CallerContext, OperandScope
from dmc41x3.twin.execution import assignment, execute
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.program import Thread
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("x=5", ("x", "5")),
        ("x = 5", ("x", "5")),
        ("x=", ("x", "")),
        ("x=?", ("x", "?")),
        ("x=y=2", ("x", "y=2")),
        ("a[0]=1", ("a[0]", "1")),
        ("a[b[0]+1] = c[2]", ("a[b[0]+1]", "c[2]")),
        ("a[b[0]=1]=2", ("a[b[0]=1]", "2")),
        ("~a=2", ("~a", "2")),
        ("^h=v", ("^h", "v")),
        ("^a[3]=v", ("^a[3]", "v")),
        ("x==5", None),
        ("a[0]==5", None),
        ("a[0]", None),
        ("x", None),
        ("1x=5", None),
        ("~i=1", None),
        ("x+1=2", None),
        ("", None),
    ],
)
def test_the_two_sides_of_an_assignment(text: str, parts: tuple[str, str] | None) -> None:
    assert assignment(text) == parts


@pytest.mark.parametrize("name", ["CD0", "SPEED", "PAx", "TPAB", "BGx1"])
def test_a_name_that_begins_like_a_command(name: str) -> None:
    bench = Bench()
    bench.do(f"{name}=5")
    assert bench.machine.unit.variables[name] == 5 * 65536


def test_an_axis_behind_the_two_letters_makes_it_a_command() -> None:
    bench = Bench()
    bench.do("SPA=5000", "SP*=6000", "DPX=1")
    assert bench.code("AC=5") == ErrorCode.OPERAND_ERROR
    assert bench.machine.unit.variables == {}


def test_conditions_are_values() -> None:
    bench = Bench()
    bench.do("x=5", "y=x>4", "z=(x=5)&(y=1)", "w=x=4")
    assert [bench.value(name) for name in "yzw"] == [1, 1, 0]


def test_strings_are_values() -> None:
    bench = Bench()
    bench.do('s="abc"', 't=s="abc"', 'u=s<>"abd"')
    assert bench.say("MG s{S3},t,u") == "abc 1.0000 1.0000\r\n:"


@pytest.mark.parametrize(
    ("value", "number"),
    [("0", 0), ("2.9", 2), ('"C"', 2), ('"X"', 0), ('"S"', 8), ('"T"', 9), ('"N"', 10), ('"M"', 11), ("11", 11)],
)
def test_values_of_an_axis_variable(value: str, number: int) -> None:
    bench = Bench()
    bench.do(f"~h={value}")
    assert bench.value("~h") == number
    assert bench.say("~h=?") == f" {number}.0000\r\n:"


@pytest.mark.parametrize("value", ["12", "-1", '"Q"', '"AB"', "12.5"])
def test_invalid_axis_variables(value: str) -> None:
    bench = Bench()
    assert bench.code(f"~a={value}") == ErrorCode.OUT_OF_RANGE


def test_axis_variables_name_axes() -> None:
    bench = Bench()
    bench.do("~a=1;~b=2", "PR~a=100;SP ~b,~a*1000", "DP~b=40", "BG~a")
    assert bench.axis(0).registers["SP"] == 2
    assert bench.axis(1).registers["SP"] == 1000
    assert bench.axis(1).moving
    bench.at(5.0)
    assert bench.say("TP~a~b") == " 100, 40\r\n:"
    assert bench.say("TP A~b") == " 0, 40\r\n:"
    assert bench.value("_TP~a+_TP~b") == 140
    assert bench.say("SP~a=?") == " 1000\r\n:"


def test_axis_variables_name_planes() -> None:
    bench = Bench()
    bench.do("~c=8", "CAS;LMAB;LI100,0;LE", "BG~c")
    assert bench.value("_BGS") == 1
    assert bench.value("_BG~c") == 1
    bench.do("ST~c")


def test_an_axis_variable_never_set() -> None:
    bench = Bench()
    for command in ("MG ~a", "BG~a", "PR~a=1", "MG _TP~a"):
        assert bench.code(command) == ErrorCode.VARIABLE_ERROR


def test_an_axis_variable_for_an_axis_that_is_not_there() -> None:
    bench = Bench()
    bench.do("~a=7")
    assert bench.code("BG~a") == ErrorCode.INVALID_AXIS
    assert bench.code("PR~a=1") == ErrorCode.INVALID_AXIS
    assert bench.code("MG _TP~a") == ErrorCode.BAD_OPERAND


def test_a_reset_forgets_axis_variables() -> None:
    bench = Bench()
    bench.do("~a=1")
    bench.raw("RS\r")
    bench.handle = bench.connect()
    assert bench.code("MG ~a") == ErrorCode.VARIABLE_ERROR


class Program:
    """Executes statements as a program's thread does."""

    def __init__(self) -> None:
        self.bench = Bench()
        self.thread = Thread(0, running=True)
        unit = self.bench.machine.unit
        self.context = CallerContext(unit, OperandScope(unit, thread=self.thread), thread=self.thread)

    def do(self, text: str) -> None:
        assert execute(self.context, text) is None

    def code(self, text: str) -> ErrorCode:
        with pytest.raises(Rejection) as refused:
            execute(self.context, text)
        return refused.value.code


def test_stack_variables_live_in_a_thread() -> None:
    program = Program()
    program.do("^a=5")
    program.do("x=^a*2")
    assert program.thread.locals == {"a": 5 * 65536}
    assert program.bench.value("x") == 10
    assert program.code("x=^b") is ErrorCode.VARIABLE_ERROR
    assert program.bench.code("MG ^a") == ErrorCode.PROGRAM_ONLY
    assert program.bench.code("^a=1") == ErrorCode.PROGRAM_ONLY


def test_a_stack_variable_can_be_an_array() -> None:
    program = Program()
    program.bench.do("DM list[4]", "list[2]=6")
    program.do('^a="list"')
    program.do("^a[3]=^a[2]+^a[-1]")
    assert program.bench.value("list[3]") == 10
    assert program.code("^a[4]=1") is ErrorCode.INDEX_OUT_OF_RANGE
    program.do('^a="nope"')
    assert program.code("^a[0]=1") is ErrorCode.UNDEFINED_ARRAY


def test_a_program_takes_no_arrays_from_the_wire() -> None:
    program = Program()
    program.bench.do("DM a[3]")
    assert program.code("QD a[]") is ErrorCode.NOT_IN_PROGRAM
    assert execute(program.context, "QU a[],0,0") == b" 0.0000\r\n\x1a"


def test_there_is_an_end_to_variables() -> None:
    bench = Bench()
    for number in range(510):
        bench.do(f"v{number}=1")
    assert bench.value("_UL") == 0
    assert bench.code("more=1") == ErrorCode.TOO_MANY_VARIABLES
    bench.do("v0=2", "DA v1", "more=1")
