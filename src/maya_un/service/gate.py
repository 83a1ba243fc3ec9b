"""The gate before the service: every request names its operation, and passes only if role and lease allow it.

Edges call the service through the gate and nowhere else; the audit log tells what was asked and what came of it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

from maya_un.cancellation import is_caller_cancelled, run_to_rest
from maya_un.errors import Cancelled, InternalError, LeaseLost, MayaError
from maya_un.process.lease import ControlLease
from maya_un.service.access.operations import RULES, STOPPING, Caller, Operation, require
from maya_un.service.service import Service

T = TypeVar("T")

OnAudit = Callable[[Caller, Operation, int, str], None]
"""Told of every operation that passed or was refused, with 0 or the code of the error, and what it was about."""

QUIET = frozenset({Operation.READ, Operation.PREVIEW, Operation.RENEW})
"""Operations that the audit log leaves out, because they change nothing."""


def unheard(_caller: Caller, _operation: Operation, _code: int, _detail: str) -> None:
    """Keep no audit log: for a service that nobody shares."""


Current = Callable[[Caller], Caller]
"""Returns a caller with the current rights; raises `NotSignedIn` if they have ended."""


def unchanged(caller: Caller) -> Caller:
    """Return the caller unchanged, for a service without users."""
    return caller


class Gate:
    """Calls `service` for callers, as far as their role and the `lease` allow; `audit` records it.

    `current` returns the present rights of a caller, because the interface may have checked them earlier.
    """

    def __init__(
        self, service: Service, lease: ControlLease, audit: OnAudit = unheard, current: Current = unchanged
    ) -> None:
        self._service = service
        self._lease = lease
        self._audit = audit
        self._current = current

    async def call(
        self, caller: Caller, operation: Operation, wish: Callable[[Service], Awaitable[T]], detail: str = ""
    ) -> T:
        """Return what `wish` answers; `detail` says in the audit log what it is about ("job 17").

        A request that drives ends with its lease: if another user takes the lease, if it expires, or if its holder is
        demoted or removed, the request is cancelled, and its motion stops on the path. Jobs differ: if the owner is
        demoted or removed, the running step is finished, then the queue pauses (`Process.owner_ended`).

        Raises `NotSignedIn` for a caller whose rights ended after the interface checked them, `NotAllowed`,
        `LeaseNeeded`, `LeaseHeld`, `LeaseLost`, and what `wish` raises.
        """
        code = InternalError.code
        try:
            if operation not in STOPPING:
                caller = self._current(caller)
            require(caller, operation)
            answer = await (self._driven(caller, wish) if RULES[operation].drives else wish(self._service))
            code = 0
            return answer
        except MayaError as error:
            code = error.code
            raise
        except asyncio.CancelledError:
            code = Cancelled.code
            raise
        finally:
            if operation not in QUIET:
                self._audit(caller, operation, code, detail)

    async def _driven(self, caller: Caller, wish: Callable[[Service], Awaitable[T]]) -> T:
        """Carry out a request while the caller drives."""
        shown = caller.lease
        if not shown and not caller.implicit:
            self._lease.require(shown, caller.name)
        with self._lease.driving(caller.name, caller.source, shown, direct=True) as drive:
            task = asyncio.ensure_future(wish(self._service))
            drive.carry(task)
            try:
                return await run_to_rest(task)
            except asyncio.CancelledError:
                if not drive.lost or is_caller_cancelled():
                    raise
                raise LeaseLost(reason=drive.lost) from None
