"""Commands that ask, and the operands that tell the same."""

from __future__ import annotations

import re

import pytest

from dmc41x3.language.codes import ERROR_TEXTS, ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench


def moving() -> Bench:
    """Axis A jogs at -2048 counts/s since 1 s."""
    bench = Bench()
    bench.do("JGA=-2048;ACA=1073740800;BGA", "DPB=200;DPC=-10", "DEB=5")
    return bench.at(1.0)


@pytest.mark.parametrize(
    ("ask", "printed"),
    [
        ("TPB", " 200"),
        ("TP B", " 200"),
        ("TPBC", " 200, -10"),
        ("TPCB", " 200, -10"),
        ("TPC", "-10"),
        ("RPC", "-10"),
        ("TEB", " 0"),
        ("TD", " 0, 5, 0"),
        ("TVA", "-2048"),
        ("TVB", " 0"),
        ("RL", " 0, 0, 0"),
        ("TT", " 0.0000, 0.0000, 0.0000"),
        ("SC", " 0, 1, 1"),
        ("SCA", " 0"),
        ("TSA", " 143"),
        ("TSB", " 15"),
        ("TC", " 0"),
        ("TC0", " 0"),
        ("TC ?", " 0"),
        ("TC 1", " 0"),
        ("TB", " 1"),
        ("TI", " 255"),
        ("TI 0", " 255"),
        ("TA 0", " 0"),
        ("QZ", " 3, 52, 26, 36"),
        ("WH", "IHA"),
        ("MG _TPB,_RPC,_TDB,_DEB,_DPB", " 200.0000 -10.0000 5.0000 5.0000 200.0000"),
        ("MG _TVA,_SCA,_BGA,_TSA", "-2048.0000 0.0000 1.0000 143.0000"),
        ("MG _TPY,_TPZ", " 200.0000 -10.0000"),
    ],
)
def test_inquiries_are_answered(ask: str, printed: str) -> None:
    assert moving().say(ask) == f"{printed}\r\n:"


@pytest.mark.parametrize(
    ("operand", "value"),
    [
        ("_TC", 0), ("_TB", 1), ("_TI", 255), ("_TI0", 255), ("_OP0", 0), ("_OP1", 0), ("_NO", 0), ("_BN", 41330),
        ("_BV", 3), ("_UL", 510), ("_CA", 0), ("_AB", 1), ("_EO", 1), ("_CW", 2), ("_CF", 83), ("_LZ", 1), ("_PF", 10),
        ("_VF", 10.4), ("_TM", 1000), ("_DR0", 0), ("_DR1", 0), ("_WH", 0), ("_IA2", 7), ("_IA3", 0), ("_IA4", -1),
        ("_IA5", 100), ("_QZ0", 3), ("_QZ1", 52), ("_QZ2", 26), ("_QZ3", 36), ("_XQ0", -1), ("_XQ7", -1), ("_HX0", 0),
        ("_HX7", 0), ("_TA3", 0), ("_CN0", -1), ("_CN3", 0), ("_LFA", 1), ("_LRC", 1), ("_HMA", 1), ("_VSS", 25000),
        ("_VST", 25000), ("_VD", 256000), ("_VMS", 0), ("_AVS", 0), ("_CSS", 0), ("_LMS", 511), ("_BGS", 0),
        ("@OUT[8]", 0), ("@IN[1]", 1), ("@IN[8]", 1), ("TIME", 0),
    ],
)  # fmt: skip
def test_operands_at_power_up(operand: str, value: float) -> None:
    assert Bench().value(operand) == pytest.approx(value, abs=1e-4)


@pytest.mark.parametrize(
    ("operand", "code"),
    [
        ("_CO", ErrorCode.BAD_OPERAND),
        ("_TPD", ErrorCode.BAD_OPERAND),
        ("_TPAB", ErrorCode.BAD_OPERAND),
        ("_VSU", ErrorCode.BAD_OPERAND),
        ("_XQ8", ErrorCode.BAD_OPERAND),
        ("_CN5", ErrorCode.BAD_OPERAND),
        ("_IHA5", ErrorCode.BAD_OPERAND),
        ("_IHI0", ErrorCode.BAD_OPERAND),
        ("_WHA", ErrorCode.BAD_OPERAND),
        ("_ZZZ", ErrorCode.BAD_OPERAND),
        ("@IN[9]", ErrorCode.OUT_OF_RANGE),
        ("@IN[0]", ErrorCode.OUT_OF_RANGE),
        ("@OUT[9]", ErrorCode.OUT_OF_RANGE),
        ("@AN[9]", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_operands_that_there_are_not(operand: str, code: ErrorCode) -> None:
    assert Bench().code(f"MG {operand}") == code


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("TPD", ErrorCode.INVALID_AXIS),
        ("TP 1", ErrorCode.OPERAND_ERROR),
        ("TSS", ErrorCode.S_OPERAND_INVALID),
        ("TTE", ErrorCode.INVALID_AXIS),
        ("TC 2", ErrorCode.OUT_OF_RANGE),
        ("TA 4", ErrorCode.OUT_OF_RANGE),
        ("TA -1", ErrorCode.OUT_OF_RANGE),
        ("TI 2", ErrorCode.OUT_OF_RANGE),
        ("TB 1", ErrorCode.OUT_OF_RANGE),
        ("QR Q", ErrorCode.INVALID_AXIS),
        ("QR AD", ErrorCode.INVALID_AXIS),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


@pytest.mark.parametrize("form", ["TC1", "TC 1", "TC1 "])
def test_tc1_prints_the_code_with_its_words_and_clears_it(form: str) -> None:
    bench = Bench()
    bench.say("MOA;BGA")
    assert bench.value("_TC") == 20.0
    assert bench.say(form) == f"20 {ERROR_TEXTS[20]}\r\n:"
    assert bench.say(form) == " 0\r\n:"


@pytest.mark.parametrize("form", ["TC", "TC0", "TC 0", "TC ?"])
def test_tc_prints_the_code_alone_and_clears_it(form: str) -> None:
    bench = Bench()
    bench.say("GF32")
    assert bench.say(form) == " 1\r\n:"
    assert bench.value("_TC") == 0.0


def test_last_refusal_is_printed() -> None:
    bench = Bench()
    bench.say("GF32;SPA=99999999;EO 1")
    assert bench.say("TC") == f" {ErrorCode.OUT_OF_RANGE}\r\n:"


def test_codes_print_three_digits_for_any_pf() -> None:
    bench = Bench()
    bench.do("PF 8.2", "LZ 0")
    assert bench.say("TSA;SCA;TC") == " 015\r\n: 001\r\n: 000\r\n:"
    assert bench.say("TPA") == " 00000000.00\r\n:"


def test_id_names_firmware_and_family() -> None:
    assert re.fullmatch(r"FW, DMC4133 Rev [^\r]+\r\nDMC, 4103, Rev 11\r\n:", Bench().say("ID"))
    assert Bench().say("\x12\x16").startswith("DMC4133 Rev ")


def test_lv_lists_variables_by_name() -> None:
    bench = Bench()
    assert bench.say("LV") == ":"
    bench.do("zeta=-2", "alpha=1.5", "Beta=3")
    assert bench.say("LV") == "Beta= 3.0000\r\nalpha= 1.5000\r\nzeta=-2.0000\r\n:"
    assert bench.value("_UL") == 507.0


def test_there_are_510_variables() -> None:
    bench = Bench()
    bench.do(*(f"v{number}=1" for number in range(510)))
    assert bench.code("onemore=1") == ErrorCode.TOO_MANY_VARIABLES
    bench.do("v7=2", "DA v8", "onemore=1")


@pytest.mark.parametrize("name", ["TIME=1", "9x=1", "toolongname=1"])
def test_names_of_variables(name: str) -> None:
    assert Bench().say(name) == "?"
