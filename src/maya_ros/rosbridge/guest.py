"""The client of a connection: unknown until it signs in, then with its present rights."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from maya_un.errors import MayaError, NotSignedIn
from maya_un.http.authentication import RightsSource
from maya_un.service.access.operations import BYSTANDER, ROS, STOPPING, Caller, Operation, allowed, require


class TokenChecker(RightsSource, Protocol):
    """Authenticates tokens; implemented by `server.bridge.Bridge`."""

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return the caller of a token; `alone` for a local client while no users exist.

        Raises `NotSignedIn`, `TooManyRequests`.
        """
        ...


class Guest:
    """A client and its source; a client on the robot's machine (`local`) may always stop.

    `lease` is the control lease that it sent, "" without one.
    """

    def __init__(self, source: str = "", *, local: bool = True, lease: str = "") -> None:
        self.source = source
        self.local = local
        self.left = False
        self._lease = lease
        self._caller: Caller | None = None
        self._why: MayaError = NotSignedIn(reason="the request has none")

    @property
    def known(self) -> Caller | None:
        """The caller, None while unknown."""
        return self._caller

    @property
    def caller(self) -> Caller:
        """The caller of its requests; an unknown one may only stop."""
        return self._caller or replace(BYSTANDER, source=self.source)

    def require(self, operation: Operation) -> None:
        """Raise `NotSignedIn` or `NotAllowed` if it may not request `operation`."""
        if self._caller is not None:
            require(self._caller, operation)
        elif not (self.local and operation in STOPPING):
            raise self._why

    async def introduce(self, admission: TokenChecker, token: str | None) -> None:
        """Sign in with a token; raises `NotSignedIn`, `TooManyRequests`, and then the client is unknown."""
        self._caller = None
        shown = None if token is None else f"Bearer {token}"
        try:
            found = await admission.caller(
                shown, self._lease, self.source, loopback=self.local, stopping=False, alone=ROS
            )
        except MayaError as refusal:
            self._why = refusal
            raise
        self._caller = _at_rights(found)

    def outlasts(self, now: Caller | MayaError) -> bool:
        """Apply the present rights; return whether none are lost."""
        before, self._caller = self._caller, None if isinstance(now, MayaError) else _at_rights(now)
        if isinstance(now, MayaError):
            self._why = now
        return before is None or (self._caller is not None and self._caller.role >= before.role)


def _at_rights(caller: Caller) -> Caller:
    """Return the caller of a protocol without a message for the lease.

    While the lease is free, a role that may take it drives for each command; others need a lent lease.
    """
    if caller.name == ROS.name:
        return replace(ROS, lease=caller.lease)
    return replace(caller, implicit=allowed(caller.role, Operation.LEND) and not caller.lease)
