"""Registers of the axes and of the planes: defaults, ranges, steps, formats, and when they may be changed."""

from __future__ import annotations

import pytest

from dmc41x3.language.codes import ErrorCode
from tests.unit.dmc41x3.twin.bench import Bench

FASTEST, STEEPEST, VOLTS = 15_000_000, 1_073_740_800, 9.9982
LARGEST, SMALLEST = 2_147_483_647, -2_147_483_648

DEFAULTS = {
    "SP": 25_000, "AC": 256_000, "DC": 256_000, "SD": 256_000, "HV": 256, "IT": 1, "KP": 6, "KI": 0, "KD": 64,
    "TL": VOLTS, "TK": 0, "OF": 0, "ER": 16_384, "OE": 0, "LD": 0, "FL": LARGEST, "BL": SMALLEST, "MT": 1, "CE": 0,
    "BR": 0, "BW": 0, "ZA": 0, "JG": 25_000, "PT": 0, "PA": 0, "PR": 0, "DE": 0, "MO": 0,
}  # fmt: skip

RANGES: list[tuple[str, float, float]] = [
    ("SP", -FASTEST, FASTEST),
    ("AC", 1024, STEEPEST),
    ("DC", 1024, STEEPEST),
    ("SD", 1024, STEEPEST),
    ("HV", 0, FASTEST),
    ("JG", -FASTEST, FASTEST),
    ("KP", 0, 1023.875),
    ("KI", 0, 255.999),
    ("KD", 0, 4095.875),
    ("IT", 0.004, 1),
    ("TL", 0, VOLTS),
    ("TK", 0, VOLTS),
    ("OE", 0, 3),
    ("LD", 0, 3),
    ("BW", 0, 4096),
    ("CE", 0, 15),
    ("BR", -1, 1),
    ("PT", 0, 1),
]
STEPS: list[tuple[str, float, float]] = [
    ("SP", 3_001, 3_000),
    ("SP", -3_001, 3_000),
    ("JG", 3_001, 3_000),
    ("HV", 301, 300),
    ("AC", 150_000, 149_504),
    ("DC", 2_047, 1_024),
    ("SD", 2_048, 2_048),
    ("KP", 6.2, 6.125),
    ("KD", 64.99, 64.875),
    ("KI", 0.0015, 0.0010),
    ("IT", 0.5, 0.5),
    ("IT", 0.3, 0.2969),
    ("TL", 5.0002, 5.0),
    ("TK", 1.0, 0.9998),
    ("ER", 100.9, 100),
]


@pytest.mark.parametrize(("name", "value"), DEFAULTS.items())
def test_factory_settings(name: str, value: float) -> None:
    bench = Bench()
    for axis in "ABC":
        assert bench.value(f"_{name}{axis}") == pytest.approx(value, abs=6e-5)


@pytest.mark.parametrize(("name", "low", "high"), RANGES)
def test_both_ends_of_a_range_are_in_it(name: str, low: float, high: float) -> None:
    bench = Bench()
    bench.do(f"{name}B={low}", f"{name}B={high}", f"{name} ,{low}")


@pytest.mark.parametrize(("name", "low", "high"), RANGES)
def test_value_out_of_range_is_refused_and_changes_nothing(name: str, low: float, high: float) -> None:
    bench = Bench()
    before = bench.value(f"_{name}B")
    for beyond in (low - 1, high + 1):
        assert bench.code(f"{name}B={beyond:.4f}") == ErrorCode.OUT_OF_RANGE
    assert bench.value(f"_{name}B") == before


@pytest.mark.parametrize(("name", "given", "kept"), STEPS)
def test_steps_are_rounded_towards_zero(name: str, given: float, kept: float) -> None:
    bench = Bench()
    bench.do(f"{name}C={given}")
    assert bench.value(f"_{name}C") == pytest.approx(kept, abs=6e-5)


@pytest.mark.parametrize("name", ["PA", "PR", "DP", "DE", "FL", "BL", "ZA"])
def test_positions_have_32_bits(name: str) -> None:
    bench = Bench()
    bench.do(f"{name}B={LARGEST}", f"{name}B={SMALLEST}")
    for beyond in (LARGEST + 1, SMALLEST - 1):
        assert bench.code(f"{name}B={beyond}") == ErrorCode.OUT_OF_RANGE


@pytest.mark.parametrize(
    ("ask", "printed"),
    [
        ("SP ?", " 25000"),
        ("SP ?,?,?", " 25000, 25000, 25000"),
        ("SPC=?", " 25000"),
        ("SPZ=?", " 25000"),
        ("SP*=?", " 25000, 25000, 25000"),
        ("SP ,,?", " 25000"),
        ("AC ?", " 256000"),
        ("JG ?,?", " 25000, 25000"),
        ("KP ?", " 6.00"),
        ("TL ?", " 9.9982"),
        ("OF ?", " 0.0000"),
        ("IT ?", " 1.0000"),
        ("FL ?", " 2147483647"),
        ("BL ?", "-2147483648"),
        ("ER ?,?", " 16384, 16384"),
        ("PT ?", " 0"),
        ("PA ?", " 0"),
        ("PR ?", " 0"),
        ("DP ?,?", " 0, 0"),
        ("DE ?", " 0"),
        ("CN ?", "-1"),
        ("CN ?,?,?,?,?", "-1, -1, -1, 0, 0"),
        ("VS ?,?", " 25000, 25000"),
        ("VA ?", " 256000"),
        ("VDT=?", " 256000"),
        ("VR ?", " 1.0000"),
    ],
)
def test_question_mark_output(ask: str, printed: str) -> None:
    assert Bench().say(ask) == f"{printed}\r\n:"


def test_setting_and_asking_mix() -> None:
    bench = Bench()
    assert bench.say("SP 1000,?,3000") == " 25000\r\n:"
    assert bench.say("SP ?,?,?") == " 1000, 25000, 3000\r\n:"


def test_an_empty_place_leaves_its_axis_alone() -> None:
    bench = Bench()
    bench.do("SP ,2000", "AC ,,2048")
    assert bench.say("SP ?,?,?") == " 25000, 2000, 25000\r\n:"
    assert bench.say("AC ?,?,?") == " 256000, 256000, 2048\r\n:"


@pytest.mark.parametrize(
    ("given", "levels"),
    [
        ("CN 1", [1, -1, -1, 0, 0]),
        ("CN ,1", [-1, 1, -1, 0, 0]),
        ("CN ,,1", [-1, -1, 1, 0, 0]),
        ("CN 1,1,1,1,1", [1, 1, 1, 1, 1]),
        ("CN ,,,,1", [-1, -1, -1, 0, 1]),
    ],
)
def test_cn_sets_five_things(given: str, levels: list[int]) -> None:
    bench = Bench()
    bench.do(given)
    assert [bench.value(f"_CN{n}") for n in range(5)] == levels


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ("CN 0", ErrorCode.OUT_OF_RANGE),
        ("CN 2", ErrorCode.OUT_OF_RANGE),
        ("CN ,0", ErrorCode.OUT_OF_RANGE),
        ("CN ,,,-1", ErrorCode.OUT_OF_RANGE),
        ("CN ,,,,2", ErrorCode.OUT_OF_RANGE),
        ("CN 1,1,1,1,1,1", ErrorCode.OPERAND_ERROR),
    ],
)
def test_cn_takes_signs_and_flags(given: str, code: ErrorCode) -> None:
    bench = Bench()
    assert bench.code(given) == code
    assert [bench.value(f"_CN{n}") for n in range(5)] == [-1, -1, -1, 0, 0]


@pytest.mark.parametrize("motor", ["1", "-1", "2", "-2", "2.5", "-2.5", "4", "-4"])
def test_the_motor_type_is_set_with_the_motor_off(motor: str) -> None:
    bench = Bench()
    assert bench.code(f"MTB={motor}") == ErrorCode.MOTOR_MUST_BE_OFF
    bench.do("MOB", f"MTB={motor}")
    assert bench.value("_MTB") == float(motor)
    assert bench.record().axes[1].switches & 1 == (abs(float(motor)) >= 2)


@pytest.mark.parametrize("motor", ["0", "3", "1.5", "-3"])
def test_there_are_eight_motor_types(motor: str) -> None:
    bench = Bench(servo=False)
    assert bench.code(f"MTA={motor}") == ErrorCode.OUT_OF_RANGE


@pytest.mark.parametrize(
    ("name", "low", "high", "given", "kept"),
    [
        ("VS", 2, FASTEST, 2_001, 2_000),
        ("VA", 1024, STEEPEST, 20_000, 19_456),
        ("VD", 1024, STEEPEST, 20_000, 19_456),
        ("VR", 0, 10, 0.5, 0.5),
    ],
)
def test_rates_of_the_planes(name: str, low: float, high: float, given: float, kept: float) -> None:
    bench = Bench()
    bench.do(f"{name}S={low}", f"{name}S={high}", f"{name}S={given}", f"{name} ,{given}")
    assert bench.value(f"_{name}") == bench.value(f"_{name}S") == bench.value(f"_{name}T") == kept
    for beyond in (low - 1, high + 1):
        assert bench.code(f"{name}S={beyond}") == ErrorCode.OUT_OF_RANGE
    assert bench.code(f"{name} 2000,2000,2000") == ErrorCode.OPERAND_ERROR


@pytest.mark.parametrize("command", ["SPS=2", "VSA=2", "SP*=", "SP =3", "VS", "AC ,,"])
def test_axes_and_planes_are_not_mistaken_for_one_another(command: str) -> None:
    assert Bench().say(command) == "?"


@pytest.mark.parametrize(
    ("moving", "code"),
    [
        ("PRA=90000;BGA", ErrorCode.NOT_WHILE_RUNNING),
        ("JGA=1000;BGA", None),
        ("PRA=90000;BGA;STA", None),
        ("FEA;BGA", None),
        ("", None),
    ],
)
@pytest.mark.parametrize("name", ["DC", "SD"])
def test_decelerations_wait_for_a_move_to_a_place(name: str, moving: str, code: ErrorCode | None) -> None:
    bench = Bench()
    bench.do(*moving.split(";") if moving else [])
    bench.at(0.05)
    if code is None:
        bench.do(f"{name}A=2048")
    else:
        assert bench.code(f"{name}A=2048") == code
    bench.do(f"{name}B=2048")


@pytest.mark.parametrize(
    "command", ["ITA=.5", "KPA=1", "KIA=1", "KDA=1", "TLA=9", "TKA=1", "HVA=2", "BWA=5", "SPA=2", "ACA=2048", "ERA=-1"]
)
def test_registers_of_the_servo_may_change_in_motion(command: str) -> None:
    bench = Bench()
    bench.do("PRA=90000;BGA")
    bench.at(0.5).do(command)


@pytest.mark.parametrize("command", ["BRA=1", "CEA=1", "MTA=1"])
def test_motor_type_may_not_change_in_motion(command: str) -> None:
    bench = Bench()
    bench.do("PRA=90000;BGA")
    assert bench.at(0.5).code(command) == ErrorCode.NOT_WHILE_RUNNING


def test_arguments_are_expressions() -> None:
    bench = Bench()
    bench.do("v=2000", "SP v*2,(v+1)*3,@ABS[0-v]", "PAB=v-500")
    assert bench.say("SP ?,?,?") == " 4000, 6002, 2000\r\n:"
    assert bench.code("SP (1,2") == ErrorCode.PARENTHESES
