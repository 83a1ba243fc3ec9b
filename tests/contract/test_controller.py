"""What any DMC-41x3 does, by two or more independent sources each."""

from __future__ import annotations

import re

import pytest

from tests.contract.conftest import Talk


@pytest.mark.parametrize("line", [b"\r", b"\r\n", b"\n\r", b"EO 0\r", b"EO 0\r\n", b"TPA\r"])
def test_a_line_yields_one_prompt(talk: Talk, line: bytes) -> None:
    assert talk.raw(line, 1)[0].ok


def test_each_command_of_a_line_yields_a_prompt_and_so_does_its_end(talk: Talk) -> None:
    assert [reply.ok for reply in talk.raw(b"EO 0;TPA;\r", 3)] == [True, True, True]


def test_an_error_does_not_end_the_line(talk: Talk) -> None:
    assert [reply.ok for reply in talk.raw(b"EO 0;GF32;EO 0\r", 3)] == [True, False, True]
    talk.text("TC")


def test_a_line_of_more_than_80_characters_is_refused(talk: Talk) -> None:
    assert not talk.say("MG " + "1" * 90).ok
    talk.text("TC")


@pytest.mark.parametrize("command", ["GF32", "bg", "tpa"])
def test_unknown_commands_have_code_1_and_asking_clears_it(talk: Talk, command: str) -> None:
    assert talk.refused(command) == 1
    assert int(talk.text("TC1").split()[0]) == 0


def test_the_operand_of_tc_does_not_clear(talk: Talk) -> None:
    talk.say("GF32")
    assert talk.value("_TC") == talk.value("_TC") == 1.0
    talk.text("TC")


def test_identity(talk: Talk) -> None:
    firmware = talk.text("\x12\x16")
    assert re.match(r"DMC41[1-8]3 Rev 1\.\d", firmware)
    assert re.search(r"DMC, 4103", talk.text("ID"))
    sizes = [int(size) for size in talk.text("QZ").split(",")]
    assert sizes == [int(firmware[5]), 52, 26, 36]
    assert re.fullmatch(r"IH[A-H]", talk.text("WH"))
    assert re.search(r"ETHERNET ADDRESS ([0-9A-F]{2}-){5}[0-9A-F]{2}", talk.text("TH"))
    assert talk.text("TH").count("\nIH") == 8


def test_values_print_with_a_slot_for_the_sign_and_four_decimals(talk: Talk) -> None:
    assert talk.text("MG 1") == " 1.0000"
    assert talk.text("MG -12.5") == "-12.5000"


def test_variables(talk: Talk) -> None:
    talk.text("mayatest=5")
    assert talk.text("mayatest=?") == talk.text("mayatest=") == talk.text("MG mayatest") == " 5.0000"
    assert not talk.say("MG mayanope").ok
    talk.text("TC")


def test_positions_of_several_axes_are_separated_by_comma_and_blank(talk: Talk) -> None:
    assert re.fullmatch(r" ?-?\d+(, -?\d+)+", talk.text("TP"))
    assert re.fullmatch(r" ?-?\d+", talk.text("TPA"))


@pytest.mark.parametrize("form", ["SP 3000", "SPA=3000", "SPX=3000", "SP*=3000", "SP 3001"])
def test_forms_of_arguments_and_even_speeds(talk: Talk, form: str) -> None:
    talk.text("SPA=1000")
    talk.text(form)
    assert talk.value("_SPA") == 3000.0
    assert float(talk.text("SPA=?")) == 3000.0


def test_accelerations_are_multiples_of_1024(talk: Talk) -> None:
    talk.text("ACA=150000")
    assert talk.value("_ACA") == 149504.0


def test_the_record_is_framed_by_its_length(talk: Talk) -> None:
    data = talk.record()
    assert len(data) == int.from_bytes(data[2:4], "little")
    assert len(data) == 4 + 52 + 26 + 36 * int(talk.value("_BV"))
    assert int.from_bytes(data[86:90], "little", signed=True) == pytest.approx(talk.value("_RPA"), abs=2)


def test_limit_operands_and_record_agree(talk: Talk) -> None:
    data = talk.record()
    assert (data[84] >> 3 & 1, data[84] >> 2 & 1) == (talk.value("_LFA"), talk.value("_LRA"))


def test_begin_needs_the_servo(axis_a: Talk) -> None:
    axis_a.text("MOA")
    axis_a.text("PRA=100")
    assert axis_a.refused("BGA") == 20


def test_a_move_from_begin_to_end(axis_a: Talk) -> None:
    axis_a.text("PAA=2000")
    axis_a.text("BGA")
    assert axis_a.value("_BGA") == 1.0
    assert axis_a.refused("BGA") == 21
    assert not axis_a.say("PAA=0").ok
    axis_a.text("SPA=1200")
    _at_rest(axis_a)
    assert axis_a.value("_SCA") == 1.0
    assert axis_a.value("_RPA") == 2000.0


def test_stop_says_so_before_the_axis_rests(axis_a: Talk) -> None:
    axis_a.text("PAA=2000")
    axis_a.text("BGA")
    while axis_a.value("_RPA") < 500:
        continue
    axis_a.text("STA")
    assert axis_a.value("_SCA") == 4.0
    _at_rest(axis_a)
    assert axis_a.value("_SCA") == 4.0
    assert 500 <= axis_a.value("_RPA") < 2000


def test_servo_on_forgets_the_error(axis_a: Talk) -> None:
    axis_a.text("MOA")
    axis_a.text("SHA")
    assert abs(axis_a.value("_TEA")) <= 2


def _at_rest(talk: Talk) -> None:
    """Ask until the profile has ended; every question takes time by itself."""
    for _ in range(10_000):
        if talk.value("_BGA") == 0.0:
            return
    pytest.fail("the axis does not come to rest")
