"""What the controller reports of itself in bits: TS, the status words, and the data record of QR."""

from __future__ import annotations

from maya_un.galil.record import (
    VELOCITY_SCALE,
    VOLTS_SCALE,
    AxisRecord,
    DataRecord,
    PlaneRecord,
    Status,
    Switch,
    encode,
)
from maya_un.virtual import homing
from maya_un.virtual.axis import Axis, Kind
from maya_un.virtual.latch import input_of
from maya_un.virtual.plane import Plane
from maya_un.virtual.unit import Unit

GENERAL, COORDINATE, AXIS = 52, 26, 36
"""Sizes of the record's blocks [bytes], as QZ tells them."""

INPUT_BANKS = (0, 1, 10, 11)
"""What TI knows: general inputs 1 to 16, and inputs 81 to 96, two for the auxiliary encoder of each axis."""

_AUXILIARY_BANK = 10
_PROGRAM_RUNS, _IN_ERROR_ROUTINE, _INTERRUPTS_ARMED, _IN_INPUT_ROUTINE = 1 << 7, 1 << 4, 1 << 3, 1 << 2
_CONTOURING = 1 << 5
_INPUT_ROUTINE = "ININT"
_HEADER = 4
_CONTOUR, _S, _T = slice(56, 62), slice(62, 72), slice(72, 82)
_FIRST_AXIS = _HEADER + GENERAL + COORDINATE

_POSITION_ERROR, _IN_MOTION = 1 << 6, 1 << 7
_MOTOR_OFF, _FORWARD_INACTIVE, _REVERSE_INACTIVE, _HOME, _NOT_LATCHING = 1 << 5, 1 << 3, 1 << 2, 1 << 1, 1


def switches_byte(unit: Unit, axis: Axis) -> int:
    """Return the byte of TS."""
    core = unit.core
    limit = axis.registers["ER"]
    return (
        _IN_MOTION * axis.moving
        | _POSITION_ERROR * (0 <= limit < abs(core.error(axis)))
        | _MOTOR_OFF * (not axis.on)
        | _FORWARD_INACTIVE * (not core.limit_active(axis, True))
        | _REVERSE_INACTIVE * (not core.limit_active(axis, False))
        | _HOME * core.home_state(axis)
        | _NOT_LATCHING * (not axis.latch_armed)
    )


def distance_set(unit: Unit, axis: Axis) -> int:
    """Return what `PR ?` shows: the distance set, or the one that a PA implies."""
    if axis.kind is Kind.ABSOLUTE:
        return axis.destination - axis.reference(unit.core.now)
    return axis.distance


def corner(unit: Unit, axis: Axis) -> int:
    """Return `_VP`: where the segment under way began for this axis, or where the axis last stopped."""
    plane = unit.core.planes.get(axis.plane)
    return axis.last_stop if plane is None else plane.corner(axis.index, unit.core.now) + axis.offset


def output_bank(unit: Unit, bank: int) -> int:
    """Return eight digital outputs as one number."""
    return sum(on << bit for bit, on in enumerate(unit.outputs[8 * bank : 8 * bank + 8]))


def input_bank(unit: Unit, bank: int) -> int:
    """Return eight digital inputs as one number: banks 0 and 1, or 10 and 11 of the auxiliary encoders' inputs."""
    levels = unit.inputs if bank < _AUXILIARY_BANK else [True] * (2 * len(unit.axes))
    first = 8 * (bank % _AUXILIARY_BANK)
    return sum(level << bit for bit, level in enumerate(levels[first : first + 8]))


def program_byte(unit: Unit) -> int:
    """Return the byte of TB: what the program does, and whether axes contour."""
    first = unit.threads.all[0]
    return (
        _PROGRAM_RUNS * bool(unit.threads.mask)
        | _IN_ERROR_ROUTINE * (first.routine not in ("", _INPUT_ROUTINE))
        | _INTERRUPTS_ARMED * (unit.threads.interrupts is not None)
        | _IN_INPUT_ROUTINE * (first.routine == _INPUT_ROUTINE)
        | _CONTOURING * unit.core.contour.running
        | unit.echo
    )


def amplifier_byte(unit: Unit, number: int) -> int:
    """Return the byte of TA 0 to TA 3."""
    return unit.core.amplifier_status >> 8 * (3 - number) & 0xFF


def address_bytes(host: str) -> tuple[int, int, int, int]:
    """Return the four bytes of an address, zeros for a host known by another kind of name."""
    parts = host.split(".")
    numbers = [int(part) for part in parts if part.isdecimal() and part.isascii() and int(part) < 256]
    return (numbers[0], numbers[1], numbers[2], numbers[3]) if len(numbers) == len(parts) == 4 else (0, 0, 0, 0)


def snapshot(unit: Unit) -> DataRecord:
    """Return the data record of this instant."""
    inputs = (255, 255 if len(unit.axes) > 4 else 0)
    return DataRecord(
        axes=tuple(_axis(unit, axis) for axis in unit.axes),
        sample=unit.time & 0xFFFF,
        inputs=inputs + (0,) * 8,
        outputs=tuple(output_bank(unit, bank) for bank in range(10)),
        handles=unit.handles.states(),
        error_code=unit.error_code,
        threads=unit.threads.mask,
        amplifier_status=unit.core.amplifier_status,
        contour_segment=unit.core.contour.count(unit.core.now),
        contour_free=unit.core.contour.free(unit.core.now),
        s=_plane(unit, unit.core.planes["S"]),
        t=_plane(unit, unit.core.planes["T"]),
    )


def record(unit: Unit, blocks: str = "") -> bytes:
    """Return the data record's bytes; with `blocks` only those named (axes, S, T, I).

    In a partial record the contour words go with block I; the reference does not settle where they belong.
    """
    whole = encode(snapshot(unit))
    if not blocks:
        return whole
    parts: list[bytes] = []
    if "I" in blocks:
        parts += [whole[_HEADER : _HEADER + GENERAL], whole[_CONTOUR]]
    parts += [whole[_S]] * ("S" in blocks) + [whole[_T]] * ("T" in blocks)
    present = 0
    for axis in unit.axes:
        if axis.letter in blocks:
            present |= 1 << axis.index
            start = _FIRST_AXIS + AXIS * axis.index
            parts.append(whole[start : start + AXIS])
    flags = 0x80 | ("I" in blocks) << 2 | ("T" in blocks) << 1 | ("S" in blocks)
    body = b"".join(parts)
    return bytes((flags, present)) + (len(body) + _HEADER).to_bytes(2, "little") + body


def _axis(unit: Unit, axis: Axis) -> AxisRecord:
    core = unit.core
    return AxisRecord(
        status=_status_word(unit, axis),
        switches=Switch.FORWARD_INACTIVE * (not core.limit_active(axis, True))
        | Switch.REVERSE_INACTIVE * (not core.limit_active(axis, False))
        | Switch.HOME_INPUT * core.home_state(axis)
        | Switch.STEPPER * axis.stepper
        | Switch.LATCHED * axis.latch_tripped
        | Switch.LATCH_INPUT * _latch_input(unit, axis),
        stop_code=core.stop_code(axis),
        reference=_long(axis.reference(core.now)),
        position=_long(core.position(axis)),
        error=_long(core.error(axis)),
        auxiliary=_long(core.auxiliary(axis)),
        velocity_raw=_long(round(VELOCITY_SCALE * core.velocity(axis))),
        torque_raw=_long(round(VOLTS_SCALE * core.torque(axis))),
        user=int(axis.registers["ZA"]),
    )


def _latch_input(unit: Unit, axis: Axis) -> bool:
    place = input_of(axis) - 1
    return place < len(unit.inputs) and unit.inputs[place]


def _status_word(unit: Unit, axis: Axis) -> int:
    word = Status.MOTOR_OFF * (not axis.on) | Status.LATCH_ARMED * axis.latch_armed
    if not axis.moving:
        return word
    word |= Status.MOVING | Status.NEGATIVE * (axis.heading(unit.core.now) < 0)
    if axis.plane in unit.core.planes:
        return word | Status.COORDINATED | _phase(unit.core.planes[axis.plane], unit.core.now)
    if axis.plane:
        return word | Status.CONTOUR * (axis.plane == unit.core.contour.letter)
    return word | _motion_bits(unit, axis)


def _motion_bits(unit: Unit, axis: Axis) -> int:
    motion, now = axis.motion, unit.core.now
    if motion is None:
        return 0
    v, soon = axis.timeline.at(now)[1], axis.timeline.at(now + 1e-6)[1]
    return (
        Status.POSITION_MODE * motion.positions
        | Status.ABSOLUTE_MODE * (motion.kind is Kind.ABSOLUTE)
        | Status.FINDING_EDGE * (motion.kind is Kind.FIND_EDGE)
        | Status.HOMING * (motion.kind is Kind.HOME)
        | Status.HOMING_FIRST_DONE * (motion.kind is Kind.HOME and motion.stage >= homing.RETURNING)
        | Status.HOMING_SECOND_DONE * (motion.kind in homing.KINDS and motion.stage >= homing.TO_INDEX)
        | Status.HOMING_THIRD * (motion.kind is Kind.HOME and motion.stage >= homing.TO_INDEX)
        | Status.SLEWING * (v == soon != 0.0)
        | Status.STOPPING * motion.stopping
        | Status.FINAL_DECELERATION * (now >= motion.profile.braking)
    )


def _plane(unit: Unit, plane: Plane) -> PlaneRecord:
    now = unit.core.now
    return PlaneRecord(
        segment=plane.count(now) & 0xFFFF,
        status=Status.MOVING | _phase(plane, now) if plane.running else 0,
        distance=_long(round(plane.distance(now))),
        free=plane.free(now),
    )


def _phase(plane: Plane, now: float) -> int:
    slewing, final = plane.slewing(now)
    return (
        Status.SLEWING * slewing
        | Status.STOPPING * plane.stopping
        | Status.FINAL_DECELERATION * (final or plane.stopping)
    )


def _long(value: int) -> int:
    """Return a counter within the record's 32 bits."""
    return max(-(1 << 31), min((1 << 31) - 1, value))
