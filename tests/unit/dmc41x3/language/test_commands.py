from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import (
    ASSIGN,
    QUERY,
    SKIPPED,
    TOO_LONG,
    Command,
    Expression,
    InvalidCommand,
    parse,
    split_line,
)


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ("", Command("")),
        ("LE", Command("LE")),
        ("BGAB", Command("BG", "AB")),
        ("ST S", Command("ST", "S")),
        ("STS", Command("ST", "S")),
        ("TPXYZW", Command("TP", "ABCD")),
        ("BG~a", Command("BG", "~a")),
        ("PA 1,2,3", Command("PA", args=(1, 2, 3))),
        ("PA1,,3", Command("PA", args=(1, SKIPPED, 3))),
        ("PA ,2", Command("PA", args=(SKIPPED, 2))),
        ("PA 1,,", Command("PA", args=(1, SKIPPED, SKIPPED))),
        ("PA ?,?,?", Command("PA", args=(QUERY, QUERY, QUERY))),
        ("PAB=1000", Command("PA", "B", (1000,))),
        ("PA X = -5", Command("PA", "A", (-5,))),
        ("SPB=?", Command("SP", "B", (QUERY,))),
        ("JG*=1000", Command("JG", "*", (1000,))),
        ("PAA=target", Command("PA", "A", (Expression("target"),))),
        ("SP speed[0],f(1,2)", Command("SP", args=(Expression("speed[0]"), Expression("f(1,2)")))),
        ("PVA=100,2000,256", Command("PV", "A", (100, 2000, 256))),
        ("VSS=2000", Command("VS", "S", (2000,))),
        ("VA 5120", Command("VA", args=(5120,))),
        ("TL 9.9982", Command("TL", args=(9.9982,))),
        ("CA S", Command("CA", "S")),
        ("LI 1,-2,3", Command("LI", args=(1, -2, 3))),
        ("LI 1000,2000<4000>0", Command("LI", args=(1000, 2000), speed=4000, end_speed=0)),
        ("LI ,5 >200", Command("LI", args=(SKIPPED, 5), end_speed=200)),
        ("VP 1,2 <vs", Command("VP", args=(1, 2), speed=Expression("vs"))),
        ("IA <250", Command("IA", speed=250)),
        ("CN -1,-1,-1,0,0", Command("CN", args=(-1, -1, -1, 0, 0))),
        ("TC1", Command("TC", args=(1,))),
        ("TC ?", Command("TC", args=(QUERY,))),
        ("SB$1", Command("SB", args=(Expression("$1"),))),
        ("CD 0=0", Command("CD", args=(Expression("0=0"),))),
        ('MG "a;b,c",_TPA', Command("MG", text='"a;b,c",_TPA')),
        ("MG_TPA", Command("MG", text="_TPA")),
        ("IHT=>-3", Command("IH", text="T=>-3")),
        ("XQ #AUTO,0", Command("XQ", text="#AUTO,0")),
        ("NO hello", Command("NO", text="hello")),
        ("' hello", Command("NO", text="hello")),
        ("ENDIF", Command("ENDIF")),
        ("x=5", Command(ASSIGN, text="x", args=(5,))),
        ("x = ?", Command(ASSIGN, text="x", args=(QUERY,))),
        ("x=", Command(ASSIGN, text="x", args=(QUERY,))),
        ("a[0]=9", Command(ASSIGN, text="a[0]", args=(9,))),
        ("a[b[1]]=c[2]", Command(ASSIGN, text="a[b[1]]", args=(Expression("c[2]"),))),
        ("y=x+(1,2)", Command(ASSIGN, text="y", args=(Expression("x+(1,2)"),))),
        ("SPEED=5", Command(ASSIGN, text="SPEED", args=(5,))),
        ("CD0=0", Command(ASSIGN, text="CD0", args=(0,))),
        ("\x12\x16", Command("^R^V")),
    ],
)
def test_command_text(text: str, command: Command) -> None:
    assert parse(text) == command
    assert parse(command.format()) == command


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("bg", ErrorCode.UNRECOGNIZED_COMMAND),
        ("GF32", ErrorCode.UNRECOGNIZED_COMMAND),
        ("x", ErrorCode.UNRECOGNIZED_COMMAND),
        ("?", ErrorCode.UNRECOGNIZED_COMMAND),
        ("x==5", ErrorCode.UNRECOGNIZED_COMMAND),
        ("AB=5", ErrorCode.OPERAND_ERROR),
        ("PAB=", ErrorCode.NOT_ENOUGH_FIELDS),
        ("LI 1<>0", ErrorCode.OPERAND_ERROR),
        ("LI 1>2<3", ErrorCode.OPERAND_ERROR),
        ("LI 1< >0", ErrorCode.OPERAND_ERROR),
        (TOO_LONG, ErrorCode.INPUT_BUFFER_FULL),
    ],
)
def test_invalid_command_has_a_code(text: str, code: ErrorCode) -> None:
    with pytest.raises(InvalidCommand) as caught:
        parse(text)
    assert caught.value.code is code


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Command("ST", "S"), "STS"),
        (Command("PA", args=(1, SKIPPED, 3)), "PA 1,,3"),
        (Command("LI", args=(1, 2, 3), speed=4000, end_speed=0), "LI 1,2,3<4000>0"),
        (Command("OF", "A", (1e-05,)), "OFA=0.00001"),
        (Command("^R^V"), "\x12\x16"),
        (Command(ASSIGN, text="x", args=(QUERY,)), "x=?"),
    ],
)
def test_the_text_of_a_command(command: Command, text: str) -> None:
    assert command.format() == text


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_a_number_that_cannot_be_written_is_never_sent(value: float) -> None:
    with pytest.raises(ValueError, match="no way to write"):
        Command("PA", args=(value,)).format()


def test_a_lone_argument_left_out_is_refused() -> None:
    with pytest.raises(ValueError, match="no argument"):
        Command("PA", args=(SKIPPED,))


def test_a_float_too_large_or_small_for_plain_digits_has_no_exponent() -> None:
    assert Command("PA", args=(1e-7, 1e17)).format() == "PA 0.0000001,100000000000000000"


@pytest.mark.parametrize(
    ("line", "commands"),
    [
        ("A;B", ["A", "B"]),
        ("TP;", ["TP", ""]),
        ("", [""]),
        (" SH A ; BG A", ["SH A", "BG A"]),
        ("TP;' a comment; all of it", ["TP", "' a comment; all of it"]),
    ],
)
def test_a_line_splits_into_commands(line: str, commands: list[str]) -> None:
    assert split_line(line) == commands
