from __future__ import annotations

import pytest

from dmc41x3.address import SerialAddress
from maya_un.cli.addresses import clock_factor, controller_address, target_address
from maya_un.errors import InvalidValue, SpeedOnRealMachine


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
        controller_address(word)


def test_an_address_has_a_port() -> None:
    assert controller_address("192.168.1.156") == ("192.168.1.156", 23)
    assert controller_address("maya-1.local:5000") == ("maya-1.local", 5000)
    assert target_address("sim", "10.0.0.1") == "sim"
    assert target_address("real", "10.0.0.1:5") == "10.0.0.1:5"
    assert target_address("10.0.0.2", "10.0.0.1") == "10.0.0.2"


def test_a_serial_port_is_an_address() -> None:
    assert controller_address("/dev/ttyUSB0@19200") == SerialAddress("/dev/ttyUSB0", 19200)
    assert target_address("real", "/dev/ttyUSB0") == "/dev/ttyUSB0"
    with pytest.raises(InvalidValue, match="the speed after @ must be 9600"):
        target_address("/dev/ttyUSB0@7", "10.0.0.1")


@pytest.mark.parametrize("text", ["", ":23", "host:", "host:x", "host:0", "host:65536", "ho st", "-h", "a:b:c", "h:²"])
def test_invalid_address_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        target_address(text, "10.0.0.1")
