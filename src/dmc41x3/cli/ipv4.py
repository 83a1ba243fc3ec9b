"""Addresses and subnet masks of IPv4 that a person gives to a controller."""

from __future__ import annotations

from ipaddress import IPv4Address, IPv4Network

from dmc41x3.errors import InvalidValue
from dmc41x3.i18n import phrase

LAST = 223
"""Last first number of the addresses of single devices; the multicast addresses follow."""


def parse_address(text: str, key: str) -> IPv4Address:
    """Return an address of one device, like 192.168.1.20; raises `InvalidValue`, also if no device can have it."""
    address = _quad(text, key)
    if not 1 <= address.packed[0] <= LAST:
        raise InvalidValue(key=key, value=text, reason=phrase("its first number must be 1 to {last}", last=LAST))
    return address


def parse_mask(text: str) -> IPv4Address:
    """Return a subnet mask, like 255.255.255.0; raises `InvalidValue`."""
    mask = _quad(text, "--mask")
    if not is_mask(mask):
        raise InvalidValue(key="--mask", value=text, reason=phrase("it must be like 255.255.255.0"))
    return mask


def _quad(text: str, key: str) -> IPv4Address:
    try:
        return IPv4Address(text)
    except ValueError as error:
        raise InvalidValue(key=key, value=text, reason=phrase("it must be like 192.168.1.20")) from error


def is_mask(mask: IPv4Address) -> bool:
    """Return whether the bits of a mask are ones, then zeros."""
    zeros = ~int(mask) & 0xFFFFFFFF
    return zeros & (zeros + 1) == 0


def require_host(address: IPv4Address, mask: IPv4Address, key: str, value: object) -> None:
    """Raise `InvalidValue` about `value` if `address` is the first or the last one of its network.

    The first address names the network, and the last one means all its devices.
    """
    network = IPv4Network((address, int(mask).bit_count()), strict=False)
    if address == network.network_address:
        reason = phrase("{address} names the network {network}, not a device", address=address, network=network)
    elif address == network.broadcast_address:
        reason = phrase("{address} means all devices of the network {network}", address=address, network=network)
    else:
        return
    raise InvalidValue(key=key, value=str(value), reason=reason)


def require_outside(address: IPv4Address, inside: bool, key: str) -> None:
    """Raise `InvalidValue` for an address of the loopback, except if the controller is `inside` this computer."""
    if address.is_loopback and not inside:
        reason = phrase("only a twin on this computer can have it")
        raise InvalidValue(key=key, value=str(address), reason=reason)
