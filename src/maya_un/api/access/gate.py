"""The gate before the service: every wish names its operation, and passes only where role and lease allow it.

Edges call the service through the gate and nowhere else; the audit log tells what was asked and what came of it.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from maya_un.api.access.caller import Caller
from maya_un.api.access.operations import RULES, Operation, allowed
from maya_un.api.service import Service
from maya_un.errors import MayaError, NotAllowed
from maya_un.process.lease import Lease

T = TypeVar("T")

OnAudit = Callable[[Caller, Operation, int], None]
"""Told of every operation that passed or was refused, with 0 or the code of the error."""

QUIET = frozenset({Operation.READ, Operation.PREVIEW})
"""What the audit log leaves out: it changes nothing."""


class Gate:
    """Lets callers at `service` as far as their role and the `lease` go."""

    def __init__(self, service: Service, lease: Lease, audit: OnAudit) -> None:
        self._service = service
        self._lease = lease
        self._audit = audit

    async def call(self, caller: Caller, operation: Operation, wish: Callable[[Service], Awaitable[T]]) -> T:
        """Return what `wish` answers.

        Raises `NotAllowed`, `LeaseNeeded`, `LeaseHeld`, `LeaseLost`, and what `wish` raises.
        """
        code = 0
        try:
            self.require(caller, operation)
            with self._driving(caller, operation):
                return await wish(self._service)
        except MayaError as error:
            code = error.code
            raise
        finally:
            if operation not in QUIET:
                self._audit(caller, operation, code)

    def require(self, caller: Caller, operation: Operation) -> None:
        """Raise `NotAllowed` where the caller's role does not include `operation`."""
        if not allowed(caller.role, operation):
            needed = RULES[operation].role.word
            raise NotAllowed(who=caller.name, role=caller.role.word, operation=operation.value, needed=needed)

    @contextmanager
    def _driving(self, caller: Caller, operation: Operation) -> Iterator[None]:
        if not RULES[operation].drives:
            yield
        elif caller.implicit and not caller.lease:
            with self._lease.driving(caller.name, caller.source):
                yield
        else:
            self._lease.renew(caller.lease)
            yield
