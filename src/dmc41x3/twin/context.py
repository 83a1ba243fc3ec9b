"""The context of a command: operands (`_TPA`, `_SCB`, `TIME`), variables, and the reports of status bits.

The reports of status bits are TS, the status words, and the data record of QR.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import ALIASES, LETTERS
from dmc41x3.language.numbers import RAW_MAX, RAW_MIN, fixed
from dmc41x3.language.record import VELOCITY_SCALE, VOLTS_SCALE, AxisStatus, assemble
from dmc41x3.twin import network, registers
from dmc41x3.twin.expressions import ONE, Rejection, evaluate, unpack
from dmc41x3.twin.memory import MOST_ARRAYS
from dmc41x3.twin.motion import independent
from dmc41x3.twin.motion.axis import Axis, MotionKind
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.monitors import input_of, step_error
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.network import Handle
from dmc41x3.twin.program import MOST_LABELS, Thread
from dmc41x3.twin.unit import ANALOG_INPUTS, MOST_VARIABLES, Unit

GENERAL, COORDINATE, AXIS = 52, 26, 36
"""Sizes of the record's blocks [bytes], as QZ reports them."""

INPUT_BANKS = (0, 1, 10, 11)
"""Inputs of TI: general inputs 1 to 16, and inputs 81 to 96, two for the auxiliary encoder of each axis."""

AUXILIARY_BANK = 10
"""The first bank of the auxiliary encoders' inputs."""

_PROGRAM_RUNS, _IN_ERROR_ROUTINE, _INTERRUPTS_ARMED, _IN_INPUT_ROUTINE = 1 << 7, 1 << 4, 1 << 3, 1 << 2
_CONTOURING = 1 << 5
_INPUT_ROUTINE = "ININT"
_HEADER = 4
_CONTOUR_START, _S_START, _T_START = 56, 62, 72
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
    """Return the answer to `PR ?`: the distance set, or the one that a PA implies."""
    if axis.kind is MotionKind.ABSOLUTE:
        return axis.destination - axis.reference(unit.core.now)
    return axis.distance


def corner(unit: Unit, axis: Axis) -> int:
    """Return `_VP`: where the current segment began for this axis, or where the axis last stopped."""
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
    """Return the byte of TB: the state of the program, and whether axes contour."""
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
    """Return the four bytes of an address, zeros if the host is not an IPv4 address."""
    parts = host.split(".")
    numbers = [int(part) for part in parts if part.isdecimal() and part.isascii() and int(part) < 256]
    return (numbers[0], numbers[1], numbers[2], numbers[3]) if len(numbers) == len(parts) == 4 else (0, 0, 0, 0)


def record(unit: Unit, blocks: str = "") -> bytes:
    """Return the data record's bytes; with `blocks` only the named blocks (axes, S, T, I).

    In a partial record the contour words belong to block I; the reference does not specify their place.
    """
    whole = assemble(_head(unit), [_axis(unit, axis) for axis in unit.axes])
    if not blocks:
        return whole
    parts: list[bytes] = []
    if "I" in blocks:
        parts += [whole[_HEADER:_CONTOUR_START], whole[_CONTOUR_START:_S_START]]
    parts += [whole[_S_START:_T_START]] * ("S" in blocks) + [whole[_T_START:_FIRST_AXIS]] * ("T" in blocks)
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
    """Return a counter, limited to the record's 32 bits."""
    return value if _LEAST <= value <= _MOST else _LEAST if value < 0 else _MOST


_FIRST_AUXILIARY = 81
"""Number of the first input of an auxiliary encoder; each axis has two of them."""

_Reader = Callable[[], float]


class OperandScope:
    """The scope of expressions of one caller: a handle, or a program's thread."""

    def __init__(self, unit: Unit, caller: Handle | None = None, thread: Thread | None = None) -> None:
        self._unit = unit
        self._caller = caller
        self._calling_thread = thread
        self._readers: dict[str, _Reader] = {}

    def variable(self, name: str) -> int:
        """Return a variable (raw), also `~a` or `^a`.

        Raises `Rejection`: 9 if it was never assigned, 2 for `^a` outside a program, 55 for an array.
        """
        value = self._unit.variables.get(name)
        return self._special(name) if value is None else value

    def element(self, name: str, index: int) -> int:
        """Return an element of an array (raw), or its length for index -1; `^a` is an array whose name was passed.

        Raises `Rejection`: 57 for an unknown array, 56 for an index outside it.
        """
        return self._unit.arrays.element(self.array(name), index)

    def array(self, name: str) -> str:
        """Return the name of an array; a stack variable `^a` contains it as a string. Raises `Rejection`."""
        return unpack(self.variable(name)) if name[0] == "^" else name

    def operand(self, name: str) -> int:
        """Return an operand (raw) by its name without underscore, or TIME; raises `Rejection` for an unknown name."""
        read = self._readers.get(name)
        if read is None:
            # Only existing names are stored, so their number is limited.
            read = self._readers[name] = self._reader(name)
        value = read()
        raw = int(value * ONE)
        return raw if RAW_MIN <= raw <= RAW_MAX else fixed(value)

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN` or `@OUT` of a bit, or the volts of `@AN` (raw); raises `Rejection` (6) if it does not exist."""
        unit = self._unit
        if function == "IN" and 0 <= bit - _FIRST_AUXILIARY < 2 * len(unit.axes):
            return ONE  # idle inputs are high, and nothing is wired to these
        banks: dict[str, Sequence[float]] = {"IN": unit.inputs, "OUT": unit.outputs, "AN": unit.analog}
        values = banks[function]
        if not 1 <= bit <= len(values):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return fixed(values[bit - 1])

    def _special(self, name: str) -> int:
        if name[0] == "^" and self._calling_thread is None:
            raise Rejection(ErrorCode.PROGRAM_ONLY)
        if name in self._unit.arrays:
            raise Rejection(ErrorCode.MISSING_BRACKET)
        value = self._unit.axis_variables.get(name)
        if name[0] == "^" and self._calling_thread is not None:
            value = self._calling_thread.locals.get(name[1:])
        if value is None:
            raise Rejection(ErrorCode.VARIABLE_ERROR)
        return value

    def _reader(self, name: str) -> _Reader:
        system = _SYSTEM.get(name)
        if system is not None:
            return partial(system, self._unit)
        word, which = name[:2], name[2:]
        if word in _PLANE and (which in ("S", "T") or (not which and word not in _AXIS)):
            return self._plane_reader(_PLANE[word], which)
        if word in _AXIS or word in registers.AXIS:
            return self._axis_reader(word, self._axis(which))
        if word in registers.PLANE and which in ("S", "T", ""):
            return self._plane_reader(lambda _, plane: plane.registers[word], which)
        self._of_caller(word, which)
        return lambda: self._of_caller(word, which)

    def _axis_reader(self, word: str, axis: Axis) -> _Reader:
        if word in _AXIS and (not axis.virtual or word in _OF_VIRTUAL):
            return partial(_AXIS[word], self._unit, axis)
        if word not in axis.registers:
            raise Rejection(ErrorCode.BAD_OPERAND)
        return lambda: axis.registers[word]

    def _plane_reader(self, read: Callable[[Unit, Plane], float], which: str) -> _Reader:
        """Return the function that reads an operand of a plane, without its letter of the plane that CA selected."""
        unit = self._unit
        return lambda: read(unit, unit.core.planes[which or unit.plane])

    def _axis(self, letter: str) -> Axis:
        """Return an axis by its letter, by default the first: programs in use write `_TP` for `_TPA`."""
        letter = letter.translate(ALIASES) or "A"
        if letter in self._unit.core.virtual:
            return self._unit.core.virtual[letter]
        if len(letter) != 1 or letter not in self._unit.letters:
            raise Rejection(ErrorCode.BAD_OPERAND)
        return self._unit.axes[LETTERS.index(letter)]

    def _of_caller(self, word: str, which: str) -> float:
        if self._calling_thread is not None and not which and word == "JS":
            return self._calling_thread.returned / ONE
        if self._calling_thread is not None and word == "ED" and which == "4":
            return self._calling_thread.number
        if (word == "WH" and not which) or (word == "IA" and which == "3"):
            return -1 if self._caller is None else self._caller.index
        if word == "IH" and len(which) == 2 and which[0] in LETTERS and which[1] in "01234":
            return _handle(self._unit.handles.at(which[0]), int(which[1]))
        raise Rejection(ErrorCode.BAD_OPERAND)


def _handle(handle: Handle | None, item: int) -> float:
    """Return `_IHx0` to `_IHx4`: address, port, kind, whether ARP failed, whether a connection failed."""
    if handle is None:
        return 0
    host, port = handle.peer
    address = int.from_bytes(bytes(address_bytes(host)), "big", signed=True)
    return (address, port, handle.state, not handle.connected, handle.attempt)[item]


_Motion = Callable[[Unit, Axis], float]

_AXIS: dict[str, _Motion] = {
    "VP": corner,
    "PV": lambda unit, axis: unit.core.pvt[axis.index].free(unit.core.now),
    "BT": lambda unit, axis: unit.core.pvt[axis.index].count(unit.core.now),
    "TP": lambda unit, axis: unit.core.position(axis),
    "DP": lambda unit, axis: unit.core.position(axis),
    "RP": lambda unit, axis: axis.reference(unit.core.now),
    "TE": lambda unit, axis: unit.core.error(axis),
    "TD": lambda unit, axis: unit.core.auxiliary(axis),
    "DE": lambda unit, axis: unit.core.position(axis) if axis.stepper else axis.auxiliary,
    "TV": lambda unit, axis: round(unit.core.velocity(axis)),
    "TT": lambda unit, axis: unit.core.torque(axis),
    "TS": switches_byte,
    "SC": lambda unit, axis: unit.core.stop_code(axis),
    "BG": lambda unit, axis: axis.moving,
    "MO": lambda unit, axis: not axis.on,
    "PA": lambda unit, axis: axis.last_stop,
    "PR": distance_set,
    "JG": lambda unit, axis: abs(axis.jog_speed),
    "PT": lambda unit, axis: axis.tracking,
    "LF": lambda unit, axis: not unit.core.limit_active(axis, True),
    "LR": lambda unit, axis: not unit.core.limit_active(axis, False),
    "HM": lambda unit, axis: unit.core.home_state(axis),
    "AL": lambda unit, axis: axis.latch_armed,
    "RL": lambda unit, axis: axis.latched,
    "IP": lambda unit, axis: axis.reference(unit.core.now),
    "QS": lambda unit, axis: step_error(unit.core, axis),
    "QH": lambda unit, axis: 0,
    "BA": lambda unit, axis: axis.commutated,
    "BC": lambda unit, axis: 0,
    "BI": lambda unit, axis: 0,
    "BX": lambda unit, axis: axis.initialised,
    "BZ": lambda unit, axis: axis.initialised,
    "GP": lambda unit, axis: unit.gearing.phase(axis),
    "EG": lambda unit, axis: unit.cam.engaged(axis),
    "EQ": lambda unit, axis: unit.cam.waiting(axis),
    "OC": lambda unit, axis: unit.latches.compared(axis),
}

_OF_VIRTUAL = frozenset({"TP", "DP", "RP", "SC", "BG", "PA", "PR", "JG"})

_PLANE: dict[str, Callable[[Unit, Plane], float]] = {
    "BG": lambda unit, plane: plane.running,
    "LM": lambda unit, plane: plane.free(unit.core.now),
    "CS": lambda unit, plane: plane.count(unit.core.now),
    "AV": lambda unit, plane: plane.distance(unit.core.now),
    "VM": lambda unit, plane: plane.speed(unit.core.now),
    "LE": lambda unit, plane: plane.total,
    "TN": lambda unit, plane: plane.tangent_start,
    "VE": lambda unit, plane: plane.total,
}


def _analog_range(unit: Unit, number: int) -> int:
    return unit.peripherals.analog_ranges[number]


def _cn_setting(unit: Unit, number: int) -> int:
    return unit.core.cn[number]


def _thread_place(unit: Unit, number: int) -> int:
    return unit.threads.all[number].place


def _thread_status(unit: Unit, number: int) -> int:
    return unit.threads.all[number].status


def _stack_depth(unit: Unit, number: int) -> int:
    return len(unit.threads.all[number].stack)


_SYSTEM: dict[str, Callable[[Unit], float]] = {
    "TC": lambda unit: unit.error_code,
    "TB": program_byte,
    "CM": lambda unit: unit.core.contour.free(unit.core.now),
    "TIME": lambda unit: unit.time,
    "TI": lambda unit: input_bank(unit, 0),
    **{f"TI{bank}": partial(input_bank, bank=bank) for bank in INPUT_BANKS},
    "OP": lambda unit: output_bank(unit, 0),
    "OP0": lambda unit: output_bank(unit, 0),
    "OP1": lambda unit: output_bank(unit, 1),
    "NO": lambda unit: unit.threads.mask,
    "DL": lambda unit: MOST_LABELS - len(unit.program.labels),
    "ED": lambda unit: unit.threads.error_line,
    "ED0": lambda unit: unit.threads.error_line,
    "ED1": lambda unit: unit.threads.error_thread,
    "BK": lambda unit: unit.threads.breakpoint_state,
    "BN": lambda unit: unit.identity.serial,
    "BV": lambda unit: len(unit.axes),
    "UL": lambda unit: MOST_VARIABLES - len(unit.variables),
    "DM": lambda unit: unit.arrays.free,
    "DA": lambda unit: MOST_ARRAYS - len(unit.arrays),
    "RC": lambda unit: unit.recorder.recording,
    "RD": lambda unit: unit.recorder.next_index,
    "CA": lambda unit: unit.plane == "T",
    "AB": lambda unit: not unit.core.abort_active,
    "EO": lambda unit: unit.echo,
    "CW": lambda unit: unit.outlet.mark,
    "CF": lambda unit: ord(unit.outlet.port),
    "LZ": lambda unit: unit.suppress_zeros,
    "PF": lambda unit: unit.position_format.code,
    "VF": lambda unit: unit.value_format.code,
    "TM": lambda unit: unit.core.period,
    "EB": lambda unit: unit.cam.enabled,
    "EC": lambda unit: unit.cam.index,
    "EP": lambda unit: unit.cam.interval,
    "EW": lambda unit: next(iter(unit.cam.widened), -1),
    "EY": lambda unit: unit.cam.cycles,
    "AZ": lambda unit: 0,
    "QQ": lambda unit: 0,
    "MW": lambda unit: unit.peripherals.modbus_waits,
    "US": lambda unit: unit.peripherals.ports_swapped,
    "CI": lambda unit: unit.peripherals.communication_interrupt,
    "EI": lambda unit: unit.peripherals.event_settings[0],
    **{f"AQ{n + 1}": partial(_analog_range, number=n) for n in range(ANALOG_INPUTS)},
    "DR": lambda unit: unit.records.period,
    "DR0": lambda unit: unit.records.period,
    "DR1": lambda unit: unit.records.place,
    "RS": lambda unit: unit.memory.errors,
    "CW4": lambda unit: unit.outlet.discarding,
    "IA0": lambda unit: network.number(unit.network.address),
    "IA1": lambda unit: unit.network.retry,
    "MU": lambda unit: network.number(unit.network.multicast),
    "MU0": lambda unit: network.number(unit.network.multicast),
    "SM": lambda unit: network.number(unit.network.mask),
    "SM0": lambda unit: network.number(unit.network.mask),
    "IA2": lambda unit: unit.handles.free,
    "IA4": lambda unit: unit.handles.last_lost,
    "IA5": lambda unit: 100,
    "QZ0": lambda unit: len(unit.axes),
    "QZ1": lambda unit: 52,
    "QZ2": lambda unit: 26,
    "QZ3": lambda unit: 36,
    "CN": lambda unit: unit.core.cn[0],
    **{f"CN{n}": partial(_cn_setting, number=n) for n in range(5)},
    "TA": lambda unit: amplifier_byte(unit, 0),
    **{f"TA{n}": partial(amplifier_byte, number=n) for n in range(4)},
    "XQ": lambda unit: unit.threads.all[0].place,
    "HX": lambda unit: unit.threads.all[0].status,
    **{f"XQ{n}": partial(_thread_place, number=n) for n in range(8)},
    **{f"HX{n}": partial(_thread_status, number=n) for n in range(8)},
    **{f"ZS{n}": partial(_stack_depth, number=n) for n in range(8)},
    **{f"P2{item}": (lambda unit: 0) for item in ("CD", "CH", "NM", "ST")},
}


Answer: TypeAlias = str | bytes | None
"""Text (a line end is added), bytes as they are, or None for the prompt only."""


@dataclass(slots=True)
class CallerContext:
    """One caller's view of the unit: a handle's, or that of a program's thread, which has no handle."""

    unit: Unit
    names: OperandScope
    caller: Handle | None = None
    thread: Thread | None = None

    @property
    def core(self) -> MotionCore:
        """The motion of the unit."""
        return self.unit.core

    def axes(self, places: list[int]) -> list[Axis]:
        """Return the axes at these places."""
        return [self.unit.axes[place] for place in places]

    def number(self, text: str) -> float:
        """Return the value of an expression; raises `Rejection`."""
        return evaluate(text, self.names) / ONE

    def integer(self, text: str, minimum: int, maximum: int) -> int:
        """Return the value of an expression without its fraction; raises `Rejection` (6) if it is out of range."""
        value = int(self.number(text))
        if not minimum <= value <= maximum:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return value


Handler: TypeAlias = Callable[[CallerContext, str], Answer]
"""A command: receives the text after its two letters; raises `Rejection` if the answer is `?`."""
