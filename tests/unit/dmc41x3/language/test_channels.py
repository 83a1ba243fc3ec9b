from __future__ import annotations

import pytest

from dmc41x3.language.record import (
    AxisRecord,
    AxisStatus,
    AxisSwitches,
    DataRecord,
    SampleClock,
    columns,
    quantity,
    reading,
    unit,
)

B = AxisRecord(
    status=AxisStatus.MOVING | AxisStatus.MOTOR_OFF,
    switches=AxisSwitches.REVERSE_INACTIVE,
    stop_code=4,
    reference=-118,
    position=-120,
    error=2,
    auxiliary=77,
    velocity_raw=-64 * 500,
    torque_raw=32767,
    user=9,
)
RECORD = DataRecord((AxisRecord(), B, AxisRecord()), inputs=(0b1000_0001, 0b10) + (0,) * 8, outputs=(4,) + (0,) * 9)


@pytest.mark.parametrize(
    ("channel", "value"),
    [
        ("_TPB", -120.0),
        ("_RPB", -118.0),
        ("_TEB", 2.0),
        ("_TDB", 77.0),
        ("_TVB", -500.0),
        ("_TTB", 10.0),
        ("_SCB", 4.0),
        ("_BGB", 1.0),
        ("_MOB", 1.0),
        ("_LFB", 0.0),  # 0 is active, as the operand has it
        ("_LRB", 1.0),
        ("_ZAB", 9.0),
        ("_TPY", -120.0),
        ("@IN[1]", 1.0),
        ("@IN[2]", 0.0),
        ("@IN[8]", 1.0),
        ("@IN[10]", 1.0),
        ("@OUT[3]", 1.0),
        ("@OUT[4]", 0.0),
    ],
)
def test_a_record_holds_the_channel(channel: str, value: float) -> None:
    read = reading(channel, 3)
    assert read is not None
    assert read(RECORD) == pytest.approx(value, rel=1e-4)


@pytest.mark.parametrize("channel", ["_TPD", "_KPA", "@IN[0]", "@IN[81]", "@AN[1]", "TIME", "count", "_TPA+1", "_TP"])
def test_missing_channels_of_a_record_are_requested(channel: str) -> None:
    assert reading(channel, 3) is None


@pytest.mark.parametrize(
    ("channel", "meant"),
    [
        ("_TPA", "counts"),
        ("_TVC", "counts/s"),
        ("_ACA", "counts/s²"),
        ("_TTB", "V"),
        ("@AN[1]", "V"),
        ("TIME", "samples"),
        ("_AVS", "counts"),
        ("_BGA", ""),
        ("_TPA-_TPB", ""),
        ("count", ""),
    ],
)
def test_units(channel: str, meant: str) -> None:
    assert unit(channel) == meant


@pytest.mark.parametrize(
    ("channel", "meant"),
    [
        ("_TPA", "position"),
        ("_TEA", "following error"),
        ("_TTB", "motor command"),
        ("@AN[1]", "analog input"),
        ("x", "value"),
    ],
)
def test_quantities(channel: str, meant: str) -> None:
    assert quantity(channel) == meant


def test_default_channels() -> None:
    assert columns(2) == ("_TPA", "_TEA", "_TVA", "_TTA", "_TPB", "_TEB", "_TVB", "_TTB")


def test_clock_continues_over_the_wrap_of_its_sixteen_bits() -> None:
    clock = SampleClock()
    assert [clock.at(sample) for sample in (65024, 0, 1024, 1024)] == [0.0, 0.5, 1.5, 1.5]


def test_second_has_fewer_samples_if_each_takes_longer() -> None:
    clock = SampleClock(period=2000.0)
    assert [clock.at(0), clock.at(1024)] == [0.0, 2.0]
