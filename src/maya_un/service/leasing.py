"""The control lease for the service: taking, offering and releasing it; a held motion ends with it."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

from maya_un.errors import InvalidValue, UnknownName
from maya_un.process.lease import LeaseHolder
from maya_un.schema.bodies import LONGEST, PATIENCE
from maya_un.schema.people import LeaseTaken, LeaseView
from maya_un.service.access.control import AccessControl, require_note
from maya_un.service.access.operations import Caller, Operation, Role, require


class LeaseService:
    """Asks and changes the lease of an `entrance`.

    `halt` stops held jogs: it is called whenever somebody else drives, or nobody.
    """

    def __init__(self, entrance: AccessControl, halt: Callable[[], None]) -> None:
        self._lease = lease = entrance.lease
        self._register = entrance.register
        self._halt = halt
        self._driver = ""
        self._token = ""
        lease.on_change.insert(0, self._changed)

    async def view(self, by: Caller) -> LeaseView:
        """Return who drives now."""
        lease, holder = self._lease, self._lease.holder
        nobody = LeaseHolder("", "", 0.0)
        shown = holder or nobody
        return LeaseView(
            shown.name,
            shown.source,
            lease.held_for,
            shown.note,
            shown.implicit,
            lease.expires_in,
            lease.offered_to,
            lease.asked_by,
            yours=holder is not None and _shows(by, holder),
        )

    async def take(self, by: Caller, *, note: str = "", patience: float = PATIENCE, force: bool = False) -> LeaseTaken:
        """Become the driver, for as long as it is renewed within `patience` [s, real time].

        An operator takes the free lease; a student takes one that an operator offers. With `force`, users take their
        own lease again, operators take back a lent one, and administrators take it from anybody; the activity of the
        former driver ends. Raises `LeaseHeld`, `NotAllowed`, `InvalidValue`.
        """
        require_note(note)
        if not (isfinite(patience) and 1.0 <= patience <= LONGEST):
            raise InvalidValue(key="patience", value=patience, reason=f"it is 1 s to {LONGEST:.0f} s")
        holder = self._lease.holder
        again = force and holder is not None and holder.name == by.name and not holder.implicit
        if self._lease.offered_to != by.name and not again:
            require(by, Operation.LEND)
        if force and holder is not None:
            self._require_power(by, holder)
        taken = self._lease.take(by.name, by.source, note=note, patience=patience, force=force)
        self._token = by.token
        return LeaseTaken(taken.id, taken.name, taken.note, patience)

    async def renew(self, by: Caller) -> LeaseView:
        """Say that one is still there; raises `LeaseLost`, `LeaseNeeded`, `LeaseHeld`."""
        self._lease.renew(by.lease, by.name)
        return await self.view(by)

    async def release(self, by: Caller, *, lost: bool = False) -> LeaseView:
        """Give it back, or with `lost` end it because nobody hears from its holder any more; raises as `renew`."""
        self._lease.release(by.lease, by.name, lost=lost)
        return await self.view(by)

    async def offer(self, to: str, by: Caller) -> LeaseView:
        """Let `to` take it within a minute: its holder does, or an operator while it is free or lent.

        Raises `UnknownName`, `NotAllowed`, and `LeaseHeld` where it is somebody else's.
        """
        require(by, Operation.LEND)
        holder = self._lease.holder
        if holder is not None and not holder.implicit and not _shows(by, holder):
            self._require_power(by, holder)
        names = self._register.drivers()
        if to not in names:
            raise UnknownName(name=to, known=", ".join(names) or "no users")
        self._lease.offer(to, by.name)
        return await self.view(by)

    async def ask(self, by: Caller) -> LeaseView:
        """Let everybody know that one would like to drive."""
        self._lease.ask(by.name)
        return await self.view(by)

    def rights_ended(self, token: str, name: str, why: str) -> None:
        """End the lease that `name` holds, who may not drive any more; with a `token`, where he took it with that."""
        if not token or token == self._token:
            self._lease.drop(name, why)

    def _require_power(self, by: Caller, holder: LeaseHolder) -> None:
        """Raise `NotAllowed` where `by` may not take the lease from `holder`."""
        lent = bool(holder.lender) and by.role >= Role.OPERATOR
        if holder.name != by.name and not lent:
            require(by, Operation.BREAK)

    def _changed(self, _why: str) -> None:
        holder = self._lease.holder
        driver = "" if holder is None else holder.name
        if driver != self._driver:
            self._driver = driver
            self._token = ""
            self._halt()


def _shows(by: Caller, holder: LeaseHolder) -> bool:
    return holder.name == by.name and bool(by.lease) and holder.id == by.lease
