"""Sources of requests, for counting: one machine is one source, however many addresses it has."""

from __future__ import annotations

from ipaddress import IPv6Address, ip_address

LOOPBACK = "127.0.0.1"
"""The one name of this machine for all of its loopback addresses."""


def counted(source: str) -> str:
    """Return what is counted of an address, which more may follow after a space.

    This machine has all of 127.0.0.0/8 and ::1; of an IPv6 address it is the /64, all of whose addresses one machine
    may have. An IPv4 address in the form of an IPv6 one is that IPv4 address. A text that is no address is left.
    """
    text, space, rest = source.partition(" ")
    try:
        address = ip_address(text.partition("%")[0])
    except ValueError:
        return source
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    if address.is_loopback:
        return LOOPBACK + space + rest
    return (address.exploded[:19] if isinstance(address, IPv6Address) else str(address)) + space + rest
