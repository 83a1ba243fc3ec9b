"""Failed attempts to sign in, counted by source; all addresses of one machine are one source."""

from __future__ import annotations

from collections import deque
from ipaddress import IPv6Address, ip_address
from math import ceil

from maya_un.errors import TooManyRequests

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


LIMIT = 10
"""Failed attempts of one source within `WINDOW`."""

WINDOW = 60.0
"""How long a failed attempt counts [s, real time]."""

_MOST_SOURCES = 10_000


class Attempts:
    """Counts attempts by source; `scale` is how fast the loop's clock runs.

    An attempt counts from its beginning, so that many at a time are not all let in before the first has failed.
    """

    def __init__(self, scale: float = 1.0) -> None:
        self._scale = max(1.0, scale)
        self._by_source: dict[str, deque[float]] = {}

    def begin(self, source: str, now: float) -> None:
        """Count an attempt at `now` [s, loop time]; raises `TooManyRequests`."""
        source = counted(source)
        window = WINDOW * self._scale
        past = self._by_source.pop(source, None) or deque[float]()
        self._by_source[source] = past
        while past and past[0] <= now - window:
            past.popleft()
        if len(past) >= LIMIT:
            wait = ceil((past[0] + window - now) / self._scale)
            raise TooManyRequests(limit=LIMIT, seconds=f"{WINDOW:.0f}", wait=wait)
        past.append(now)
        if len(self._by_source) > _MOST_SOURCES:
            del self._by_source[next(iter(self._by_source))]

    def succeeded(self, source: str) -> None:
        """Take the latest attempt back: it was right."""
        source = counted(source)
        past = self._by_source.get(source)
        if past:
            past.pop()
        if not past:
            self._by_source.pop(source, None)
