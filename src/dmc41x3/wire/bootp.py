"""Packets of BOOTP and DHCP (RFC 951, RFC 2131), as far as giving an address to a controller needs them.

A controller without an address asks by DHCP after power-up with DH 1, which is the default, and by BOOTP with DH 0.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping
from enum import IntEnum
from ipaddress import IPv4Address
from typing import NamedTuple

SERVER_PORT, CLIENT_PORT = 67, 68
GALIL = "00:50:4c"
"""The first half of the hardware addresses of Galil's controllers."""

_FIXED = struct.Struct("!BBBBIHH4s4s4s4s16s64s128s")
_MAGIC = b"\x63\x82\x53\x63"
_SHORTEST = 300
_REQUEST, _REPLY = 1, 2
_ETHERNET, _LENGTH = 1, 6
_MASK, _REQUESTED, _LEASE, _KIND, _SERVER, _END, _PAD = 1, 50, 51, 53, 54, 255, 0
_FOREVER = b"\xff\xff\xff\xff"
_MAC = re.compile(r"[0-9a-f]{2}([-:])(?:[0-9a-f]{2}\1){4}[0-9a-f]{2}")
NOWHERE = IPv4Address(0)


class DhcpKind(IntEnum):
    """Kinds of DHCP messages; NONE is plain BOOTP."""

    NONE = 0
    DISCOVER = 1
    OFFER = 2
    REQUEST = 3
    ACK = 5


class AddressRequest(NamedTuple):
    """A request for an address. `server` is the DHCP server that a REQUEST selects, or `NOWHERE`."""

    mac: str
    number: int
    kind: DhcpKind = DhcpKind.NONE
    server: IPv4Address = NOWHERE
    wanted: IPv4Address = NOWHERE

    @property
    def from_galil(self) -> bool:
        """Whether the hardware address is that of a Galil controller."""
        return self.mac.startswith(GALIL)


class AddressReply(NamedTuple):
    """An answer: the address for the hardware address `mac`."""

    mac: str
    number: int
    address: IPv4Address
    server: IPv4Address
    mask: IPv4Address = NOWHERE
    kind: DhcpKind = DhcpKind.NONE


def parse_mac(text: str) -> str:
    """Return a hardware address in lower case with colons; raises `ValueError`."""
    lower = text.lower()
    if not _MAC.fullmatch(lower):
        raise ValueError(text)
    return lower.replace("-", ":")


def parse_request(data: bytes) -> AddressRequest | None:
    """Return the request in a datagram, None if it contains none."""
    fields, options = _fields(data, _REQUEST), dict(_options(data[_FIXED.size :]))
    kind = _kind(options, DhcpKind.DISCOVER, DhcpKind.REQUEST)
    if fields is None or kind is None:
        return None
    return AddressRequest(fields.mac, fields.number, kind, _address(options, _SERVER), _address(options, _REQUESTED))


def parse_reply(data: bytes) -> AddressReply | None:
    """Return the answer in a datagram, None if it contains none."""
    fields, options = _fields(data, _REPLY), dict(_options(data[_FIXED.size :]))
    kind = _kind(options, DhcpKind.OFFER, DhcpKind.ACK)
    if fields is None or kind is None:
        return None
    server = _address(options, _SERVER) if _SERVER in options else fields.server
    return AddressReply(fields.mac, fields.number, fields.address, server, _address(options, _MASK), kind)


def request(asked: AddressRequest) -> bytes:
    """Return the datagram of a request."""
    options = b""
    if asked.kind:
        options = _option(_KIND, bytes([asked.kind]))
    if asked.kind is DhcpKind.REQUEST:
        options += _option(_SERVER, asked.server.packed) + _option(_REQUESTED, asked.wanted.packed)
    return _packed(_REQUEST, asked.number, asked.mac, NOWHERE, NOWHERE, options)


def answer(asked: AddressRequest, address: IPv4Address, mask: IPv4Address, server: IPv4Address) -> bytes:
    """Return the datagram that answers a request: BOOTP, OFFER for DISCOVER, or ACK for REQUEST."""
    options = b""
    if asked.kind:
        kind = DhcpKind.OFFER if asked.kind is DhcpKind.DISCOVER else DhcpKind.ACK
        options = _option(_KIND, bytes([kind])) + _option(_SERVER, server.packed) + _option(_LEASE, _FOREVER)
    if mask != NOWHERE:
        options += _option(_MASK, mask.packed)
    return _packed(_REPLY, asked.number, asked.mac, address, server, options)


def _packed(code: int, number: int, mac: str, address: IPv4Address, server: IPv4Address, options: bytes) -> bytes:
    hardware = bytes.fromhex(mac.replace(":", ""))
    nowhere = NOWHERE.packed
    head = _FIXED.pack(
        code, _ETHERNET, _LENGTH, 0, number, 0, 0, nowhere, address.packed, server.packed, nowhere, hardware, b"", b""
    )
    return (head + _MAGIC + options + bytes([_END])).ljust(_SHORTEST, b"\0")


class _Fields(NamedTuple):
    """The fixed fields of a packet for Ethernet that are read."""

    mac: str
    number: int
    address: IPv4Address
    server: IPv4Address


def _fields(data: bytes, code: int) -> _Fields | None:
    """Return the fixed fields of a packet for Ethernet, None for any other data."""
    if len(data) < _FIXED.size or data[0] != code or data[1] != _ETHERNET or data[2] != _LENGTH:
        return None
    _, _, _, _, number, _, _, _, address, server, _, hardware, _, _ = _FIXED.unpack_from(data)
    return _Fields(hardware[:_LENGTH].hex(":"), number, IPv4Address(address), IPv4Address(server))


def _option(code: int, value: bytes) -> bytes:
    return bytes([code, len(value)]) + value


def _options(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield the options of the vendor's area; a damaged one ends them."""
    if data[:4] != _MAGIC:
        return
    place = 4
    while place < len(data) and data[place] != _END:
        if data[place] == _PAD:
            place += 1
            continue
        if place + 1 >= len(data):
            return
        end = place + 2 + data[place + 1]
        if end > len(data):
            return
        yield data[place], data[place + 2 : end]
        place = end


def _kind(options: Mapping[int, bytes], *known: DhcpKind) -> DhcpKind | None:
    """Return the kind of a message: NONE without one, and None if it is not among the known ones."""
    value = options.get(_KIND, bytes([DhcpKind.NONE]))
    return next((kind for kind in (DhcpKind.NONE, *known) if value == bytes([kind])), None)


def _address(options: Mapping[int, bytes], code: int) -> IPv4Address:
    value = options.get(code, b"")
    return IPv4Address(value) if len(value) == 4 else NOWHERE
