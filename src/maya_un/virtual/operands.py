"""Operands (`_TPA`, `_SCB`, `_TC`, `TIME`) and variables: what an expression can name."""

from __future__ import annotations

from collections.abc import Callable

from maya_un.galil.codes import ErrorCode
from maya_un.galil.numbers import fixed
from maya_un.virtual import network, registers, status
from maya_un.virtual.axis import LETTERS, Axis
from maya_un.virtual.expressions import ONE
from maya_un.virtual.handles import Handle
from maya_un.virtual.plane import Plane
from maya_un.virtual.refusal import Refused
from maya_un.virtual.thread import Thread
from maya_un.virtual.unit import Unit

_ALIASES = dict(zip("XYZW", "ABCD", strict=True))


class Names:
    """The scope of expressions of one caller: of a handle, or of a program's thread."""

    def __init__(self, unit: Unit, caller: Handle | None = None, thread: Thread | None = None) -> None:
        self._unit = unit
        self._caller = caller
        self._thread = thread

    def variable(self, name: str) -> int:
        """Return a variable (raw); raises `Refused` where it was never assigned."""
        try:
            return self._unit.variables[name]
        except KeyError:
            raise Refused(ErrorCode.VARIABLE_ERROR) from None

    def operand(self, name: str) -> int:
        """Return an operand (raw) by its name without underscore, or TIME; raises `Refused` for an unknown one."""
        if name == "TIME":
            return self._unit.time * ONE
        return fixed(self._value(name))

    def bank(self, function: str, bit: int) -> int:
        """Return `@IN` or `@OUT` of a bit (raw)."""
        if function == "AN":
            raise Refused(ErrorCode.BAD_FUNCTION)
        if not 1 <= bit <= len(self._unit.outputs):
            raise Refused(ErrorCode.OUT_OF_RANGE)
        return ONE * (self._unit.inputs if function == "IN" else self._unit.outputs)[bit - 1]

    def _value(self, name: str) -> float:
        system = _SYSTEM.get(name)
        if system is not None:
            return system(self._unit)
        word, which = name[:2], name[2:]
        if word in _PLANE and which in ("S", "T"):
            return _PLANE[word](self._unit, self._unit.core.planes[which])
        if word in _AXIS:
            return _AXIS[word](self._unit, self._axis(which))
        if word in registers.AXIS:
            return self._axis(which).registers[word]
        if word in registers.PLANE and which in ("S", "T", ""):
            return self._unit.core.planes[which or "S"].registers[word]
        return self._of_caller(word, which)

    def _axis(self, letter: str) -> Axis:
        letter = _ALIASES.get(letter, letter)
        if len(letter) != 1 or letter not in self._unit.letters:
            raise Refused(ErrorCode.BAD_OPERAND)
        return self._unit.axes[LETTERS.index(letter)]

    def _of_caller(self, word: str, which: str) -> float:
        if (word == "WH" and not which) or (word == "IA" and which == "3"):
            return -1 if self._caller is None else self._caller.index
        if word == "IH" and len(which) == 2 and which[0] in LETTERS and which[1] in "01234":
            return _handle(self._unit.handles.at(which[0]), int(which[1]))
        raise Refused(ErrorCode.BAD_OPERAND)


def _handle(handle: Handle | None, item: int) -> float:
    """Return `_IHx0` to `_IHx4`: address, port, kind, whether ARP failed, whether a connection failed."""
    if handle is None:
        return 0
    host, port = handle.peer
    address = int.from_bytes(bytes(status.address_bytes(host)), "big", signed=True)
    return (address, port, handle.state, not handle.connected, handle.attempt)[item]


_Motion = Callable[[Unit, Axis], float]

_AXIS: dict[str, _Motion] = {
    "TP": lambda unit, axis: unit.core.position(axis),
    "DP": lambda unit, axis: unit.core.position(axis),
    "RP": lambda unit, axis: axis.reference(unit.core.now),
    "TE": lambda unit, axis: unit.core.error(axis),
    "TD": lambda unit, axis: axis.auxiliary,
    "DE": lambda unit, axis: axis.auxiliary,
    "TV": lambda unit, axis: round(unit.core.velocity(axis)),
    "TT": lambda unit, axis: unit.core.plant.torque(axis.index),
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
}

_PLANE: dict[str, Callable[[Unit, Plane], float]] = {
    "BG": lambda unit, plane: plane.running,
    "LM": lambda unit, plane: plane.free(unit.core.now),
    "CS": lambda unit, plane: plane.count(unit.core.now),
    "AV": lambda unit, plane: plane.distance(unit.core.now),
    "VM": lambda unit, plane: plane.speed(unit.core.now),
    "LE": lambda unit, plane: plane.total,
    "VE": lambda unit, plane: plane.total,
}

_SYSTEM: dict[str, Callable[[Unit], float]] = {
    "TC": lambda unit: unit.error_code,
    "TB": lambda unit: unit.echo,
    "TI": lambda unit: 255,
    "TI0": lambda unit: 255,
    "OP": lambda unit: status.output_bank(unit, 0),
    "OP0": lambda unit: status.output_bank(unit, 0),
    "OP1": lambda unit: status.output_bank(unit, 1),
    "NO": lambda unit: 0,
    "BN": lambda unit: unit.identity.serial,
    "BV": lambda unit: len(unit.axes),
    "UL": lambda unit: 510 - len(unit.variables),
    "CA": lambda unit: unit.plane == "T",
    "AB": lambda unit: not unit.core.abort_active,
    "EO": lambda unit: unit.echo,
    "CW": lambda unit: unit.outlet.mark,
    "CF": lambda unit: ord(unit.outlet.port),
    "LZ": lambda unit: unit.suppress_zeros,
    "PF": lambda unit: unit.position_format.code,
    "VF": lambda unit: unit.value_format.code,
    "TM": lambda unit: 1000,
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
    **{f"CN{n}": (lambda unit, n=n: unit.core.cn[n]) for n in range(5)},
    **{f"TA{n}": (lambda unit, n=n: status.amplifier_byte(unit, n)) for n in range(4)},
    **{f"XQ{n}": (lambda unit: -1) for n in range(8)},
    **{f"HX{n}": (lambda unit: 0) for n in range(8)},
}
