"""Commands of the controller itself: outputs, formats, ports, burning, reset, programs it has none of."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("commands", "bank"),
    [
        ("SB 1;SB 8", 0b1000_0001),
        ("OP 255;CB 3", 0b1111_1011),
        ("OP 5", 0b0000_0101),
        ("OP 255;OP 0", 0),
        ("OB 2,1;OB 3,0", 0b0000_0010),
        ("OB 4,-7", 0b0000_1000),
        ("OP 255;OB 1,0", 0b1111_1110),
        ("v=5;OB v,v>4", 0b0001_0000),
        ("SB 1+1", 0b0000_0010),
    ],
)
def test_outputs(commands: str, bank: int) -> None:
    bench = Bench()
    bench.do(commands)
    assert bench.value("_OP0") == bank
    assert bench.record().outputs[0] == bank
    assert [bench.value(f"@OUT[{bit}]") for bit in (1, 8)] == [bank & 1, bank >> 7]


def test_controllers_with_more_than_four_axes_have_two_banks() -> None:
    bench = Bench(axes=5)
    bench.do("OP 3,129", "SB 10")
    assert (bench.value("_OP0"), bench.value("_OP1")) == (3.0, 131.0)
    bench.do("OP ,1")
    assert (bench.value("_OP0"), bench.value("_OP1")) == (3.0, 1.0)
    assert bench.record().outputs[:2] == (3, 1)
    assert bench.code("OP 0,0,0") == ErrorCode.OPERAND_ERROR
    assert bench.record().inputs[:2] == (255, 255)


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("SB 0", ErrorCode.OUT_OF_RANGE),
        ("CB 9", ErrorCode.OUT_OF_RANGE),
        ("OB 1", ErrorCode.NOT_ENOUGH_FIELDS),
        ("OB 1,1,1", ErrorCode.NOT_ENOUGH_FIELDS),
        ("OB 9,1", ErrorCode.OUT_OF_RANGE),
        ("OP -1", ErrorCode.OUT_OF_RANGE),
        ("OP 1,1", ErrorCode.OPERAND_ERROR),
        ("DA nope", ErrorCode.VARIABLE_ERROR),
        ("DA 9x", ErrorCode.VARIABLE_ERROR),
        ("EO 2", ErrorCode.OUT_OF_RANGE),
        ("LZ -1", ErrorCode.OUT_OF_RANGE),
        ("CW 3", ErrorCode.OUT_OF_RANGE),
        ("CF Q", ErrorCode.OPERAND_ERROR),
        ("CF", ErrorCode.OPERAND_ERROR),
        ("CF AB", ErrorCode.OPERAND_ERROR),
        ("PF 11", ErrorCode.OUT_OF_RANGE),
        ("PF -9", ErrorCode.OUT_OF_RANGE),
        ("VF 4.5", ErrorCode.OUT_OF_RANGE),
        ("RS 1", ErrorCode.OUT_OF_RANGE),
        ("RS -2", ErrorCode.OUT_OF_RANGE),
        ("BN 1", ErrorCode.OPERAND_ERROR),
        ("BV x", ErrorCode.OPERAND_ERROR),
        ("TM 100", ErrorCode.OUT_OF_RANGE),
        ("XQ", ErrorCode.UNDEFINED_LABEL),
        ("XQ #AUTO,0", ErrorCode.UNDEFINED_LABEL),
        ("HX 8", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


@pytest.mark.parametrize(
    "word", ["AD", "AI", "AM", "AP", "AR", "AS", "AT", "AV", "EN", "IF", "JP", "JS", "MC", "MF", "MR", "RE", "RI", "WT"]
)
def test_program_command_is_refused_from_a_host(word: str) -> None:
    assert Bench().code(word) == ErrorCode.PROGRAM_ONLY


@pytest.mark.parametrize(
    ("setup", "ask", "printed"),
    [
        ("", "EO ?", " 1"),
        ("EO 0", "EO ?", " 0"),
        ("", "LZ ?", " 1"),
        ("", "PF ?", " 10.0"),
        ("", "VF ?", " 10.4"),
        ("PF 6.2", "PF ?", " 6.2"),
        ("VF 0.4", "VF ?", " 0.4"),
        ("PF -8.4", "MG _PF", "-8.4000"),
        ("", "TM ?", " 1000"),
        ("TM 1000", "TM ?", " 1000"),
        ("", "DR ?", " 0"),
        ("DR 0", "DR ?", " 0"),
        ("", "CF ?", " 83"),
        ("CF B", "CF ?", " 66"),
        ("CF T", "MG _CF", " 84.0000"),
        ("CF I", "CF ?", " 65"),
        ("CW 1", "MG _CW", " 1.0000"),
        ("CW 1,1", "MG _CW", " 1.0000"),
        ("CW 2", "MG _CW", " 2.0000"),
        ("HX;HX 0;HX 7", "MG _NO", " 0.0000"),
        ("NO", "MG _NO", " 0.0000"),
    ],
)
def test_set_values_are_printed(setup: str, ask: str, printed: str) -> None:
    bench = Bench()
    bench.do(*[setup] * bool(setup))
    assert bench.say(ask) == f"{printed}\r\n:"


@pytest.mark.parametrize("form", ["CW", "CW 0", "CW ?", "CW0"])
def test_cw_alone_names_the_twin(form: str) -> None:
    bench = Bench()
    assert "Maya-UN" in bench.say(form)
    assert bench.value("_CW") == 2.0


@pytest.mark.parametrize(
    ("command", "left"), [("DA a", ["b", "c"]), ("DA a,c", ["b"]), ("DA *", []), ("DA *[0]", ["a", "b", "c"])]
)
def test_variables_are_forgotten_by_name_or_all(command: str, left: list[str]) -> None:
    bench = Bench()
    bench.do("a=1;b=1;c=1", command)
    assert bench.say("LV") == "".join(f"{name}= 1.0000\r\n" for name in left) + ":"


@pytest.mark.parametrize(
    ("form", "command", "printed"),
    [
        ("PF 8.4", "TPA", " 12.0000"),
        ("PF 1.0", "TPA", " 9"),
        ("PF 3.0;LZ 0", "TPA", " 012"),
        ("PF -4.0", "TPA", "$000C"),
        ("PF -8.4;LZ 0", "TPA", "$0000000C.0000"),
        ("PF 3.1", "SP ?", " 999.9"),
        ("VF 2.1", "x=", " 7.3"),
        ("VF 3.0", "x=?", " 7"),
        ("VF 3.0", "LV", "x= 7"),
        ("VF 3.0", "TPA", " 12"),
    ],
)
def test_formats_of_positions_and_values(form: str, command: str, printed: str) -> None:
    bench = Bench()
    bench.do("DPA=12", "x=7.25", *form.split(";"))
    assert bench.say(command) == f"{printed}\r\n:"


@pytest.mark.parametrize("form", ["RS", "RS 0", "RS -1"])
def test_reset_forgets_unburned_settings(form: str) -> None:
    bench = Bench()
    bench.do("SPA=2000;CN 1;PF 4.0;VF 3.1;LZ 0;EO 0;CW 1;CF A;CA T;x=5;ZAA=9;OP 255", "VS 3000;LM AB;LI 5,5", "DPA=7")
    bench.say("XX")
    bench.do(form)
    for operand, value in {
        "_SPA": 25_000, "_CN0": -1, "_PF": 10, "_VF": 10.4, "_LZ": 1, "_EO": 1, "_CW": 2, "_CF": 83, "_CA": 0,
        "_ZAA": 0, "_OP0": 0, "_VS": 25_000, "_LMS": 511, "_TPA": 0, "_TC": 0, "_MOA": 1, "TIME": 0,
    }.items():  # fmt: skip
        assert bench.value(operand) == pytest.approx(value, abs=1e-4), operand
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR


def test_burning_keeps_registers_but_no_user_variable_of_an_axis() -> None:
    bench = Bench()
    bench.do("SPB=2000;ERC=77;CN ,1;ZAA=5;x=1", "BN", "SPB=4000", "RS")
    assert (bench.value("_SPB"), bench.value("_ERC"), bench.value("_CN1")) == (2000.0, 77.0, 1.0)
    assert bench.value("_ZAA") == 0.0
    assert bench.code("MG x") == ErrorCode.VARIABLE_ERROR


def test_tm_waits_for_rest() -> None:
    bench = Bench()
    bench.do("JGA=100;BGA")
    assert bench.code("TM 1000") == ErrorCode.NOT_WHILE_RUNNING


@pytest.mark.parametrize("command", ["EO 1", "x=1", "SB 1", "PF 4.0", "BN", "BV", "DA *", "CW 1", "CF A", "DR 0", "NO"])
def test_commands_without_an_axis_are_allowed_in_motion(command: str) -> None:
    bench = Bench()
    bench.do("JGA=100;BGA", command)
    assert bench.value("_BGA") == 1.0
