from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.errors import InvalidValue
from maya_un.quantities import ANGLE, LENGTH, angle, angle_in, join_units, length, length_in, share, share_in, step
from maya_un.values import FARTHEST


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_a_plain_number_is_si(metres: float, radians: float) -> None:
    assert length(repr(metres), "x") == length_in(metres, "x") == metres
    assert angle(repr(radians), "a") == angle_in(radians, "a") == radians


@given(st.floats(10.0, FARTHEST, exclude_min=True), st.sampled_from([1, -1]))
def test_a_plain_number_that_no_robot_reaches_is_refused_with_its_right_form(value: float, sign: int) -> None:
    for read in (lambda: length(repr(sign * value), "x"), lambda: length_in(sign * value, "x")):
        with pytest.raises(InvalidValue, match=r"for mm write -?[\d.e+]+ mm\.$"):
            read()
    for read in (lambda: angle(repr(sign * value), "a"), lambda: angle_in(sign * value, "a")):
        with pytest.raises(InvalidValue, match=r"for deg write -?[\d.e+]+ deg\.$"):
            read()
    assert length(f"{sign * value!r} m", "x") == sign * value
    assert angle(f"{sign * value!r} mrad", "a") == pytest.approx(sign * value * 1e-3)


@pytest.mark.parametrize("value", [True, None, [1.0], float("nan"), float("inf"), 10**400, 1e5, "0.5", "half", "5 deg"])
def test_another_value_is_no_length_in_data(value: object) -> None:
    with pytest.raises(InvalidValue, match=r"^x = "):
        length_in(value, "x")


def test_data_take_units() -> None:
    assert length_in("500 mm", "x") == length_in("0.5m", "x") == 0.5
    assert angle_in("180 deg", "a") == angle_in("180°", "a") == pi


@pytest.mark.parametrize(
    ("text", "metres"), [("0.1", 0.1), ("-.1", -0.1), ("100 mm", 0.1), ("0.5m", 0.5), ("1 m", 1.0)]
)
def test_a_long_step_has_a_unit(text: str, metres: float) -> None:
    assert step(text, "DISTANCE", LENGTH) == pytest.approx(metres)


@pytest.mark.parametrize(("text", "right"), [("0.5", "0.5 m or 0.5 mm"), ("-5", "-5 m or -5 mm"), ("1.", "1. m")])
def test_a_long_step_without_a_unit_is_refused_with_its_right_forms(text: str, right: str) -> None:
    with pytest.raises(InvalidValue, match=f"write {right}"):
        step(text, "DISTANCE", LENGTH)
    if text != "0.5":
        with pytest.raises(InvalidValue, match="rad or"):
            step(text, "DISTANCE", ANGLE)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5m", 1.5), ("120mm", 0.12), ("12 cm", 0.12), ("-3um", -3e-6), ("5e2µm", 5e-4), (".5", 0.5), ("+2.", 2.0)],
)
def test_lengths_take_units(text: str, value: float) -> None:
    assert length(text, "x") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("text", "value"), [("180deg", pi), ("-90°", -pi / 2), ("2rad", 2.0), ("5mrad", 0.005)])
def test_angles_take_units(text: str, value: float) -> None:
    assert angle(text, "a") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("text", "value"), [("50%", 0.5), ("0.5", 0.5), ("100 %", 1.0), (".07", 0.07)])
def test_shares_take_percent(text: str, value: float) -> None:
    assert share(text, "RATIO") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["", "half", "50mm", "%", "5%%"])
def test_invalid_share_is_refused_by_name(text: str) -> None:
    with pytest.raises(InvalidValue, match=r"^RATIO = "):
        share(text, "RATIO")


@pytest.mark.parametrize(
    "text", ["", "nan", "inf", "-inf", "1e999", "1,5", "12 parsecs", "30deg", "1 2", "0x10", "1_0", "mm", "--1"]
)
def test_invalid_length_is_refused_by_name(text: str) -> None:
    with pytest.raises(InvalidValue, match=r"^z = "):
        length(text, "z")


@pytest.mark.parametrize("text", ["1e308", "-1e308mm", "10001", "1e6 deg"])
def test_invalid_coordinate_is_refused_as_everywhere(text: str) -> None:
    with pytest.raises(InvalidValue, match="between -10000 and 10000"):
        (angle if "deg" in text else length)(text, "z")


def test_length_is_not_an_angle() -> None:
    with pytest.raises(InvalidValue):
        angle("30mm", "a")


@pytest.mark.parametrize(("text", "right"), [("0,5", "0.5"), ("-1,25 mm", "-1.25 mm"), ("1,5cm", "1.5cm")])
def test_a_decimal_comma_is_refused_with_the_point_in_its_place(text: str, right: str) -> None:
    for read in (lambda: length(text, "x"), lambda: length_in(text, "x")):
        with pytest.raises(InvalidValue, match="point: write"):
            read()
    with pytest.raises(InvalidValue, match=f"write {right}[.]$"):
        length(text, "x")


@pytest.mark.parametrize("value", [50, 1.5, 100])
def test_a_share_above_one_is_refused_in_favour_of_percent(value: float) -> None:
    for read in (lambda: share(f"{value}", "RATIO"), lambda: share_in(value, "RATIO")):
        with pytest.raises(InvalidValue, match=f"write {value:g}%"):
            read()
    assert share(f"{value}%", "RATIO") == pytest.approx(value / 100)


@pytest.mark.parametrize(
    ("line", "joined"),
    [
        ("move 30 deg 1.5 m 1500 mm", "move 30deg 1.5m 1500mm"),
        ("speed 50 %", "speed 50%"),
        ("pick 0.5 1.2 --json", "pick 0.5 1.2 --json"),
        ("pick m mm 5 cube", "pick m mm 5 cube"),
        ("jog x -5 mm mm", "jog x -5mm mm"),
        ("", ""),
    ],
)
def test_a_unit_joins_the_number_before_it(line: str, joined: str) -> None:
    assert " ".join(join_units(line.split())) == joined
