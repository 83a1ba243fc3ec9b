"""Commands about the network: handles, addresses, blocked ports, and the stream of data records."""

from __future__ import annotations

import re
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import LETTERS, LONGEST_PERIOD, SHORTEST_PERIOD
from dmc41x3.twin import status
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, split
from dmc41x3.twin.network import COUNT, DEFAULT_PORT, SERIAL, Handle, HandleProtocol, Network, Quad

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
    """IH: close handles with -1, -2, -3 (UDP, TCP, any), or open one to an address; `?` asks for a handle's address."""
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
        return context.unit.position_text(status.address_bytes(handle.peer[0] if handle else ""))
    if text.rstrip().endswith(QUERY):
        raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
    _open(context, letter, address, port, kind)
    return None


def _close(context: CallerContext, which: str, kind: str) -> None:
    """Close one's own handle (S), all the others (T), or the one named, of the kind named."""
    handles, caller = context.unit.handles, context.caller
    if which == "T":
        closing = [handle for handle in handles if handle is not None and handle is not caller]
    else:
        handle = caller if which == "S" else handles.at(which)
        if handle is None:
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
    """Return four bytes, given one by one or as one number of 32 bits."""
    if len(parts) == 1:
        number = context.integer(parts[0], -(1 << 31), (1 << 31) - 1)
        a, b, c, d = (number & 0xFFFFFFFF).to_bytes(4, "big")
        return a, b, c, d
    if len(parts) != 4:
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    a, b, c, d = (context.integer(part, 0, 255) for part in parts)
    return a, b, c, d


def _swap(context: CallerContext, text: str) -> Answer:
    """HS: two handles change their connections; S is the sender's."""
    form = _SWAP.fullmatch(text)
    if form is None:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if "S" in form.groups() and context.caller is None:
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

    The address told from then on is the new one; what the twin listens on does not change.
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
    """MU, SM: an address that is kept and told, and filters nothing on the twin."""
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
    """DH: whether the address comes from DHCP; IA is refused while it does."""
    if text.strip() == QUERY:
        return context.unit.position_text([context.unit.network.dhcp])
    context.unit.network.dhcp = context.integer(text, 0, 1) == 1
    return None


def _who(context: CallerContext, _: str) -> Answer:
    return "USB" if context.caller is None else f"IH{context.caller.letter}"


def _list(context: CallerContext, _: str) -> Answer:
    address = ",".join(map(str, context.unit.network.address))
    first = f"CONTROLLER IP ADDRESS {address} ETHERNET ADDRESS {context.unit.identity.hardware_address}"
    lines = [_line(letter, handle) for letter, handle in zip(LETTERS, context.unit.handles, strict=True)]
    return "\r\n".join([first, *lines])


def _line(letter: str, handle: Handle | None) -> str:
    if handle is None:
        return f"IH{letter} AVAILABLE"
    host, port = handle.peer
    remote = ",".join(map(str, status.address_bytes(host)))
    return f"IH{letter} {handle.kind.name} PORT {handle.port} TO IP ADDRESS {remote} PORT {port}"


def _records(context: CallerContext, text: str) -> Answer:
    """DR: a data record every n0 samples to handle n1, which must be UDP; without n1 to the port of CF.

    Where CF names a serial port the stream is accepted and goes nowhere.
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
    """Return the handle that DR names, None where records are to follow CF; raises `Rejection` where it is not UDP."""
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


TABLE: dict[str, Handler] = {
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
