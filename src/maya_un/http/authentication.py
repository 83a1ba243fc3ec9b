"""Authentication: the source of a request, its caller, and the rights of open connections."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Protocol

from starlette.requests import HTTPConnection

from maya_un.errors import MayaError
from maya_un.http.bridge import Bridge
from maya_un.http.log import written_down
from maya_un.service.access.operations import STOPPING, Caller, Operation

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


LOOK_AGAIN = 1.0
"""Period of the check for expired tokens [s]."""


class RightsSource(Protocol):
    """Source of rights; implemented by `server.bridge.Bridge`."""

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error if the rights have ended."""
        ...

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` in the running loop after each change; return a function that ends this."""
        ...


Who = Callable[[], Caller | None]
"""Returns the caller of a connection, None while unknown."""

Changed = Callable[[Caller | MayaError], None]
"""Called with the caller and the present rights, or the error if they have ended."""


@dataclass(slots=True, eq=False)
class _Watched:
    """A connection."""

    who: Who
    changed: Changed


class Rights:
    """Checks all connections of an interface together; does nothing without connections."""

    def __init__(self, source: RightsSource) -> None:
        self._source = source
        self._watched: list[_Watched] = []
        self._looking: asyncio.Task[None] | None = None
        self._news = asyncio.Event()

    def __len__(self) -> int:
        """Return how many connections are looked at."""
        return len(self._watched)

    @contextmanager
    def watched(self, who: Who, changed: Changed) -> Iterator[None]:
        """Call `changed` after each change of the rights of the caller `who`, while the block runs."""
        one = _Watched(who, changed)
        self._watched.append(one)
        self._news.set()  # its rights may have ended while it came
        if self._looking is None:
            self._looking = asyncio.get_running_loop().create_task(self._look(), name="rights of connections")
        try:
            yield
        finally:
            self._watched.remove(one)
            if not self._watched:
                self._end()

    def _end(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None

    async def _look(self) -> None:
        end = self._source.heard_by(self._news.set)
        try:
            while True:
                with suppress(TimeoutError):
                    async with asyncio.timeout(LOOK_AGAIN):
                        await self._news.wait()
                self._news.clear()
                try:
                    await self._look_once()
                except Exception as defect:  # noqa: BLE001 - nobody awaits this; it is looked again all the same
                    written_down(defect)
        finally:
            end()

    async def _look_once(self) -> None:
        asked = [(one, caller) for one in self._watched if (caller := one.who()) is not None]
        if not asked:
            return
        found = await self._source.current([caller for _, caller in asked])
        for (one, before), now in zip(asked, found, strict=True):
            if now != before and one in self._watched and one.who() is before:
                one.changed(now)
