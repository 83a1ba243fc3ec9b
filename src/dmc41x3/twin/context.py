"""Operands (`_TPA`, `_SCB`, `TIME`), variables, and the context in which a command is executed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import ALIASES, LETTERS
from dmc41x3.language.numbers import RAW_MAX, RAW_MIN, fixed
from dmc41x3.twin import network, registers, status
from dmc41x3.twin.expressions import ONE, Rejection, evaluate, unpack
from dmc41x3.twin.memory import MOST_ARRAYS
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.monitors import step_error
from dmc41x3.twin.motion.plane import Plane
from dmc41x3.twin.network import Handle
from dmc41x3.twin.program import MOST_LABELS, Thread
from dmc41x3.twin.unit import ANALOG_INPUTS, MOST_VARIABLES, Unit

_FIRST_AUXILIARY = 81
"""Number of the first of two inputs that belong to the auxiliary encoder of each axis."""

_Reader = Callable[[], float]


class OperandScope:
    """The scope of expressions of one caller: of a handle, or of a program's thread."""

    def __init__(self, unit: Unit, caller: Handle | None = None, thread: Thread | None = None) -> None:
        self._unit = unit
        self._caller = caller
        self._thread = thread
        self._readers: dict[str, _Reader] = {}

    def variable(self, name: str) -> int:
        """Return a variable (raw), also `~a` or `^a`.

        Raises `Rejection`: 9 where it was never assigned, 2 for `^a` outside a program, 55 for an array.
        """
        value = self._unit.variables.get(name)
        return self._special(name) if value is None else value

    def element(self, name: str, index: int) -> int:
        """Return an element of an array (raw), index -1 its length; `^a` is an array whose name was passed.

        Raises `Rejection`: 57 for an unknown array, 56 for an index outside it.
        """
        return self._unit.arrays.element(self.array(name), index)

    def array(self, name: str) -> str:
        """Return the name of an array, which a stack variable `^a` holds as a string; raises `Rejection`."""
        return unpack(self.variable(name)) if name[0] == "^" else name

    def operand(self, name: str) -> int:
        """Return an operand (raw) by its name without underscore, or TIME; raises `Rejection` for an unknown one."""
        read = self._readers.get(name)
        if read is None:
            # Only names that exist are kept, so there is an end to them.
            read = self._readers[name] = self._reader(name)
        value = read()
        raw = int(value * ONE)
        return raw if RAW_MIN <= raw <= RAW_MAX else fixed(value)

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN` or `@OUT` of a bit, or the volts of `@AN` (raw); raises `Rejection` (6) for one not there."""
        unit = self._unit
        if function == "IN" and 0 <= bit - _FIRST_AUXILIARY < 2 * len(unit.axes):
            return ONE  # idle inputs are high, and nothing is wired to these
        values = {"IN": unit.inputs, "OUT": unit.outputs, "AN": unit.analog}[function]
        if not 1 <= bit <= len(values):
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return fixed(values[bit - 1])

    def _special(self, name: str) -> int:
        if name[0] == "^" and self._thread is None:
            raise Rejection(ErrorCode.PROGRAM_ONLY)
        if name in self._unit.arrays:
            raise Rejection(ErrorCode.MISSING_BRACKET)
        value = self._unit.axis_variables.get(name)
        if name[0] == "^" and self._thread is not None:
            value = self._thread.locals.get(name[1:])
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
        """Return what reads an operand of a plane; without its letter, of the one that CA selected."""
        unit = self._unit
        return lambda: read(unit, unit.core.planes[which or unit.plane])

    def _axis(self, letter: str) -> Axis:
        """Return an axis by its letter, the first one without: programs in use say `_TP` and mean `_TPA`."""
        letter = letter.translate(ALIASES) or "A"
        if letter in self._unit.core.virtual:
            return self._unit.core.virtual[letter]
        if len(letter) != 1 or letter not in self._unit.letters:
            raise Rejection(ErrorCode.BAD_OPERAND)
        return self._unit.axes[LETTERS.index(letter)]

    def _of_caller(self, word: str, which: str) -> float:
        if self._thread is not None and not which and word == "JS":
            return self._thread.returned / ONE
        if self._thread is not None and word == "ED" and which == "4":
            return self._thread.number
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
    address = int.from_bytes(bytes(status.address_bytes(host)), "big", signed=True)
    return (address, port, handle.state, not handle.connected, handle.attempt)[item]


_Motion = Callable[[Unit, Axis], float]

_AXIS: dict[str, _Motion] = {
    "VP": status.corner,
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
    "TS": status.switches_byte,
    "SC": lambda unit, axis: unit.core.stop_code(axis),
    "BG": lambda unit, axis: axis.moving,
    "MO": lambda unit, axis: not axis.on,
    "PA": lambda unit, axis: axis.last_stop,
    "PR": status.distance_set,
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

_SYSTEM: dict[str, Callable[[Unit], float]] = {
    "TC": lambda unit: unit.error_code,
    "TB": status.program_byte,
    "CM": lambda unit: unit.core.contour.free(unit.core.now),
    "TIME": lambda unit: unit.time,
    "TI": lambda unit: status.input_bank(unit, 0),
    **{f"TI{bank}": (lambda unit, bank=bank: status.input_bank(unit, bank)) for bank in status.INPUT_BANKS},
    "OP": lambda unit: status.output_bank(unit, 0),
    "OP0": lambda unit: status.output_bank(unit, 0),
    "OP1": lambda unit: status.output_bank(unit, 1),
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
    **{f"AQ{n + 1}": (lambda unit, n=n: unit.peripherals.analog_ranges[n]) for n in range(ANALOG_INPUTS)},
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
    **{f"CN{n}": (lambda unit, n=n: unit.core.cn[n]) for n in range(5)},
    "TA": lambda unit: status.amplifier_byte(unit, 0),
    **{f"TA{n}": (lambda unit, n=n: status.amplifier_byte(unit, n)) for n in range(4)},
    "XQ": lambda unit: unit.threads.all[0].place,
    "HX": lambda unit: unit.threads.all[0].status,
    **{f"XQ{n}": (lambda unit, n=n: unit.threads.all[n].place) for n in range(8)},
    **{f"HX{n}": (lambda unit, n=n: unit.threads.all[n].status) for n in range(8)},
    **{f"ZS{n}": (lambda unit, n=n: len(unit.threads.all[n].stack)) for n in range(8)},
    **{f"P2{item}": (lambda unit: 0) for item in ("CD", "CH", "NM", "ST")},
}


Answer: TypeAlias = str | bytes | None
"""Text (a line end is added), bytes as they are, or nothing but the prompt."""


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
        """Return axes by their places."""
        return [self.unit.axes[place] for place in places]

    def number(self, text: str) -> float:
        """Return the value of an expression; raises `Rejection`."""
        return evaluate(text, self.names) / ONE

    def integer(self, text: str, minimum: int, maximum: int) -> int:
        """Return the value of an expression without its fraction; raises `Rejection` (6) where it is out of range."""
        value = int(self.number(text))
        if not minimum <= value <= maximum:
            raise Rejection(ErrorCode.OUT_OF_RANGE)
        return value


Handler: TypeAlias = Callable[[CallerContext, str], Answer]
"""A command: gets the text behind its two letters; raises `Rejection` where the answer is `?`."""
