"""Commands about things around the controller: analog inputs, serial ports, Modbus, events, the lock of the program."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import CONTROL
from dmc41x3.twin import status
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, split
from dmc41x3.twin.unit import ANALOG_INPUTS, Peripherals

_LONGEST_PASSWORD = 8
_ANALOG_RANGES = (1, 2, 3, 4)


def _flag(
    read: Callable[[Peripherals], int],
    write: Callable[[Peripherals, int], None],
    low: int,
    high: int,
    context: CallerContext,
    text: str,
) -> Answer:
    """Set or tell one whole number."""
    peripherals = context.unit.peripherals
    if text.strip() == QUERY:
        return context.unit.position_text([read(peripherals)])
    write(peripherals, context.integer(text, low, high))
    return None


def _set_wait(peripherals: Peripherals, value: int) -> None:
    peripherals.modbus_waits = value


def _set_write(peripherals: Peripherals, value: int) -> None:
    peripherals.modbus_writes = value


def _set_swap(peripherals: Peripherals, value: int) -> None:
    peripherals.ports_swapped = value


def _set_interrupt(peripherals: Peripherals, value: int) -> None:
    peripherals.communication_interrupt = value


def _analog(context: CallerContext, text: str) -> Answer:
    """AQ n,m: the range of an analog input, negative where it is differential; `AQ n,?` or `AQ ?,..` tells."""
    ranges, arguments = context.unit.peripherals.analog_ranges, split(text)
    if all(argument == QUERY for argument in arguments):
        return context.unit.position_text([float(value) for value in ranges[: len(arguments)]])
    if len(arguments) != 2:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    place = context.integer(arguments[0], 1, ANALOG_INPUTS) - 1
    if arguments[1] == QUERY:
        return context.unit.position_text([ranges[place]])
    value = context.integer(arguments[1], -4, 4)
    if abs(value) not in _ANALOG_RANGES:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    ranges[place] = value
    return None


def _events(context: CallerContext, text: str) -> Answer:
    """EI: masks of events and the handle for their packets, which this unit does not send."""
    arguments = split(text)
    settings = context.unit.peripherals.event_settings
    if len(arguments) > len(settings):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    asked = [float(value) for value, argument in zip(settings, arguments, strict=False) if argument == QUERY]
    if asked:
        return context.unit.position_text(asked)
    limits = ((0, 65535), (0, 255), (-1, 7))
    wanted = [
        context.integer(argument, *limit) if argument else present
        for argument, limit, present in zip(arguments, limits, settings, strict=False)
    ]
    settings[: len(wanted)] = wanted
    return None


def _user_event(context: CallerContext, text: str) -> Answer:
    if text.strip():
        context.integer(text, 0, 15)
    return None


def _serial_port(context: CallerContext, text: str) -> Answer:
    """CC: speed, handshake, kind and echo of the second serial port, to which nothing is connected."""
    arguments = split(text)
    if len(arguments) > 4 or any(not argument for argument in arguments):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for argument in arguments:
        context.number(argument)
    return None


def _no_device(context: CallerContext, text: str) -> Answer:
    """AO, MB: no Modbus device answers on any handle."""
    raise Rejection(ErrorCode.HANDLE_CLOSED)


def _overflow(context: CallerContext, text: str) -> Answer:
    """QQ: no sample of this unit ever takes too long."""
    if text.strip():
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return None


def _listing(context: CallerContext, text: str) -> Answer:
    """TZ: inputs and outputs by banks of eight, the highest bit first, as Galil's command reference prints them."""
    unit = context.unit
    banks = range(len(unit.inputs) // 8)
    lines: list[str] = []
    for bank in banks:
        lines.append(_bank("input", bank, 8 * bank + 1, status.input_bank(unit, bank)))
        lines.append(_bank("output", bank, 8 * bank + 1, status.output_bank(unit, bank)))
    for bank in banks:
        auxiliary = status.AUXILIARY_BANK + bank
        lines.append(_bank("input", auxiliary, 8 * auxiliary + 1, status.input_bank(unit, auxiliary)))
    return "\r\n".join(lines)


def _bank(kind: str, bank: int, first: int, value: int) -> str:
    bits = f"{value:08b}"
    return f"Block {bank} ({first + 7}-{first}) dedicated as {kind} - value {value} ({bits[:4]}_{bits[4:]})"


def _password(context: CallerContext, text: str) -> Answer:
    """PW: a password, given twice; refused (106) while the program is locked."""
    peripherals = context.unit.peripherals
    if peripherals.locked:
        raise Rejection(ErrorCode.PRIVILEGE)
    first, *others = split(text)
    if others != [first] or len(first) > _LONGEST_PASSWORD:
        raise Rejection(ErrorCode.PASSWORDS_DIFFER)
    peripherals.password = first
    return None


def _lock(context: CallerContext, text: str) -> Answer:
    """^L^K: lock (1) or unlock (0) the program with the password."""
    peripherals = context.unit.peripherals
    if text.strip() == QUERY:
        return context.unit.position_text([peripherals.locked])
    password, *setting = split(text)
    if password != peripherals.password:
        raise Rejection(ErrorCode.WRONG_PASSWORD)
    if setting not in (["0"], ["1"]):
        raise Rejection(ErrorCode.WRONG_LOCK)
    peripherals.locked = setting == ["1"]
    return None


TABLE: dict[str, Handler] = {
    "AQ": _analog,
    "AO": _no_device,
    "MB": _no_device,
    "MW": partial(_flag, lambda one: one.modbus_waits, _set_wait, 0, 1),
    "ME": partial(_flag, lambda one: one.modbus_writes, _set_write, 0, 1),
    "US": partial(_flag, lambda one: one.ports_swapped, _set_swap, 0, 1),
    "CI": partial(_flag, lambda one: one.communication_interrupt, _set_interrupt, -1, 3),
    "CC": _serial_port,
    "EI": _events,
    "UI": _user_event,
    "QQ": _overflow,
    "TZ": _listing,
    "PW": _password,
    CONTROL["^L^K"]: _lock,
}
