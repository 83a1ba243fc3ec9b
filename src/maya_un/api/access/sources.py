"""Sources of requests, for counting: all addresses of one machine are one source."""

from __future__ import annotations

from ipaddress import IPv6Address, ip_address

LOOPBACK = "127.0.0.1"
"""The one name of this machine for all of its loopback addresses."""


def counted(source: str) -> str:
    """Return the source of an address; text after a space is ignored.

    All of 127.0.0.0/8 and ::1 are this machine. An IPv6 address stands for its /64, because one machine may have all
    of its addresses. An IPv4 address in IPv6 form is that IPv4 address. A text that is not an address is unchanged.
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
