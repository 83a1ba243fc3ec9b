"""The connections of an interface: where each comes from, who calls by it, and the rights of those that stay open."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import TYPE_CHECKING, Protocol

from maya_un.errors import MayaError
from maya_un.http.log import written_down
from maya_un.service.access.operations import STOPPING, Caller, Operation

if TYPE_CHECKING:
    from starlette.requests import HTTPConnection

    from maya_un.http.bridge import Bridge

LEASE = "Maya-Lease"
"""The header that carries the control lease."""

CALLER = "maya_caller"
"""The key of the caller in the ASGI scope of a request from another interface of this process."""

_FORWARDED = ("forwarded", "x-forwarded-for", "x-real-ip")


def source_of(connection: HTTPConnection) -> str:
    """Return the address from which a request came, as in the audit log."""
    return "" if connection.client is None else connection.client.host


def is_local(connection: HTTPConnection) -> bool:
    """Return whether a request was made on this computer.

    A request with a header of forwarding does not count: a proxy on this computer may forward requests from anywhere.
    """
    if any(name in connection.headers for name in _FORWARDED):
        return False
    try:
        return ip_address(source_of(connection)).is_loopback
    except ValueError:
        return False


async def caller_of(connection: HTTPConnection, bridge: Bridge, operations: tuple[Operation, ...]) -> Caller:
    """Return the caller of a request for one of `operations`; raises `NotSignedIn` and `TooManyRequests`."""
    known: Caller | None = connection.scope.get(CALLER)
    if known is not None:
        return known
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
    """Source of rights; implemented by `http.bridge.Bridge`."""

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error that ended the caller's rights."""
        ...

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` in the running loop after each change; return a function that ends this."""
        ...


Who = Callable[[], Caller | None]
"""Returns the caller of a connection, None while unknown."""

Changed = Callable[[Caller | MayaError], None]
"""Called with the caller and the current rights, or with the error that ended them."""


@dataclass(slots=True, eq=False)
class _Watched:
    """A watched connection."""

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
        """Return the number of watched connections."""
        return len(self._watched)

    @contextmanager
    def watched(self, who: Who, changed: Changed) -> Iterator[None]:
        """Call `changed` after each change of the rights of the caller `who`, while the block runs."""
        one = _Watched(who, changed)
        self._watched.append(one)
        self._news.set()  # the rights may have ended before it was watched
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
                except Exception as defect:  # noqa: BLE001 - no code awaits this task; the next check follows anyway
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
