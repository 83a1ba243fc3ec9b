"""Records by the names that gclib has for their fields."""

from __future__ import annotations

import pytest

from dmc41x3.gclib.api import GDataRecord
from dmc41x3.language.record import AxisRecord, DataRecord, PlaneRecord, encode

OFFSETS = {
    "header_0": 0,
    "sample_number": 4,
    "input_bank_0": 6,
    "input_bank_9": 15,
    "output_bank_0": 16,
    "reserved_0": 26,
    "reserved_14": 40,
    "ethernet_status_a": 42,
    "error_code": 50,
    "thread_status": 51,
    "amplifier_status": 52,
    "contour_segment_count": 56,
    "contour_buffer_available": 60,
    "s_plane_segment_count": 62,
    "s_distance": 66,
    "t_plane_segment_count": 72,
    "t_plane_buffer_available": 80,
    "axis_a_status": 82,
    "axis_a_variable": 114,
    "axis_b_status": 118,
    "axis_c_motor_position": 162,
    "axis_h_variable": 366,
}
"""Byte offsets that the public header gclib_record.h gives beside the names."""


def axis(number: int) -> AxisRecord:
    return AxisRecord(0x8001, 0x0C, 1, -number, number, 2, 3, -64 * number, 16383, 4, 5, 6)


WHOLE = DataRecord(
    axes=tuple(axis(number) for number in range(1, 9)),
    sample=65_000,
    inputs=(255, *range(1, 10)),
    outputs=(129, *range(1, 10)),
    handles=(2, 1, 0, 0, 0, 0, 0, 2),
    error_code=20,
    threads=0x81,
    amplifier_status=0x80000001,
    contour_segment=7,
    contour_free=511,
    s=PlaneRecord(1, 0x8000, -5, 500),
    t=PlaneRecord(2, 0, 6, 511),
)


@pytest.mark.parametrize(("name", "offset"), OFFSETS.items())
def test_field_is_at_the_offset_of_the_header(name: str, offset: int) -> None:
    data = bytearray(370)
    data[offset] = 1
    record = GDataRecord(bytes(data))
    assert getattr(record, name) == 1
    assert sum(getattr(record, field) != 0 for field in record.fields()) == 1


def test_values_are_those_of_the_record() -> None:
    record = GDataRecord(encode(WHOLE))
    assert record.sample_number == 65_000
    assert (record.input_bank_0, record.output_bank_0) == (255, 129)
    assert (record.ethernet_status_a, record.ethernet_status_b) == (2, 1)
    assert (record.error_code, record.thread_status, record.amplifier_status) == (20, 0x81, 0x80000001)
    assert (record.s_plane_move_status, record.s_distance, record.t_distance) == (0x8000, -5, 6)
    assert [getattr(record, f"axis_{letter}_motor_position") for letter in "abcdefgh"] == list(range(1, 9))
    assert (record.axis_h_reference_position, record.axis_h_velocity, record.axis_h_torque) == (-8, -512, 16383)
    assert record.byte_array == encode(WHOLE)


def test_axes_that_are_not_there_have_no_fields() -> None:
    record = GDataRecord(encode(DataRecord(axes=(axis(1),) * 3)))
    assert record.axis_c_variable == 6
    assert not hasattr(record, "axis_d_status")
    assert not hasattr(record, "axis_a_temperature")
    assert record.fields()[-1] == "axis_c_variable"
    assert "axis_a_halls" in dir(record)
