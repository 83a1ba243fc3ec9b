"""Commands of the connections: Ethernet, data records, analog inputs, serial ports, Modbus, events."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import CONTROL
from dmc41x3.language.hardware import LETTERS, LONGEST_PERIOD, SHORTEST_PERIOD
from dmc41x3.twin.context import AUXILIARY_BANK, Answer, CallerContext, Handler, address_bytes, input_bank, output_bank
from dmc41x3.twin.expressions import QUERY, Rejection, split
from dmc41x3.twin.network import COUNT, DEFAULT_PORT, SERIAL, Handle, HandleProtocol, Network, Quad
from dmc41x3.twin.unit import ANALOG_INPUTS, Peripherals

_CLOSE = re.compile(r"\s*([A-HST])\s*=\s*>?\s*-([123])\s*")
_OPEN = re.compile(r"\s*([A-H])\s*=\s*([^<>]+)(?:<([^<>]+))?(?:>([^<>]+))?")
_SWAP = re.compile(r"\s*([A-HS])\s*=\s*([A-HS])\s*")
_KINDS: dict[str, tuple[HandleProtocol, ...]] = {
    "1": (HandleProtocol.UDP,),
    "2": (HandleProtocol.TCP,),
    "3": (HandleProtocol.UDP, HandleProtocol.TCP),
}
_LARGEST_PORT = 65535
_LONGEST_RETRY = 2147483647
_UDP, _TCP = 1, 2


def _handle(context: CallerContext, text: str) -> Answer:
    """IH: close handles with -1, -2, -3 (UDP, TCP, any), or open one to an address; `?` returns a handle's address."""
    closing = _CLOSE.fullmatch(text)
    if closing is not None:
        _close(context, *closing.groups())
        return None
    opening = _OPEN.fullmatch(text)
    if opening is None:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    letter, address, port, kind = opening.groups()
    if address.strip() == QUERY:
        handle = context.unit.handles.at(letter)
        return context.unit.position_text(address_bytes(handle.peer[0] if handle else ""))
    if text.rstrip().endswith(QUERY):
        raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
    _open(context, letter, address, port, kind)
    return None


def _close(context: CallerContext, which: str, kind: str) -> None:
    """Close the caller's handle (S), all other handles (T), or a named handle, if its kind is `kind`."""
    handles, caller = context.unit.handles, context.caller
    if which == "T":
        closing = [handle for handle in handles if handle is not None and handle is not caller]
    else:
        handle = caller if which == "S" else handles.at(which)
        if handle is None or handle.kind is HandleProtocol.SERIAL:
            raise Rejection(ErrorCode.HANDLE_CLOSED)
        closing = [handle]
    for handle in closing:
        if handle.kind in _KINDS[kind]:
            handles.close(handle)


def _open(context: CallerContext, letter: str, address: str, port: str | None, kind: str | None) -> None:
    handles = context.unit.handles
    if handles.at(letter) is not None:
        raise Rejection(ErrorCode.HANDLE_IN_USE)
    host = _quad(context, split(address))
    default = DEFAULT_PORT + LETTERS.index(letter)
    number = default if port is None else context.integer(port, 0, _LARGEST_PORT)
    protocol = _TCP if kind is None else context.integer(kind, _UDP, _TCP)
    handles.dial(letter, (".".join(map(str, host)), number), HandleProtocol(protocol))


def _quad(context: CallerContext, parts: list[str]) -> Quad:
    """Return four bytes, given separately or as one number of 32 bits."""
    if len(parts) == 1:
        number = context.integer(parts[0], -(1 << 31), (1 << 31) - 1)
        a, b, c, d = (number & 0xFFFFFFFF).to_bytes(4, "big")
        return a, b, c, d
    if len(parts) != 4:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    a, b, c, d = (context.integer(part, 0, 255) for part in parts)
    return a, b, c, d


def _swap(context: CallerContext, text: str) -> Answer:
    """HS: exchange the connections of two handles; S is the caller's."""
    form = _SWAP.fullmatch(text)
    if form is None:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if "S" in form.groups() and (context.caller is None or context.caller.kind is HandleProtocol.SERIAL):
        raise Rejection(ErrorCode.NOT_IN_PROGRAM)
    own = -1 if context.caller is None else context.caller.index
    first, second = (own if name == "S" else LETTERS.index(name) for name in form.groups())
    context.unit.handles.swap(first, second)
    return None


def _block(context: CallerContext, text: str) -> Answer:
    """IK: 1 refuses new connections to ports below 1000, except 0, 23, 68 and 502."""
    handles = context.unit.handles
    if text.strip() == QUERY:
        return context.unit.position_text([handles.blocking])
    handles.blocking = context.integer(text, 0, 1) == 1 if text.strip() else True
    return None


def _address(context: CallerContext, text: str) -> Answer:
    """IA: the controller's address, or with `<` the samples between two attempts on a silent TCP handle.

    The twin moves to the new address if that is one of the loopback; all its network connections then end.
    """
    network = context.unit.network
    body, less, retry = text.partition("<")
    if less and (body.strip() or not retry.strip()):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if less:
        network.retry = context.integer(retry, 1, _LONGEST_RETRY)
        return None
    if body.strip() == QUERY:
        return _quad_text(network.address)
    if network.dhcp:
        raise Rejection(ErrorCode.NOT_WITH_DHCP)
    network.address = _quad(context, split(body))
    return None


def _quad_register(name: str, context: CallerContext, text: str) -> Answer:
    """MU, SM: store or return an address, which filters nothing on the twin."""
    network: Network = context.unit.network
    if text.strip() == QUERY:
        return _quad_text(network.multicast if name == "MU" else network.mask)
    value = _quad(context, split(text))
    if name == "MU":
        network.multicast = value
    else:
        network.mask = value
    return None


def _quad_text(quad: Quad) -> str:
    return " " + ", ".join(map(str, quad))


def _dhcp(context: CallerContext, text: str) -> Answer:
    """DH: whether the address comes from DHCP; IA is refused if it does."""
    if text.strip() == QUERY:
        return context.unit.position_text([context.unit.network.dhcp])
    context.unit.network.dhcp = context.integer(text, 0, 1) == 1
    return None


def _who(context: CallerContext, _: str) -> Answer:
    caller = context.caller
    return "USB" if caller is None or caller.kind is HandleProtocol.SERIAL else f"IH{caller.letter}"


def _list(context: CallerContext, _: str) -> Answer:
    address = ",".join(map(str, context.unit.network.address))
    first = f"CONTROLLER IP ADDRESS {address} ETHERNET ADDRESS {context.unit.identity.hardware_address}"
    lines = [_line(letter, handle) for letter, handle in zip(LETTERS, context.unit.handles, strict=True)]
    return "\r\n".join([first, *lines])


def _line(letter: str, handle: Handle | None) -> str:
    if handle is None:
        return f"IH{letter} AVAILABLE"
    host, port = handle.peer
    remote = ",".join(map(str, address_bytes(host)))
    return f"IH{letter} {handle.kind.name} PORT {handle.port} TO IP ADDRESS {remote} PORT {port}"


def _records(context: CallerContext, text: str) -> Answer:
    """DR: a data record every n0 samples to handle n1, which must be UDP; without n1 to the port of CF.

    If CF names a serial port, DR is accepted but sends nothing.
    """
    arguments = split(text)
    stream = context.unit.records
    if len(arguments) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if arguments[0] == QUERY:
        return context.unit.position_text([stream.period])
    period = context.integer(arguments[0], 0, LONGEST_PERIOD) // 2 * 2 if arguments[0] else 0
    if 0 < period < SHORTEST_PERIOD:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    if period:
        named = _named_or_followed(context, arguments[1:])
        stream.start(period, context.unit.period, named, context.core.now)
    else:
        stream.stop()
    return None


def _named_or_followed(context: CallerContext, arguments: list[str]) -> Handle | None:
    """Return the handle that DR names, None if records follow CF; raises `Rejection` if the handle is not UDP."""
    handles, port = context.unit.handles, context.unit.outlet.port
    if arguments:
        target = list(handles)[context.integer(arguments[0], 0, COUNT - 1)]
    elif port in SERIAL:
        return None
    else:
        target = handles.at(port)
    if target is None or target.kind is not HandleProtocol.UDP:
        raise Rejection(ErrorCode.HANDLE_MUST_BE_UDP)
    return target if arguments else None


ETHERNET_TABLE: dict[str, Handler] = {
    "IH": _handle,
    "HS": _swap,
    "IK": _block,
    "IA": _address,
    "MU": partial(_quad_register, "MU"),
    "SM": partial(_quad_register, "SM"),
    "DH": _dhcp,
    "WH": _who,
    "TH": _list,
    "DR": _records,
}


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
    """Set or return one whole number."""
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
    """AQ n,m: the range of an analog input, negative if it is differential; `AQ n,?` or `AQ ?,..` returns it."""
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
        lines.append(_bank("input", bank, 8 * bank + 1, input_bank(unit, bank)))
        lines.append(_bank("output", bank, 8 * bank + 1, output_bank(unit, bank)))
    for bank in banks:
        auxiliary = AUXILIARY_BANK + bank
        lines.append(_bank("input", auxiliary, 8 * auxiliary + 1, input_bank(unit, auxiliary)))
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


PERIPHERALS_TABLE: dict[str, Handler] = {
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
