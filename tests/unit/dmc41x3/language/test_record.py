"""Every field at its byte, worked from the layout by hand."""

from __future__ import annotations

import struct

import pytest

from dmc41x3.errors import UnexpectedReply
from dmc41x3.language.record import (
    AxisRecord,
    AxisStatus,
    AxisSwitches,
    DataRecord,
    PlaneRecord,
    decode,
    encode,
    record_length,
)

EMPTY = encode(DataRecord(axes=(AxisRecord(),) * 3))


def poked(offset: int, form: str, value: int) -> DataRecord:
    data = bytearray(EMPTY)
    struct.pack_into("<" + form, data, offset, value)
    return decode(bytes(data))


@pytest.mark.parametrize(("axes", "length"), [(1, 118), (3, 190), (4, 226), (8, 370)])
def test_lengths(axes: int, length: int) -> None:
    assert record_length(axes) == length
    assert len(encode(DataRecord(axes=(AxisRecord(),) * axes))) == length


def test_header() -> None:
    assert EMPTY[:4] == b"\x87\x07\xbe\x00"


def test_the_header_bit_that_not_all_controllers_set_may_be_missing() -> None:
    assert decode(b"\x07" + EMPTY[1:]) == decode(EMPTY)


@pytest.mark.parametrize(
    ("offset", "form", "value", "path"),
    [
        (4, "H", 40000, "sample"),
        (50, "B", 22, "error_code"),
        (51, "B", 3, "threads"),
        (52, "I", 0x01020304, "amplifier_status"),
        (56, "I", 70000, "contour_segment"),
        (60, "H", 31, "contour_free"),
        (62, "H", 7, "s.segment"),
        (64, "H", 0x8010, "s.status"),
        (66, "i", -5, "s.distance"),
        (70, "H", 500, "s.free"),
        (72, "H", 8, "t.segment"),
        (74, "H", 9, "t.status"),
        (76, "i", -6, "t.distance"),
        (80, "H", 501, "t.free"),
    ],
)
def test_fields_of_the_whole(offset: int, form: str, value: int, path: str) -> None:
    found: object = poked(offset, form, value)
    for name in path.split("."):
        found = getattr(found, name)
    assert found == value


@pytest.mark.parametrize(
    ("offset", "form", "field", "place"),
    [
        (6, "B", "inputs", 0),
        (15, "B", "inputs", 9),
        (16, "B", "outputs", 0),
        (42, "b", "handles", 0),
        (49, "b", "handles", 7),
    ],
)
def test_banks_and_handles(offset: int, form: str, field: str, place: int) -> None:
    assert getattr(poked(offset, form, 77), field)[place] == 77


def test_a_handle_of_our_own_is_negative() -> None:
    assert poked(43, "b", -2).handles[1] == -2


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("offset", "form", "value", "field"),
    [
        (0, "H", 0x8100, "status"),
        (2, "B", 0x0C, "switches"),
        (3, "B", 101, "stop_code"),
        (4, "i", -100000, "reference"),
        (8, "i", 100001, "position"),
        (12, "i", -7, "error"),
        (16, "i", 8, "auxiliary"),
        (20, "i", -64 * 45000, "velocity_raw"),
        (24, "i", 32767, "torque_raw"),
        (28, "H", 65535, "analog"),
        (30, "B", 5, "hall"),
        (32, "i", -9, "user"),
    ],
)
def test_fields_of_an_axis(axis: int, offset: int, form: str, value: int, field: str) -> None:
    record = poked(82 + 36 * axis + offset, form, value)
    assert getattr(record.axes[axis], field) == value


def test_encode_is_the_inverse_of_decode() -> None:
    record = DataRecord(
        axes=tuple(AxisRecord(*range(base, base + 12)) for base in (1, 21, 41)),
        sample=1,
        inputs=tuple(range(10)),
        outputs=tuple(range(10, 20)),
        handles=(1, 2, -1, -2, -5, -6, 0, 0),
        error_code=6,
        threads=255,
        amplifier_status=1 << 31,
        s=PlaneRecord(1, 2, 3, 4),
        t=PlaneRecord(5, 6, 7, 8),
    )
    assert DataRecord.decode(record.encode()) == record


def test_status_bits() -> None:
    axis = AxisRecord(status=AxisStatus.MOVING | AxisStatus.COORDINATED | AxisStatus.STOPPING)
    assert (axis.moving, axis.coordinated, axis.stopping, axis.motor_off) == (True, True, True, False)
    assert AxisRecord(status=AxisStatus.MOTOR_OFF).motor_off
    plane = PlaneRecord(status=0x8010)
    assert (plane.moving, plane.stopping) == (True, True)
    assert not PlaneRecord().moving


def test_limit_is_active_if_its_bit_is_zero() -> None:
    assert not AxisRecord().forward_limit_active
    at_forward = AxisRecord(switches=AxisSwitches.REVERSE_INACTIVE)
    assert (at_forward.forward_limit_active, at_forward.reverse_limit_active) == (True, False)


def test_velocity_and_torque_have_scales_of_their_own() -> None:
    axis = AxisRecord(velocity_raw=-64 * 45000, torque_raw=-32767)
    assert axis.velocity == -45000.0
    assert axis.torque == pytest.approx(-10.0)


def test_outputs_count_from_one() -> None:
    record = DataRecord(axes=(), outputs=(0b100, 0b1, *(0,) * 8))
    assert [bit for bit in range(1, 17) if record.output(bit)] == [3, 9]


@pytest.mark.parametrize(
    "data",
    [
        b"",
        EMPTY[:-1],
        EMPTY + b"\0",
        b"\x86" + EMPTY[1:],
        EMPTY[:1] + b"\x05" + EMPTY[2:],
        EMPTY[:2] + b"\xbd" + EMPTY[3:],
    ],
    ids=["empty", "short", "long", "no S block", "an axis missing", "another length"],
)
def test_incomplete_record_is_refused(data: bytes) -> None:
    with pytest.raises(UnexpectedReply):
        decode(data)
