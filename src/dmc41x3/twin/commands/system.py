"""Commands of the controller itself: outputs, formats, power-up, reset (RS) and burning (BN, BP, BV).

Burned parameters are: the registers of axes and planes (but for ZA and VV), whether motors are off, CN,
and the formats, ports and addresses. Outputs are off after power-up. The reply to a burn comes at once, although a
controller needs up to seconds; the records of DR pause for that time.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

from dmc41x3.errors import FileUnwritable
from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin import registers
from dmc41x3.twin.context import Answer, CallerContext, Handler, output_bank
from dmc41x3.twin.expressions import QUERY, Rejection, split
from dmc41x3.twin.memory import Parameters
from dmc41x3.twin.network import SERIAL, Network, Quad
from dmc41x3.twin.registers import Register
from dmc41x3.twin.unit import Format, Unit

BURN_TIME = 2.0
"""Longest time that a controller needs for BN, BP or BV [s]."""

_NOT_BURNED = frozenset({"ZA", "VV"})


def power_up(unit: Unit) -> None:
    """Restore the burned state; a damaged part of the memory sets error 14 and gets factory settings.

    Motors of axes that were never burned are off or on as `unit.motors_off` states.
    """
    unit.memory.load()
    _restore(unit, factory=False)
    if unit.memory.errors:
        unit.error_code = int(ErrorCode.CHECKSUM)


def reset(unit: Unit, *, factory: bool = False) -> None:
    """Restore the burned state as a power-up does (RS), or once the factory settings (RS -1); all handles close."""
    unit.handles.reset()
    unit.reset()
    for activity in unit.activities:
        activity.reset()
    if factory:
        _restore(unit, factory=True)
    else:
        power_up(unit)


def master_reset(unit: Unit) -> None:
    """Erase everything burned and reset (^R^S)."""
    unit.memory.erase()
    reset(unit)


def burn_parameters(unit: Unit) -> None:
    """Burn the parameters (BN); raises `Rejection`."""
    unit.memory.contents.parameters = _parameters(unit)
    _store(unit)


def burn_program(unit: Unit) -> None:
    """Burn the program (BP); raises `Rejection`."""
    unit.memory.contents.program = unit.program.text()
    _store(unit)


def burn_variables(unit: Unit) -> None:
    """Burn variables and arrays (BV); raises `Rejection`."""
    unit.memory.contents.variables = dict(unit.variables)
    unit.memory.contents.arrays = unit.arrays.contents()
    _store(unit)


def _store(unit: Unit) -> None:
    unit.records.pause(unit.core.now + BURN_TIME)
    try:
        unit.memory.store()
    except (OSError, FileUnwritable):
        raise Rejection(ErrorCode.WRITE) from None


def _parameters(unit: Unit) -> Parameters:
    groups: Parameters = {"unit": _unit_parameters(unit)}
    for axis in unit.axes:
        groups[axis.letter] = {**_burned(axis.registers), "motor_off": not axis.on}
    for plane in unit.core.planes.values():
        groups[plane.letter] = _burned(plane.registers)
    return groups


def _burned(values: dict[str, float]) -> dict[str, float | str]:
    return {name: value for name, value in values.items() if name not in _NOT_BURNED}


def _unit_parameters(unit: Unit) -> dict[str, float | str]:
    network = unit.network
    return {
        **{f"CN{place}": value for place, value in enumerate(unit.core.cn)},
        "TM": unit.core.period,
        "PF": _format_text(unit.position_format),
        "VF": _format_text(unit.value_format),
        "LZ": unit.suppress_zeros,
        "EO": unit.echo,
        "CF": unit.outlet.port,
        "CW": unit.outlet.mark,
        "IK": unit.handles.blocking,
        "IA": ".".join(map(str, network.address)),
        "IA1": network.retry,
        "DH": network.dhcp,
        "MU": ".".join(map(str, network.multicast)),
        "SM": ".".join(map(str, network.mask)),
    }


def _format_text(form: Format) -> str:
    return f"{'$' * form.hexadecimal}{form.before}.{form.after}"


def _restore(unit: Unit, *, factory: bool) -> None:
    contents = unit.memory.contents
    burned = (None if factory else contents.parameters) or {}
    _restore_period(unit, burned.get("unit", {}).get("TM"))
    for axis in unit.axes:
        group = burned.get(axis.letter, {})
        _restore_registers(axis.registers, group, registers.AXIS, unit.core.period)
        unit.core.limit_torque(axis)
        unit.core.power(axis, not group.get("motor_off", unit.motors_off))
    for plane in unit.core.planes.values():
        _restore_registers(plane.registers, burned.get(plane.letter, {}), registers.PLANE, unit.core.period)
    _restore_unit(unit, burned.get("unit", {}))
    if not factory:
        unit.variables.update(contents.variables)
        unit.arrays.restore(contents.arrays)
        _start_program(unit)


def _start_program(unit: Unit) -> None:
    """Load the burned program and run its #AUTO on thread 0, or #AUTOERR if the memory is damaged."""
    with suppress(Rejection):  # a file may hold anything
        unit.program.load(unit.memory.contents.program)
    line = unit.program.labels.get("AUTOERR" if unit.memory.errors else "AUTO")
    if line is not None:
        unit.threads.all[0].start(unit.program.start(line), line)


def _restore_period(unit: Unit, period: float | str | None) -> None:
    if isinstance(period, int):
        with suppress(Rejection):
            unit.core.set_period(int(registers.TM.rounded(period)))


def _restore_registers(
    values: dict[str, float], group: dict[str, float | str], table: dict[str, Register], period: int
) -> None:
    """Set registers to burned values; for a value out of range the factory setting remains."""
    for name, value in group.items():
        register = table.get(name)
        if register is None or isinstance(value, str) or name in _NOT_BURNED:
            continue
        try:
            register.sampled(period).rounded(value)
        except Rejection:
            continue
        values[name] = value


def _restore_unit(unit: Unit, group: dict[str, float | str]) -> None:
    """Set the parameters that belong to no axis; for an invalid value the factory setting remains."""
    port = _text(group, "CF")
    if port and port in "ABCDEFGH" + SERIAL:
        unit.outlet.port = port
    unit.core.cn = [_one_of(group, f"CN{n}", (-1, 1) if n < 3 else (0, 1), now) for n, now in enumerate(unit.core.cn)]
    unit.position_format = _parsed_format(_text(group, "PF"), unit.position_format)
    unit.value_format = _parsed_format(_text(group, "VF"), unit.value_format)
    unit.suppress_zeros = _one_of(group, "LZ", (0, 1), unit.suppress_zeros)
    unit.echo = _one_of(group, "EO", (0, 1), unit.echo)
    unit.outlet.mark = _one_of(group, "CW", (1, 2), unit.outlet.mark)
    unit.handles.blocking = bool(_one_of(group, "IK", (0, 1), unit.handles.blocking))
    _restore_network(unit.network, group)


def _restore_network(network: Network, group: dict[str, float | str]) -> None:
    retry = group.get("IA1")
    if isinstance(retry, int) and retry > 0:
        network.retry = retry
    network.dhcp = bool(_one_of(group, "DH", (0, 1), network.dhcp))
    network.address = _quad(_text(group, "IA"), network.address)
    network.multicast = _quad(_text(group, "MU"), network.multicast)
    network.mask = _quad(_text(group, "SM"), network.mask)


def _text(group: dict[str, float | str], name: str) -> str:
    return str(group.get(name, ""))


def _one_of(group: dict[str, float | str], name: str, allowed: tuple[int, ...], default: int) -> int:
    value = group.get(name)
    return int(value) if isinstance(value, int | float) and value in allowed else default


def _parsed_format(text: str, default: Format) -> Format:
    before, _, after = text.removeprefix("$").partition(".")
    if not (before.isdecimal() and after.isdecimal() and int(before) <= 10 and int(after) <= 4):
        return default
    return Format(int(before), int(after), text.startswith("$"))


def _quad(text: str, default: Quad) -> Quad:
    parts = text.split(".")
    if len(parts) != 4 or not all(part.isdecimal() and int(part) < 256 for part in parts):
        return default
    a, b, c, d = (int(part) for part in parts)
    return a, b, c, d


_COPYRIGHT = "Virtual DMC-41x3 of Maya-UN, Apache License 2.0"


def _bit(on: bool, context: CallerContext, text: str) -> Answer:
    context.unit.set_output(context.integer(text, 1, len(context.unit.outputs)), on)
    return None


def _bit_by_value(context: CallerContext, text: str) -> Answer:
    """OB n,expression: set the output if the expression is nonzero, else clear it."""
    arguments = split(text)
    if len(arguments) != 2:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    bit = context.integer(arguments[0], 1, len(context.unit.outputs))
    context.unit.set_output(bit, context.number(arguments[1]) != 0.0)
    return None


def _port(context: CallerContext, text: str) -> Answer:
    """OP: all outputs of a bank of eight at once."""
    unit = context.unit
    arguments = split(text)
    if 8 * len(arguments) > len(unit.outputs):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if QUERY in arguments:
        banks = [bank for bank, argument in enumerate(arguments) if argument == QUERY]
        return unit.position_text([output_bank(unit, bank) for bank in banks])
    masks = [context.integer(argument, 0, 255) if argument else None for argument in arguments]
    for bank, bits in enumerate(masks):
        for bit in range(8 if bits is not None else 0):
            unit.set_output(8 * bank + bit + 1, bool((bits or 0) >> bit & 1))
    return None


def _flag(read: Callable[[Unit], int], write: Callable[[Unit, int], None], context: CallerContext, text: str) -> Answer:
    """Set or return a flag of 0 or 1."""
    if text.strip() == QUERY:
        return context.unit.position_text([read(context.unit)])
    write(context.unit, context.integer(text, 0, 1))
    return None


def _set_echo(unit: Unit, value: int) -> None:
    unit.echo = value  # honoured on serial ports only: Ethernet never echoes


def _set_zeros(unit: Unit, value: int) -> None:
    unit.suppress_zeros = value


def _copyright(context: CallerContext, text: str) -> Answer:
    """CW: 1 marks unsolicited characters by bit 7, 2 does not; 0, `?` or no number returns the copyright.

    The second number, whether a full serial port discards, does not apply to Ethernet handles and is only stored.
    """
    arguments = split(text)
    if arguments[0] in ("", "0", QUERY):
        return _COPYRIGHT
    outlet = context.unit.outlet
    mark = context.integer(arguments[0], 1, 2) if arguments[0] else outlet.mark
    if len(arguments) > 1 and arguments[1]:
        outlet.discarding = context.integer(arguments[1], 0, 1)
    outlet.mark = mark
    return None


def _message_port(context: CallerContext, text: str) -> Answer:
    """CF: the destination of a program's messages; `I` is the caller's port."""
    name = text.strip()
    if name == QUERY:
        return context.unit.position_text([ord(context.unit.outlet.port)])
    if len(name) != 1 or name not in "ABCDEFGHIST":
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if name == "I":
        if context.caller is None:
            raise Rejection(ErrorCode.NOT_IN_PROGRAM)
        name = context.caller.letter
    context.unit.outlet.port = name
    return None


def _format(name: str, context: CallerContext, text: str) -> Answer:
    """PF, VF: digits before and after the point, negative for hexadecimal."""
    unit = context.unit
    present = unit.position_format if name == "PF" else unit.value_format
    if text.strip() == QUERY:
        return f" {present.code:.1f}"
    value = context.number(text)
    digits = round(abs(value) * 10)
    before, after = divmod(digits, 10)
    if before > (8 if value < 0 else 10) or after > 4:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    form = Format(before, after, value < 0)
    if name == "PF":
        unit.position_format = form
    else:
        unit.value_format = form
    return None


def _reset(context: CallerContext, text: str) -> Answer:
    """RS: 0 restores the burned state, -1 the factory settings once.

    The prompt is still sent, then all links end; the manual leaves open whether there is a reply.
    """
    reset(context.unit, factory=bool(text.strip()) and context.integer(text, -1, 0) == -1)
    return None


def _master_reset(context: CallerContext, text: str) -> Answer:
    """^R^S: a reset that also erases the burned state."""
    _bare(text)
    master_reset(context.unit)
    return None


def _burn(what: Callable[[Unit], None], context: CallerContext, text: str) -> Answer:
    """BN, BP, BV: burn parameters, program, or variables and arrays.

    BN and BP from a host are refused while a program runs, and any BP while an axis moves.
    """
    _bare(text)
    unit = context.unit
    if what is not burn_variables and context.thread is None and unit.threads.mask:
        raise Rejection(ErrorCode.NOT_WHILE_PROGRAM_RUNS)
    if what is burn_program and any(axis.moving for axis in unit.axes):
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    what(unit)
    return None


def _bare(text: str) -> None:
    if text.strip():
        raise Rejection(ErrorCode.OPERAND_ERROR)


TABLE: dict[str, Handler] = {
    "SB": partial(_bit, True),
    "CB": partial(_bit, False),
    "OB": _bit_by_value,
    "OP": _port,
    "EO": partial(_flag, lambda unit: unit.echo, _set_echo),
    "LZ": partial(_flag, lambda unit: unit.suppress_zeros, _set_zeros),
    "CW": _copyright,
    "CF": _message_port,
    "PF": partial(_format, "PF"),
    "VF": partial(_format, "VF"),
    "RS": _reset,
    "\x12\x13": _master_reset,
    "BN": partial(_burn, burn_parameters),
    "BP": partial(_burn, burn_program),
    "BV": partial(_burn, burn_variables),
}
