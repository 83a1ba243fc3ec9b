"""What the controller reports of itself in bits: TS, the status words, and the data record of QR."""

from __future__ import annotations

from dmc41x3.language.record import VELOCITY_SCALE, VOLTS_SCALE, AxisStatus, assemble
from dmc41x3.twin.motion import independent
from dmc41x3.twin.motion.axis import Axis, MotionKind
from dmc41x3.twin.motion.monitors import input_of
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.unit import Unit

GENERAL, COORDINATE, AXIS = 52, 26, 36
"""Sizes of the record's blocks [bytes], as QZ tells them."""

INPUT_BANKS = (0, 1, 10, 11)
"""What TI knows: general inputs 1 to 16, and inputs 81 to 96, two for the auxiliary encoder of each axis."""

AUXILIARY_BANK = 10
"""The first bank of the auxiliary encoders' inputs."""

_PROGRAM_RUNS, _IN_ERROR_ROUTINE, _INTERRUPTS_ARMED, _IN_INPUT_ROUTINE = 1 << 7, 1 << 4, 1 << 3, 1 << 2
_CONTOURING = 1 << 5
_INPUT_ROUTINE = "ININT"
_HEADER = 4
_CONTOUR, _S, _T = slice(56, 62), slice(62, 72), slice(72, 82)
_LEAST, _MOST = -(1 << 31), (1 << 31) - 1
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
    if axis.kind is MotionKind.ABSOLUTE:
        return axis.destination - axis.reference(unit.core.now)
    return axis.distance


def corner(unit: Unit, axis: Axis) -> int:
    """Return `_VP`: where the segment under way began for this axis, or where the axis last stopped."""
    plane = unit.core.planes.get(axis.plane)
    return axis.last_stop if plane is None else plane.corner(axis.index, unit.core.now) + axis.offset


def output_bank(unit: Unit, bank: int) -> int:
    """Return eight digital outputs as one number."""
    return _number(unit.outputs[8 * bank : 8 * bank + 8])


def input_bank(unit: Unit, bank: int) -> int:
    """Return eight digital inputs as one number: banks 0 and 1, or 10 and 11 of the auxiliary encoders' inputs."""
    levels = unit.inputs if bank < AUXILIARY_BANK else [True] * (2 * len(unit.axes))
    first = 8 * (bank % AUXILIARY_BANK)
    return _number(levels[first : first + 8])


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


def record(unit: Unit, blocks: str = "") -> bytes:
    """Return the data record's bytes; with `blocks` only those named (axes, S, T, I).

    In a partial record the contour words go with block I; the reference does not settle where they belong.
    """
    whole = assemble(_head(unit), [_axis(unit, axis) for axis in unit.axes])
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


def _head(unit: Unit) -> list[int | bytes]:
    """Return the fields of the record up to the first axis."""
    core, now = unit.core, unit.core.now
    banks = 1 if len(unit.outputs) <= 8 else 2
    return [
        unit.time & 0xFFFF,
        bytes([input_bank(unit, bank) for bank in range(banks)]).ljust(10, b"\0"),
        bytes([output_bank(unit, bank) for bank in range(banks)]).ljust(10, b"\0"),
        *unit.handles.states(),
        unit.error_code,
        unit.threads.mask,
        core.amplifier_status,
        core.contour.count(now),
        core.contour.free(now),
        *_plane(core.planes["S"], now),
        *_plane(core.planes["T"], now),
    ]


def _axis(unit: Unit, axis: Axis) -> tuple[int, ...]:
    """Return the fields of an axis in the order of `AxisRecord`."""
    core = unit.core
    place = axis.timeline.at(core.now)[0]
    position, velocity = core.encoders[axis.index].reading(core.now, place)
    reference, stepper = round(place) + axis.offset, axis.stepper
    return (
        _status_word(unit, axis),
        _switches(unit, axis, stepper),
        core.stop_code(axis),
        _long(reference),
        _long(position),
        0 if stepper else _long(reference - position),
        _long(reference if stepper else axis.auxiliary),
        _long(round(VELOCITY_SCALE * velocity)) if velocity else 0,
        round(VOLTS_SCALE * core.torque(axis)),
        0,
        0,
        int(axis.registers["ZA"]),
    )


def _switches(unit: Unit, axis: Axis, stepper: bool) -> int:
    core, inputs = unit.core, unit.inputs
    forward, reverse, home = core.plant.inputs(axis.index)
    active, high, latch = core.cn[0] == 1, core.cn[1] == -1, input_of(axis) - 1
    return (
        axis.latch_tripped << 7
        | (latch < len(inputs) and inputs[latch]) << 6
        | (forward != active) << 3
        | (reverse != active) << 2
        | (home == high) << 1
        | stepper
    )


def _status_word(unit: Unit, axis: Axis) -> int:
    word = AxisStatus.MOTOR_OFF * (not axis.on) | AxisStatus.LATCH_ARMED * axis.latch_armed
    if not axis.moving:
        return word
    word |= AxisStatus.MOVING | AxisStatus.NEGATIVE * (axis.heading(unit.core.now) < 0)
    if axis.plane in unit.core.planes:
        return word | AxisStatus.COORDINATED | _phase(unit.core.planes[axis.plane], unit.core.now)
    if axis.plane:
        return word | AxisStatus.CONTOUR * (axis.plane == unit.core.contour.letter)
    return word | _motion_bits(unit, axis)


def _motion_bits(unit: Unit, axis: Axis) -> int:
    motion, now = axis.motion, unit.core.now
    if motion is None:
        return 0
    v, soon = axis.timeline.at(now)[1], axis.timeline.at(now + 1e-6)[1]
    return (
        AxisStatus.POSITION_MODE * motion.positions
        | AxisStatus.ABSOLUTE_MODE * (motion.kind is MotionKind.ABSOLUTE)
        | AxisStatus.FINDING_EDGE * (motion.kind is MotionKind.FIND_EDGE)
        | AxisStatus.HOMING * (motion.kind is MotionKind.HOME)
        | AxisStatus.HOMING_FIRST_DONE * (motion.kind is MotionKind.HOME and motion.stage >= independent.RETURNING)
        | AxisStatus.HOMING_SECOND_DONE
        * (motion.kind in independent.HOMING_KINDS and motion.stage >= independent.TO_INDEX)
        | AxisStatus.HOMING_THIRD * (motion.kind is MotionKind.HOME and motion.stage >= independent.TO_INDEX)
        | AxisStatus.SLEWING * (v == soon != 0.0)
        | AxisStatus.STOPPING * motion.stopping
        | AxisStatus.FINAL_DECELERATION * (now >= motion.profile.braking)
    )


def _plane(plane: Plane, now: float) -> tuple[int, int, int, int]:
    """Return the fields of a plane in the order of `PlaneRecord`."""
    return (
        plane.count(now) & 0xFFFF,
        AxisStatus.MOVING | _phase(plane, now) if plane.running else 0,
        _long(round(plane.distance(now))),
        plane.free(now),
    )


def _phase(plane: Plane, now: float) -> int:
    slewing, final = plane.slewing(now)
    return (
        AxisStatus.SLEWING * slewing
        | AxisStatus.STOPPING * plane.stopping
        | AxisStatus.FINAL_DECELERATION * (final or plane.stopping)
    )


def _number(levels: list[bool]) -> int:
    """Return bits, the lowest first, as one number."""
    number = 0
    for level in reversed(levels):
        number = number << 1 | level
    return number


def _long(value: int) -> int:
    """Return a counter within the record's 32 bits."""
    return value if _LEAST <= value <= _MOST else _LEAST if value < 0 else _MOST
