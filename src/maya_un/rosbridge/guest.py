"""Who is at the other end of a connection: nobody until it is known, and then with the rights that he has now."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from maya_un.api.access.caller import BYSTANDER, ROS, Caller
from maya_un.api.access.operations import STOPPING, Operation, allowed, require
from maya_un.errors import MayaError, NotSignedIn
from maya_un.server.rights import Source


class Admission(Source, Protocol):
    """Where it is known who shows a token; `server.bridge.Bridge` knows it."""

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return who shows a token, `alone` for whoever sits at the machine while no users are kept.

        Raises `NotSignedIn`, `TooManyRequests`.
        """
        ...


class Guest:
    """A client, by where it comes from; `local` says that this is the robot's machine, which may always say stop.

    `lease` is the control lease that it showed, "" where none.
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
        """Who it is, None where that is not known."""
        return self._caller

    @property
    def caller(self) -> Caller:
        """For whom things are done that it asks for: of somebody who is not known a stop, and nothing else."""
        return self._caller or replace(BYSTANDER, source=self.source)

    def require(self, operation: Operation) -> None:
        """Raise `NotSignedIn` or `NotAllowed` where it may not ask for `operation`."""
        if self._caller is not None:
            require(self._caller, operation)
        elif not (self.local and operation in STOPPING):
            raise self._why

    async def introduce(self, admission: Admission, token: str | None) -> None:
        """Take notice of the token that it shows; raises `NotSignedIn`, `TooManyRequests`, and then it is nobody."""
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
        """Take its rights as they are now; tell whether they are no less than before."""
        before, self._caller = self._caller, None if isinstance(now, MayaError) else _at_rights(now)
        if isinstance(now, MayaError):
            self._why = now
        return before is None or (self._caller is not None and self._caller.role >= before.role)


def _at_rights(caller: Caller) -> Caller:
    """Return a caller of a protocol that has no word for the lease.

    Whoever may take it drives for the length of each wish while it is free; others need one that was lent to them.
    """
    if caller.name == ROS.name:
        return replace(ROS, lease=caller.lease)
    return replace(caller, implicit=allowed(caller.role, Operation.LEND) and not caller.lease)
