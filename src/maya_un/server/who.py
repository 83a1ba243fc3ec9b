"""Authentication: the source of a connection, its credentials, and the caller that results."""

from __future__ import annotations

from ipaddress import ip_address

from starlette.requests import HTTPConnection

from maya_un.api.access.caller import Caller
from maya_un.api.access.operations import STOPPING, Operation
from maya_un.server.bridge import Bridge

LEASE = "Maya-Lease"
"""The header that shows the control lease."""

_FORWARDED = ("forwarded", "x-forwarded-for", "x-real-ip")


def source_of(connection: HTTPConnection) -> str:
    """Return the address that a request came from, as the audit log has it."""
    return "" if connection.client is None else connection.client.host


def is_local(connection: HTTPConnection) -> bool:
    """Tell whether a request was made on this machine.

    One that says it was forwarded was not: a proxy on this machine hands on what comes from anywhere.
    """
    if any(name in connection.headers for name in _FORWARDED):
        return False
    try:
        return ip_address(source_of(connection)).is_loopback
    except ValueError:
        return False


async def caller_of(connection: HTTPConnection, bridge: Bridge, operations: tuple[Operation, ...]) -> Caller:
    """Return who asks for one of `operations`; raises `NotSignedIn` and `TooManyRequests`."""
    return await bridge.caller(
        connection.headers.get("authorization"),
        connection.headers.get(LEASE, ""),
        source_of(connection),
        loopback=is_local(connection),
        stopping=STOPPING.issuperset(operations) and bool(operations),
    )
