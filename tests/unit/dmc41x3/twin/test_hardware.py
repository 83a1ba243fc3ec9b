"""Sample period, commutation, steppers, virtual axes, and what stands around the controller."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.registers import AXIS
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("period", "speed", "rate"), [(1000, 2, 1024), (500, 4, 4096), (2000, 1, 256), (250, 8, 16_384)]
)
def test_steps_scale_with_the_sample_period(period: int, speed: float, rate: float) -> None:
    assert AXIS["SP"].sampled(period).step == speed
    assert (AXIS["AC"].sampled(period).step, AXIS["AC"].sampled(period).minimum) == (rate, rate)
    assert AXIS["KP"].sampled(period) is AXIS["KP"]


def test_tm_changes_the_sample_and_not_the_speed() -> None:
    bench = Bench()
    assert bench.at(1.0).value("TIME") == 1024.0
    bench.do("TM 500", "SPA=10003", "ACA=10000")
    assert (bench.value("_TM"), bench.value("_SPA"), bench.value("_ACA")) == (500.0, 10_000.0, 8_192.0)
    assert bench.at(2.0).value("TIME") == 1024.0 + 2048.0
    bench.do("JGA=10000;BGA")
    before = bench.at(4.0).positions()[0]
    assert bench.at(5.0).positions()[0] - before == 10_000


def test_registers_keep_their_values_as_far_as_the_new_steps_let_them() -> None:
    bench = Bench()
    bench.do("SPA=3002;ACA=5120;DCA=1024", "TM 250")
    assert [bench.value(f"_{name}A") for name in ("SP", "AC", "DC")] == [3000.0, 16_384.0, 16_384.0]


@pytest.mark.parametrize(("axes", "least"), [(1, 125), (2, 125), (3, 250), (4, 250), (8, 500)])
def test_more_axes_need_longer_samples(axes: int, least: int) -> None:
    bench = Bench(axes)
    bench.do(f"TM {least}", "TM 20000")
    assert bench.code(f"TM {least - 1}") == ErrorCode.OUT_OF_RANGE
    assert bench.code("TM 20001") == ErrorCode.OUT_OF_RANGE


def test_a_reset_samples_as_usual() -> None:
    bench = Bench()
    bench.do("TM 500")
    bench.machine.unit.reset()
    assert bench.machine.unit.core.period == 1000
    assert bench.machine.unit.time == 0


def test_commutation_goes_step_by_step() -> None:
    bench = Bench()
    for command in ("BMA=1000", "BZA=2", "BXA=2", "BDA=90", "BIA=-1"):
        assert bench.code(command) == ErrorCode.NOT_BRUSHLESS
    bench.do("BAA", "BMA=1000.5", "MOA")
    assert (bench.value("_BAA"), bench.value("_BAB"), bench.value("_BMA")) == (1.0, 0.0, 1000.5)
    assert bench.code("SHA") == ErrorCode.NOT_INITIALISED
    bench.do("BZA=-1.5<500>200")
    assert (bench.value("_MOA"), bench.value("_BZA")) == (1.0, 1.0)
    bench.do("SHA", "BZA=1.5")
    assert bench.value("_MOA") == 0.0
    bench.do("BAN", "SHA")
    assert bench.value("_BAA") == 0.0


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("BCA", ErrorCode.NO_HALLS),
        ("BIA=-1", ErrorCode.NO_HALLS),
        ("BZA=5", ErrorCode.OUT_OF_RANGE),
        ("BMA=0", ErrorCode.OUT_OF_RANGE),
        ("AGA=2", ErrorCode.MOTOR_MUST_BE_OFF),
        ("AUA=1", ErrorCode.MOTOR_MUST_BE_OFF),
        ("YRA=5", ErrorCode.OPERAND_ERROR),
        ("OC 5", ErrorCode.OPERAND_ERROR),
        ("AZ 3", ErrorCode.OUT_OF_RANGE),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    bench = Bench()
    bench.do("BAA;BZA=2")
    assert bench.code(command) == code


def stepper() -> Bench:
    """Return a bench whose axis A steps 400 microsteps a turn of 4000 counts."""
    bench = Bench(servo=False)
    bench.do("MTA=2", "SH")
    return bench


def test_a_stepper_counts_steps_and_its_encoder_counts() -> None:
    bench = stepper()
    bench.do("PRA=400;BGA")
    bench.at(5.0)
    assert [bench.value(f"_{name}A") for name in ("RP", "TD", "TP", "TE", "QS")] == [400, 400, 4000, 0, 0]
    assert bench.record().axes[0].auxiliary == 400
    bench.do("DEA=100", "DPA=10")
    assert [bench.value(f"_{name}A") for name in ("RP", "TD", "TP", "QS")] == [10, 10, 100, 0]


def test_a_stepper_is_slower() -> None:
    bench = stepper()
    bench.do("SPA=3000000", "SPB=15000000")
    assert bench.code("SPA=3000002") == ErrorCode.OUT_OF_RANGE
    assert bench.code("JGA=3000002") == ErrorCode.OUT_OF_RANGE


def test_a_stepper_out_of_step_is_stopped_and_corrected() -> None:
    bench = stepper()
    bench.do("YSA=1", "ERA=10;OEA=1", "JGA=100;BGA")
    bench.at(1.0).plant.hold(0)
    bench.at(2.0)
    assert (bench.value("_SCA"), bench.value("_YSA"), bench.value("_MOA")) == (16.0, 2.0, 1.0)
    assert 6 < bench.value("_QSA") < 9
    bench.do("YSA=1", "OEA=0", "MOA", "YSA=0", "SHA")
    bench.plant.release(0)
    before = bench.positions()[0]
    bench.do("YRA=_QSA+5")
    assert bench.at(4.0).positions()[0] == before + 5


def test_virtual_axes_have_profiles_and_nothing_else() -> None:
    bench = Bench()
    bench.do("SPN=10240;ACN=10240;DCN=10240", "PAN=20480", "BGN")
    assert bench.at(1.5).value("_RPN") == 5_120 + 5_120
    assert bench.say("BGN") == "?"
    assert bench.at(3.0).value("_TPN") == 20_480.0
    bench.do("DPN=5", "JGM=-200;BGM")
    assert bench.value("_RPN") == 5.0
    bench.at(4.0).do("ST")
    assert bench.value("_SCM") == 4.0
    for misuse in ("KPN=5", "FLN=5", "MTN=1", "MG _TTN", "SHN", "GAN=A"):
        assert bench.say(misuse) == "?"


def test_analog_ranges_are_kept() -> None:
    bench = Bench()
    bench.do("AQ 3,-1")
    assert bench.say("AQ ?,?,?") == " 2, 2, -1\r\n:"
    assert bench.value("_AQ3") == -1.0
    assert bench.code("AQ 9,1") == bench.code("AQ 1,5") == bench.code("AQ 1,0") == ErrorCode.OUT_OF_RANGE


def test_a_locked_program_is_not_shown() -> None:
    bench = Bench()
    bench.do("PW maya,maya", "\x0c\x0bmaya,1")
    for command in ("UL", "LS", "DL", "ED", "TR", "PW a,a"):
        assert bench.code(command) == ErrorCode.PRIVILEGE
    assert bench.say("\x0c\x0b?") == " 1\r\n:"
    assert bench.code("\x0c\x0bother,0") == ErrorCode.WRONG_PASSWORD
    assert bench.code("\x0c\x0bmaya,2") == ErrorCode.WRONG_LOCK
    bench.do("\x0c\x0bmaya,0")
    assert bench.say("UL").endswith(":")
    assert bench.code("PW a,b") == ErrorCode.PASSWORDS_DIFFER


def test_a_listing_shows_inputs_and_outputs() -> None:
    bench = Bench()
    bench.do("SB 3")
    bench.machine.unit.set_input(1, False)
    assert bench.say("TZ") == (
        "Block 0 (8-1) dedicated as input - value 254 (1111_1110)\r\n"
        "Block 0 (8-1) dedicated as output - value 4 (0000_0100)\r\n"
        "Block 10 (88-81) dedicated as input - value 63 (0011_1111)\r\n:"
    )


def test_listing_of_eight_axes_has_the_upper_banks() -> None:
    """The form and the order of the banks are those of Galil's command reference (TZ)."""
    lines = Bench(axes=8).say("TZ").split("\r\n")
    assert [line.split(" dedicated")[0] for line in lines[:-1]] == [
        *["Block 0 (8-1)", "Block 0 (8-1)", "Block 1 (16-9)", "Block 1 (16-9)"],
        *["Block 10 (88-81)", "Block 11 (96-89)"],
    ]


@pytest.mark.parametrize(
    ("command", "ask", "told"),
    [("EI 5,3,2", "EI ?,?,?", " 5, 3, 2"), ("MW 0", "MW ?", " 0"), ("CI -1", "MG _CI", "-1.0000")],
)
def test_settings_without_effect_are_printed_again(command: str, ask: str, told: str) -> None:
    bench = Bench()
    bench.do(command)
    assert bench.say(ask) == f"{told}\r\n:"
