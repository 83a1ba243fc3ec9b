"""The data record of a DMC-41x3 (QR), and live values by their names in the language.

Little endian; header 4, general 52, planes S and T 26, then 36 bytes for each axis: 190 for three axes. The
layout is that of the DMC-40x0 family.

A channel is anything that MG prints as one number: an operand (`_TPA`), a function (`@IN[1]`), a variable or an
expression. One record (QR) contains many channels of the same sample; MG reads the others.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from dmc41x3.errors import UnexpectedReply
from dmc41x3.language.hardware import ALIASES, LETTERS, SAMPLES

VELOCITY_SCALE = 64
"""The record contains the velocity in counts/s times this factor."""

VOLTS_SCALE = 3276.7
"""The record contains a motor command of 10 V as 32767."""

_GENERAL = struct.Struct("<BBHH10s10s16x8bBBIIHHHiHHHiH")
_AXIS = struct.Struct("<HBBiiiiiiHBxi")
_BLOCKS = 0x07  # S, T and I present
_PRESENT = 0x80


class AxisStatus:
    """Bits of an axis' status word, some of which a plane has too."""

    MOVING: Final = 1 << 15
    POSITION_MODE: Final = 1 << 14
    ABSOLUTE_MODE: Final = 1 << 13
    FINDING_EDGE: Final = 1 << 12
    HOMING: Final = 1 << 11
    HOMING_FIRST_DONE: Final = 1 << 10
    HOMING_SECOND_DONE: Final = 1 << 9
    COORDINATED: Final = 1 << 8
    NEGATIVE: Final = 1 << 7
    CONTOUR: Final = 1 << 6
    SLEWING: Final = 1 << 5
    STOPPING: Final = 1 << 4
    FINAL_DECELERATION: Final = 1 << 3
    LATCH_ARMED: Final = 1 << 2
    HOMING_THIRD: Final = 1 << 1
    MOTOR_OFF: Final = 1 << 0


class AxisSwitches:
    """Bits of an axis' switches; a limit's bit is 1 while the limit is not active."""

    LATCHED: Final = 1 << 7
    LATCH_INPUT: Final = 1 << 6
    FORWARD_INACTIVE: Final = 1 << 3
    REVERSE_INACTIVE: Final = 1 << 2
    HOME_INPUT: Final = 1 << 1
    STEPPER: Final = 1 << 0


@dataclass(frozen=True, slots=True)
class AxisRecord:
    """One axis. Positions and `error` are in counts; the fields named raw are in the record's units."""

    status: int = 0
    switches: int = AxisSwitches.FORWARD_INACTIVE | AxisSwitches.REVERSE_INACTIVE
    stop_code: int = 0
    reference: int = 0
    position: int = 0
    error: int = 0
    auxiliary: int = 0
    velocity_raw: int = 0
    torque_raw: int = 0
    analog: int = 0
    hall: int = 0
    user: int = 0

    @property
    def moving(self) -> bool:
        """Whether the axis' profile is under way."""
        return bool(self.status & AxisStatus.MOVING)

    @property
    def motor_off(self) -> bool:
        """Whether the motor is off."""
        return bool(self.status & AxisStatus.MOTOR_OFF)

    @property
    def coordinated(self) -> bool:
        """Whether the axis takes part in a coordinated motion."""
        return bool(self.status & AxisStatus.COORDINATED)

    @property
    def stopping(self) -> bool:
        """Whether the axis brakes because of ST or a limit."""
        return bool(self.status & AxisStatus.STOPPING)

    @property
    def forward_limit_active(self) -> bool:
        """Whether the forward limit switch is active; its bit is then 0."""
        return not self.switches & AxisSwitches.FORWARD_INACTIVE

    @property
    def reverse_limit_active(self) -> bool:
        """Whether the reverse limit switch is active; its bit is then 0."""
        return not self.switches & AxisSwitches.REVERSE_INACTIVE

    @property
    def velocity(self) -> float:
        """Filtered velocity [counts/s]."""
        return self.velocity_raw / VELOCITY_SCALE

    @property
    def torque(self) -> float:
        """Motor command [V]."""
        return self.torque_raw / VOLTS_SCALE


@dataclass(frozen=True, slots=True)
class PlaneRecord:
    """One coordinate plane, S or T: segments done, status word, distance [counts], free places of the buffer."""

    segment: int = 0
    status: int = 0
    distance: int = 0
    free: int = 511

    @property
    def moving(self) -> bool:
        """Whether a sequence is under way."""
        return bool(self.status & AxisStatus.MOVING)

    @property
    def stopping(self) -> bool:
        """Whether the sequence brakes because of ST or a limit."""
        return bool(self.status & AxisStatus.STOPPING)


@dataclass(frozen=True, slots=True)
class DataRecord:
    """A whole record. `sample` is the low half of TIME; `inputs` and `outputs` are banks of eight bits each.

    `handles` are the states of the Ethernet handles A to H (0 is free), `threads` has a bit for each running
    thread, `amplifier_status` is TA3, TA2, TA1, TA0 from the low byte up, 0 without errors.
    """

    axes: tuple[AxisRecord, ...]
    sample: int = 0
    inputs: tuple[int, ...] = (255,) + (0,) * 9
    outputs: tuple[int, ...] = (0,) * 10
    handles: tuple[int, ...] = (0,) * 8
    error_code: int = 0
    threads: int = 0
    amplifier_status: int = 0
    contour_segment: int = 0
    contour_free: int = 511
    s: PlaneRecord = PlaneRecord()
    t: PlaneRecord = PlaneRecord()

    def output(self, bit: int) -> bool:
        """Return whether digital output `bit` (from 1, as SB counts them) is set."""
        return bool(self.outputs[(bit - 1) // 8] >> (bit - 1) % 8 & 1)

    @classmethod
    def decode(cls, data: bytes) -> DataRecord:
        """Return the record in `data`; see the function `decode`."""
        return decode(data)

    def encode(self) -> bytes:
        """Return the record's bytes; see the function `encode`."""
        return encode(self)


def record_length(axes: int) -> int:
    """Return the length [bytes] of the record of a controller with `axes` axes."""
    return _GENERAL.size + _AXIS.size * axes


def decode(data: bytes) -> DataRecord:
    """Return the record in `data`, which includes the header and excludes the prompt.

    Raises `UnexpectedReply` if length and header disagree, or if a block is missing: a partial record (`QR ABI`) is not
    supported.
    """
    count = data[1].bit_count() if len(data) >= _GENERAL.size else -1
    whole = count >= 0 and data[0] & _BLOCKS == _BLOCKS and data[1] == (1 << count) - 1
    if not whole or not len(data) == record_length(count) == int.from_bytes(data[2:4], "little"):
        raise UnexpectedReply(command="QR", reply=data[:16].hex(" "))
    head = _GENERAL.unpack_from(data)
    return DataRecord(
        axes=tuple(AxisRecord(*fields) for fields in _AXIS.iter_unpack(data[_GENERAL.size :])),
        sample=head[3],
        inputs=tuple(head[4]),
        outputs=tuple(head[5]),
        handles=head[6:14],
        error_code=head[14],
        threads=head[15],
        amplifier_status=head[16],
        contour_segment=head[17],
        contour_free=head[18],
        s=PlaneRecord(*head[19:23]),
        t=PlaneRecord(*head[23:27]),
    )


def encode(record: DataRecord) -> bytes:
    """Return the bytes of a whole record, without prompt. Every field must be in the range of its type."""
    head: tuple[int | bytes, ...] = (
        record.sample,
        bytes(record.inputs),
        bytes(record.outputs),
        *record.handles,
        record.error_code,
        record.threads,
        record.amplifier_status,
        record.contour_segment,
        record.contour_free,
        *_plane_fields(record.s),
        *_plane_fields(record.t),
    )
    return assemble(head, [_axis_fields(axis) for axis in record.axes])


def assemble(head: Sequence[int | bytes], axes: Sequence[Sequence[int]]) -> bytes:
    """Return the bytes of a whole record from its fields: those of the head, then those of every axis.

    The fields have the order of the wire, which is that of `DataRecord` (each plane as its four fields) and
    `AxisRecord`; the banks of inputs and outputs are ten bytes each.
    """
    count = len(axes)
    first = _GENERAL.pack(_PRESENT | _BLOCKS, (1 << count) - 1, record_length(count), *head)
    return first + b"".join([_AXIS.pack(*fields) for fields in axes])


def _plane_fields(plane: PlaneRecord) -> tuple[int, int, int, int]:
    return plane.segment, plane.status, plane.distance, plane.free


def _axis_fields(axis: AxisRecord) -> tuple[int, ...]:
    return (
        axis.status,
        axis.switches,
        axis.stop_code,
        axis.reference,
        axis.position,
        axis.error,
        axis.auxiliary,
        axis.velocity_raw,
        axis.torque_raw,
        axis.analog,
        axis.hall,
        axis.user,
    )


_OPERAND = re.compile(r"_([A-Z]{2})([A-HXYZW])")
_BIT = re.compile(r"@(IN|OUT)\[([0-9]{1,2})\]")

Reading = Callable[[DataRecord], float]
"""Reads a channel from a record."""

_FROM_AXIS: MappingProxyType[str, Callable[[AxisRecord], float]] = MappingProxyType(
    {
        "TP": lambda axis: axis.position,
        "RP": lambda axis: axis.reference,
        "TE": lambda axis: axis.error,
        "TD": lambda axis: axis.auxiliary,
        "TV": lambda axis: axis.velocity,
        "TT": lambda axis: axis.torque,
        "SC": lambda axis: axis.stop_code,
        "BG": lambda axis: axis.moving,
        "MO": lambda axis: axis.motor_off,
        "LF": lambda axis: not axis.forward_limit_active,
        "LR": lambda axis: not axis.reverse_limit_active,
        "ZA": lambda axis: axis.user,
    }
)

_KINDS = (
    ("position", "counts", "TP RP TD PA PR DP DE RL FL BL IP LE AV VP"),
    ("following error", "counts", "TE ER"),
    ("velocity", "counts/s", "TV SP JG HV VS VV VM"),
    ("acceleration", "counts/s²", "AC DC SD VA VD"),
    ("motor command", "V", "TT TL TK OF IL"),
)
_KIND = MappingProxyType({name: (what, meant) for what, meant, names in _KINDS for name in names.split()})


def unit(channel: str) -> str:
    """Return the unit of a channel, empty for a plain number and for expressions, whose unit is unknown."""
    return _kind(channel)[1]


def quantity(channel: str) -> str:
    """Return the quantity of a channel, such as `position`; `value` if it is unknown."""
    return _kind(channel)[0]


def _kind(channel: str) -> tuple[str, str]:
    if channel == "TIME":
        return "time of the controller", "samples"
    if re.fullmatch(r"@AN\[.*\]", channel):
        return "analog input", "V"
    found = re.fullmatch(r"_([A-Z]{2})\w?", channel)
    return _KIND.get(found[1], ("value", "")) if found is not None else ("value", "")


def reading(channel: str, axes: int) -> Reading | None:
    """Return the function that reads `channel` from a record of `axes` axes, None if the record does not contain it.

    Digital inputs and outputs are those of the first two banks (DMC-41x3: 1 to 16).
    """
    if found := _OPERAND.fullmatch(channel):
        return _axis_reading(found[1], LETTERS.index(found[2].translate(ALIASES)), axes)
    if (found := _BIT.fullmatch(channel)) and 1 <= int(found[2]) <= 16:
        return _bit_reading(found[1], int(found[2]) - 1)
    return None


def _axis_reading(name: str, axis: int, axes: int) -> Reading | None:
    field = _FROM_AXIS.get(name)
    if field is None or axis >= axes:
        return None
    return lambda record: float(field(record.axes[axis]))


def _bit_reading(name: str, bit: int) -> Reading:
    def read(record: DataRecord) -> float:
        banks = record.inputs if name == "IN" else record.outputs
        return float(banks[bit // 8] >> bit % 8 & 1)

    return read


def columns(axes: int) -> tuple[str, ...]:
    """Return the channels to watch by default: position, error, velocity, torque of every axis."""
    return tuple(f"_{name}{letter}" for letter in LETTERS[:axes] for name in ("TP", "TE", "TV", "TT"))


class SampleClock:
    """Time of records [s] from their sample numbers, of which only the low 16 bits are sent.

    `period` is TM [µs]: 1000 means 1024 samples in a second (DMC-41x3, command TM). Records must be less than
    32 s apart, which is half of what 16 bits count.
    """

    def __init__(self, period: float = 1000.0) -> None:
        self._second = SAMPLES * 1000.0 / period
        self._last: int | None = None
        self._passed = 0

    def at(self, sample: int) -> float:
        """Return the time of `sample` [s] since the sample of the first call; call it in the order of the samples."""
        if self._last is not None:
            self._passed += (sample - self._last) % (1 << 16)
        self._last = sample
        return self._passed / self._second
