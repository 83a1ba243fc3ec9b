"""Statements of a program: jumps, subroutines, conditions, assignments, and refused ones."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.program_bench import ProgramBench


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("MG 1;MG 2\nMG 3", ["1.0000", "2.0000", "3.0000"]),
        ("#A\nJP #B\nMG 1\n#B\nMG 2\nEN\nMG 3", ["2.0000"]),
        ("n=0\n#L;n=n+1;JP #L,n<4\nMG n", ["4.0000"]),
        ("n=0\n#L;n=n+1;JP #L,((n<4)&(n<>2))\nMG n", ["2.0000"]),
        ("i=1;JP #S+i\n#S\nMG 0\nMG 1", ["0.0000", "1.0000"]),
        ("n=3;JP n\nMG 1\nMG 2\nMG 3", ["3.0000"]),
        ("JP n+1\nMG 1", ["?0 JP n+1"]),
        ("JS #S;MG 2;EN\n#S;MG 1;EN", ["1.0000", "2.0000"]),
        ("JS #S,1=0;MG 2;EN\n#S;MG 1;EN", ["2.0000"]),
        ("v=7;JS #S(1,v+1,&v);MG v,_JS;EN\n#S;MG ^a,^b,^c;^c=^a+^b;EN ,,5", ["1.0000 8.0000 7.0000", "9.0000 5.0000"]),
        ("JS #S(3);MG _JS;EN\n#S;JP #E,^a=0;n=^a;JS #S(^a-1);EN ,,_JS+^a\n#E;EN ,,0", ["6.0000"]),
        ('DM a[2];a[1]=5;JS #S("a",1);EN\n#S;MG ^a[^b];^a[0]=6;MG a[0];EN', ["5.0000", "6.0000"]),
        ("n=2;JS n;EN\nMG 1\nMG 2;EN", ["2.0000"]),
        ("IF 1;MG 1;ENDIF;MG 2", ["1.0000", "2.0000"]),
        ("IF (0);MG 1;ENDIF;MG 2", ["2.0000"]),
        ("IF (0)\nMG 1\nELSE\nMG 2\nENDIF\nMG 3", ["2.0000", "3.0000"]),
        ("IF (1)\nMG 1\nELSE\nMG 2\nENDIF\nMG 3", ["1.0000", "3.0000"]),
        ("IF (1);IF (0);MG 1;ELSE;MG 2;ENDIF;ELSE;MG 3;ENDIF;MG 4", ["2.0000", "4.0000"]),
        ("IF (0);IF (0);MG 1;ELSE;MG 2;ENDIF;ELSE;MG 3;ENDIF;MG 4", ["3.0000", "4.0000"]),
        ("n=1;IF ((n=1)&(_BGA=0));MG n;ENDIF", ["1.0000"]),
        ("MG 1;'MG 2\nNO MG 3;MG 4", ["1.0000", "4.0000"]),
        ("n=3;n=;n=?", ["3.0000", "3.0000"]),
        ("DP 5;TPA;RP A;TC", ["5", "5", "0"]),
        ("XQ #B,2;MG _ED4;EN\n#B;MG _ED4", ["0.0000", "2.0000"]),
        ('MG "a;b";MG "it\'s"', ["a;b", "it's"]),
        ("JS #S;EN\n#S;MG _ZS0;JS #T;EN\n#T;MG _ZS0;ZS 1;MG _ZS0;EN\nEN", ["1.0000", "2.0000", "1.0000"]),
        ("JS #S;MG 1;EN\n#S;ZS;MG 2;EN", ["2.0000"]),
    ],
)
def test_program_messages(program: str, said: list[str]) -> None:
    assert ProgramBench().run(1.0, program) == said


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("JP #NOPE", ErrorCode.UNDEFINED_LABEL),
        ("JP 99", ErrorCode.INVALID_LABEL),
        ("JP -1", ErrorCode.INVALID_LABEL),
        ("JP #A,1,2", ErrorCode.OPERAND_ERROR),
        ("JP #A,(1", ErrorCode.PARENTHESES),
        ("JS #NOPE", ErrorCode.UNDEFINED_LABEL),
        ("JS #A(&nope)", ErrorCode.VARIABLE_ERROR),
        ("JS #A(1,2,3,4,5,6,7,8,9)", ErrorCode.OPERAND_ERROR),
        ("IF (1)", ErrorCode.IF_WITHOUT_ENDIF),
        ("IF (0);ELSE", ErrorCode.IF_WITHOUT_ENDIF),
        ("ELSE", ErrorCode.IF_WITHOUT_ENDIF),
        ("IF nope;ENDIF", ErrorCode.VARIABLE_ERROR),
        ("v=nope", ErrorCode.VARIABLE_ERROR),
        ("RE", ErrorCode.NOT_WHILE_NOT_RUNNING),
        ("RI", ErrorCode.NOT_WHILE_NOT_RUNNING),
        ("ZS 2", ErrorCode.OUT_OF_RANGE),
        ("EN 1,2,3,4", ErrorCode.OPERAND_ERROR),
        ("XQ #A,0", ErrorCode.THREAD_EXECUTING),
        ("CF I", ErrorCode.NOT_IN_PROGRAM),
        ("DL", ErrorCode.NOT_IN_PROGRAM),
        ("ED", ErrorCode.NOT_IN_PROGRAM),
        ("UL", ErrorCode.NOT_IN_PROGRAM),
        ("LS", ErrorCode.NOT_IN_PROGRAM),
        ("RS", ErrorCode.NOT_IN_PROGRAM),
        ("BK", ErrorCode.NOT_IN_PROGRAM),
        ("SL", ErrorCode.NOT_IN_PROGRAM),
        ("QD a[]", ErrorCode.NOT_IN_PROGRAM),
        ("WH", ErrorCode.NOT_IN_PROGRAM),
        ("WT", ErrorCode.NO_TIME),
        ("WT -2", ErrorCode.OUT_OF_RANGE),
        ("AI 99", ErrorCode.OUT_OF_RANGE),
        ("AP 1,2", ErrorCode.OPERAND_ERROR),
        ("AMD", ErrorCode.INVALID_AXIS),
        ("nonsense!", ErrorCode.UNRECOGNIZED_COMMAND),
        ("bg", ErrorCode.UNRECOGNIZED_COMMAND),
    ],
)
def test_error_ends_the_thread_and_is_printed(statement: str, code: ErrorCode) -> None:
    bench = ProgramBench()
    assert bench.run(0.5, f"#A\n'a line\n{statement}\nMG 1") == [f"?2 {statement.split(';', maxsplit=1)[0]}"]
    assert bench.place() == -1
    assert (bench.value("_ED0"), bench.value("_ED1")) == (2.0, 0.0)
    assert bench.say("TC") == f" {int(code)}\r\n:"


def test_subroutines_nest_sixteen_deep() -> None:
    bench = ProgramBench()
    assert bench.run(1.0, "n=0;JS #S;EN\n#S;n=n+1;JS #S;EN") == ["?1 JS #S"]
    assert bench.value("n") == 16.0
    assert bench.value("_TC") == ErrorCode.TOO_DEEP


@pytest.mark.parametrize("command", ["AD 1", "AI 1", "AM", "EN", "ELSE", "ENDIF", "IF 1", "JP #A", "JS #A", "RE", "ZS"])
def test_statements_of_programs_are_not_for_hosts(command: str) -> None:
    assert ProgramBench("#A;EN").code(command) == ErrorCode.PROGRAM_ONLY


def test_a_program_that_runs_past_its_end_ends() -> None:
    bench = ProgramBench()
    assert bench.run(0.1, "MG 1") == ["1.0000"]
    assert bench.place() == -1
    assert bench.value("_TC") == 0.0


def test_stack_variables_are_those_of_the_subroutine() -> None:
    program = "JS #S(1);EN\n#S;JS #T(2);MG ^a;EN\n#T;MG ^a;^a=9;EN"
    assert ProgramBench().run(0.1, program) == ["2.0000", "1.0000"]


def test_the_value_returned_is_read_from_a_program_only() -> None:
    assert ProgramBench().code("MG _JS") == ErrorCode.BAD_OPERAND


TREES = st.recursive(
    st.integers(1, 99).map(lambda number: ("say", number, None, None)),
    lambda inner: st.tuples(st.just("if"), st.booleans(), st.lists(inner, max_size=3), st.none() | st.lists(inner)),
    max_leaves=12,
)


def written(tree: tuple) -> list[str]:
    kind, value, true, false = tree
    if kind == "say":
        return [f"MG {value}{{Z2.0}}"]
    lines = [f"IF ({int(value)})", *(line for part in true for line in written(part))]
    if false is not None:
        lines += ["ELSE", *(line for part in false for line in written(part))]
    return [*lines, "ENDIF"]


def meant(tree: tuple) -> list[str]:
    kind, value, true, false = tree
    if kind == "say":
        return [str(value)]
    return [text for part in (true if value else false or []) for text in meant(part)]


@given(st.lists(TREES, max_size=4), st.sampled_from([";", "\n"]))
def test_conditions_nest_as_they_are_written(trees: list[tuple], between: str) -> None:
    program = between.join(line for tree in trees for line in written(tree)) if trees else ""
    if between == ";":
        program = "\n".join(line for line in _folded(program))
    bench = ProgramBench()
    assert bench.run(2.0, f"{program}\nEN") == [text for tree in trees for text in meant(tree)]


def _folded(program: str) -> list[str]:
    lines = [""]
    for part in program.split(";"):
        if len(lines[-1]) + len(part) > 70:
            lines.append("")
        lines[-1] += f"{part};"
    return lines


@given(st.lists(st.integers(-9, 9), min_size=1, max_size=8))
def test_loop_computes_its_result(numbers: list[int]) -> None:
    bench = ProgramBench()
    bench.do(f"DM a[{len(numbers)}]", *(f"a[{index}]={number}" for index, number in enumerate(numbers)))
    bench.run(1.0, "s=0;i=0\n#L;IF (a[i]>0);s=s+a[i];ELSE;s=s-1;ENDIF\ni=i+1;JP #L,i<a[-1]\nEN")
    assert bench.value("s") == sum(number if number > 0 else -1 for number in numbers)
