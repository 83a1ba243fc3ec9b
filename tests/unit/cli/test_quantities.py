from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from maya_un.cli.quantities import angle, clock_factor, host_and_port, length, share, target_address
from maya_un.errors import InvalidValue, SpeedOnRealMachine
from maya_un.values import FARTHEST

numbers = st.floats(-FARTHEST, FARTHEST)


@given(numbers)
def test_a_plain_number_is_si(value: float) -> None:
    assert length(repr(value), "x") == value
    assert angle(repr(value), "a") == value


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


@pytest.mark.parametrize("speed", [0.0, -1.0, 1000.1, float("nan"), float("inf")])
def test_a_clock_has_its_range(speed: float) -> None:
    with pytest.raises(InvalidValue):
        clock_factor(speed, "sim")


def test_only_the_twins_clock_runs_faster() -> None:
    assert clock_factor(None, "10.0.0.1") == 1.0
    assert clock_factor(20.0, "sim") == 20.0
    with pytest.raises(SpeedOnRealMachine, match=r"10\.0\.0\.1"):
        clock_factor(1.0, "10.0.0.1")


@pytest.mark.parametrize("word", ["sim", "real"])
def test_reserved_word_is_not_a_host(word: str) -> None:
    with pytest.raises(InvalidValue):
        host_and_port(word)


def test_an_address_has_a_port() -> None:
    assert host_and_port("192.168.1.156") == ("192.168.1.156", 23)
    assert host_and_port("maya-1.local:5000") == ("maya-1.local", 5000)
    assert target_address("sim", "10.0.0.1") == "sim"
    assert target_address("real", "10.0.0.1:5") == "10.0.0.1:5"
    assert target_address("10.0.0.2", "10.0.0.1") == "10.0.0.2"


@pytest.mark.parametrize("text", ["", ":23", "host:", "host:x", "host:0", "host:65536", "ho st", "-h", "a:b:c", "h:²"])
def test_invalid_address_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        target_address(text, "10.0.0.1")
