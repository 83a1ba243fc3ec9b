"""The control lease: at most one user drives the robot at any time, and every client can see who.

The driver renews the lease periodically. A driver that does not renew it in time loses it, and a held motion stops. The
driver can offer the lease to another user, who takes it. A user without a lease drives implicitly for the length of a
command, and so does the owner of a running job. A user who takes the lease meanwhile also takes over the job: the new
driver may slow it down, hold it and stop it. Stop needs no lease.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from dmc41x3.i18n import phrase
from maya_un.cancellation import cancel_once
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded
from maya_un.events import EventLog, LeaseChanged
from maya_un.schema.people import PATIENCE

OFFER = 60.0
"""An offer, or a request for the lease, is valid for this time [s, real time]."""

LINGER = 2.0
"""An implicit driver is shown for this time [s, real time], so that several commands in a row count as one drive."""

_ROUNDING = 1e-6
_MOST_ENDED = 100

OnChange = Callable[[str], None]
"""Called with the reason of a change of holder: taken, released, expired, handed over, broken, or `why` of `drop`."""


@dataclass(frozen=True, slots=True)
class LeaseHolder:
    """The driver: name, source, time of the start [s, loop time], note.

    `id` is the driver's secret. An `implicit` holder drives for the length of commands. `lender` is the user who
    offered the lease, "" if the driver took it.
    """

    name: str
    source: str
    since: float
    note: str = ""
    id: str = field(default="", repr=False)
    implicit: bool = False
    lender: str = ""


@dataclass(slots=True, eq=False)
class LeaseUse:
    """A running activity: a command under the `lease` in the request, a `direct` one without a lease, or a job.

    `lost` is the reason why its lease was lost, "" if it was not.
    """

    name: str
    source: str = ""
    lease: str = ""
    direct: bool = False
    lost: str = ""
    _task: asyncio.Future[Any] | None = None

    def carry(self, task: asyncio.Future[Any]) -> None:
        """Have `task` cancelled once the lease is lost."""
        self._task = task
        if self.lost:
            cancel_once(task)

    def lose(self, why: str) -> None:
        """Mark the lease as lost, and cancel the activity's task."""
        if not self.lost:
            self.lost = why
            cancel_once(self._task)


@dataclass(frozen=True, slots=True)
class _Offer:
    """An offer of the lease: to which user, by which user, until when [s, loop time]."""

    to: str
    by: str
    until: float


class ControlLease:
    """The state of the lease. `speed` is the speed of the loop's clock: patience is in the caller's time.

    After every change of holder the `on_change` callbacks run, before any other task continues.
    """

    def __init__(self, events: EventLog, speed: float = 1.0) -> None:
        self._events = events
        self._scale = max(1.0, speed)
        self._holder: LeaseHolder | None = None
        self._patience = PATIENCE
        self._until = 0.0
        self._watch: asyncio.TimerHandle | None = None
        self._offer: _Offer | None = None
        self._asked: tuple[str, float] | None = None
        self._drives: list[LeaseUse] = []
        self._ended: dict[str, str] = {}
        self.on_change: list[OnChange] = []

    @property
    def holder(self) -> LeaseHolder | None:
        """The present driver, None without one."""
        return self._holder

    @property
    def offered_to(self) -> str | None:
        """The user to whom the lease is offered, None without an offer."""
        return None if self._offer is None or self._now() > self._offer.until else self._offer.to

    @property
    def asked_by(self) -> str | None:
        """The last user who requested the lease within the last minute, or None."""
        asked = self._asked
        return None if asked is None or self._now() > asked[1] else asked[0]

    @property
    def expires_in(self) -> float | None:
        """Time until the lease ends unless renewed [s, real time], None without a holder or if it is implicit."""
        if self._holder is None or self._holder.implicit:
            return None
        return max(0.0, (self._until - self._now()) / self._scale)

    @property
    def held_for(self) -> float:
        """How long the holder has driven [s, real time], 0 without a holder."""
        return 0.0 if self._holder is None else (self._now() - self._holder.since) / self._scale

    @property
    def standing(self) -> object:
        """The facts on which `require_drive` depends: while they are equal, it answers everybody the same."""
        holder = self._holder
        if holder is None or not holder.implicit:
            return (holder,)
        return (holder, *((drive.name, drive.lease, drive.direct) for drive in self._drives if not drive.lost))

    def may_begin(self, owner: str) -> bool:
        """Return whether a job of `owner` may begin: there is no other driver."""
        holder = self._holder
        return holder is None or holder.name == owner or not self._in_force(holder)

    def take(
        self, name: str, source: str, *, note: str = "", patience: float = PATIENCE, force: bool = False
    ) -> LeaseHolder:
        """Become the driver, also of the running job.

        With `force`, also take the lease from another driver, whose commands then end. The lease ends if it is not
        renewed within `patience` [s, real time]. An offered lease is taken from its holder. Raises `LeaseHeld`.
        """
        before, offer = self._holder, self._offer
        offered = offer is not None and self.offered_to == name
        if before is not None and not force and not self._given_way(before, name, offered=offered):
            raise self._held(before)
        if offered:
            why = "handed over"
        elif before is None or before.name == name or not force:
            why = "taken"
        else:
            why = "broken"
        lender = before.lender if before is not None and before.name == name else ""
        lender = offer.by if offer is not None and offered else lender
        new = LeaseHolder(name, source, self._now(), note, secrets.token_urlsafe(16), lender=lender)
        self._patience = patience * self._scale
        self._become(new, why)
        self._watch_until(self._now() + self._patience)
        return new

    def renew(self, lease: str, name: str) -> LeaseHolder:
        """Renew the lease and return its holder; raises as `require`."""
        holder = self.require(lease, name)
        self._until = self._now() + self._patience
        return holder

    def release(self, lease: str, name: str, *, lost: bool = False) -> None:
        """Release the lease, or with `lost` end it as expired; raises as `require`."""
        self.require(lease, name)
        self._end("expired" if lost else "released")

    def drop(self, name: str, why: str) -> None:
        """End the lease and the offers of `name`, who may no longer drive; has no effect without them."""
        if self._offer is not None and name in (self._offer.to, self._offer.by):
            self._offer = None
        if self._holder is not None and self._holder.name == name and not self._holder.implicit:
            self._end(why)

    def offer(self, name: str, by: str) -> None:
        """Let `name` take the lease within a minute, from the holder too."""
        self._offer = _Offer(name, by, self._now() + OFFER * self._scale)
        self._tell("offered", to=name, by=by)

    def ask(self, name: str) -> None:
        """Announce that `name` requests the lease; a repeated request within a minute is not announced."""
        again = self.asked_by == name
        self._asked = name, self._now() + OFFER * self._scale
        if not again:
            self._tell("asked", by=name)

    def require(self, lease: str, name: str) -> LeaseHolder:
        """Return the holder if it is `name` with `lease`; raises `LeaseNeeded`, `LeaseHeld`, `LeaseLost`."""
        holder = self._holder
        if holder is not None and not holder.implicit and self._now() > self._until + _ROUNDING:
            self._end("expired")
            holder = self._holder
        if holder is not None and lease and secrets.compare_digest(_bytes(holder.id), _bytes(lease)):
            if holder.name == name:
                return holder
        elif lease:
            raise LeaseLost(
                reason=self._ended.get(lease, phrase("Maya does not know it; perhaps `maya up` was restarted"))
            )
        if holder is None or self._given_way(holder, name, offered=False):
            raise LeaseNeeded
        raise self._held(holder)

    def require_drive(self, lease: str, name: str, *, implicit: bool) -> None:
        """Raise the error with which a command of `name` under `lease` would be refused; nothing changes.

        An `implicit` user needs no lease. Raises `LeaseNeeded`, `LeaseHeld`, `LeaseLost`.
        """
        if lease or not implicit:
            self.require(lease, name)
        else:
            self._require_free(name)

    @contextmanager
    def driving(self, name: str, source: str, lease: str = "", *, direct: bool = False) -> Iterator[LeaseUse]:
        """Drive for the length of the block: a job of `name`, a command under `lease`, or a `direct` one.

        A command ends with its lease, a direct one only by force. A job never ends: the new driver takes it over.
        Raises as `renew`, and `LeaseHeld` while another user drives.
        """
        if lease:
            self.renew(lease, name)
        else:
            self._join(name, source)
        drive = LeaseUse(name, source, lease, direct)
        self._drives.append(drive)
        try:
            yield drive
        finally:
            self._drives.remove(drive)
            self._settle()

    def close(self) -> None:
        """Cancel the timer of the lease."""
        if self._watch is not None:
            self._watch.cancel()
            self._watch = None

    def _given_way(self, holder: LeaseHolder, name: str, *, offered: bool) -> bool:
        """Return whether `holder` yields to `name`: by an offer, or because only jobs of the holder run."""
        others = any(drive.direct and not drive.lost and drive.name != name for drive in self._drives)
        return (offered or holder.implicit) and not others

    def _in_force(self, holder: LeaseHolder) -> bool:
        """Return whether `holder` drives: by the lease, or because an activity without a lease runs."""
        return not holder.implicit or bool(self._going())

    def _going(self) -> list[LeaseUse]:
        """Return the running activities without a lease."""
        return [drive for drive in self._drives if not drive.lease and not drive.lost]

    def _join(self, name: str, source: str) -> None:
        """Begin to drive without a lease, or under the lease that `name` holds; raises `LeaseHeld`."""
        self._require_free(name)
        holder = self._holder
        if holder is None or holder.name != name:
            self._become(LeaseHolder(name, source, self._now(), implicit=True), "taken")

    def _require_free(self, name: str) -> None:
        holder = self._holder
        if holder is not None and not self.may_begin(name):
            raise self._held(holder)

    def _settle(self) -> None:
        """Show the owner of an activity without a lease as the driver, and for `LINGER` after the last has ended."""
        holder, going = self._holder, self._going()
        if holder is not None and (not holder.implicit or holder.name in {drive.name for drive in going}):
            return
        if going:
            drive = next((one for one in going if one.direct), going[0])  # a new driver would end it
            self._become(LeaseHolder(drive.name, drive.source, self._now(), implicit=True), "taken")
        elif holder is not None:
            self._watch_until(self._now() + LINGER * self._scale)

    def _become(self, new: LeaseHolder, why: str) -> None:
        """Make `new` the holder; other users' activities lose the lease, except jobs."""
        before, self._holder = self._holder, new
        self.close()
        if not new.implicit:
            self._offer = self._asked = None
        self._remember(before, why)
        for drive in self._drives:
            if drive.lease or (drive.direct and drive.name != new.name):
                drive.lose(why)
        self._changed(why, before)

    def _end(self, why: str) -> None:
        """End the holder's lease; the owner of a running activity without a lease then drives implicitly."""
        before, self._holder = self._holder, None
        self.close()
        self._remember(before, why)
        for drive in self._drives:
            if drive.lease:
                drive.lose(why)
        self._changed(why, before)
        self._settle()

    def _remember(self, holder: LeaseHolder | None, why: str) -> None:
        """Store why the last leases ended, for the error of requests that still present them."""
        if holder is not None and holder.id:
            self._ended[holder.id] = why
            while len(self._ended) > _MOST_ENDED:
                del self._ended[next(iter(self._ended))]

    def _watch_until(self, due: float) -> None:
        self.close()
        self._until = due
        self._watch = asyncio.get_running_loop().call_at(due, self._look)

    def _look(self) -> None:
        """End a lease that was not renewed, or schedule the next check."""
        self._watch = None
        holder = self._holder
        if holder is None or (holder.implicit and self._going()):
            return
        if self._now() < self._until - _ROUNDING:
            self._watch_until(self._until)
        else:
            self._end("released" if holder.implicit else "expired")

    def _changed(self, why: str, before: LeaseHolder | None) -> None:
        self._tell(why, before="" if before is None else before.name)
        for told in tuple(self.on_change):
            try:
                told(why)
            except Exception as defect:  # noqa: BLE001 - one failing callback must not affect the others, nor the taker
                report = {"message": "a change of the lease was not taken notice of", "exception": defect}
                asyncio.get_running_loop().call_exception_handler(report)

    def _tell(self, why: str, *, before: str | None = None, to: str | None = None, by: str | None = None) -> None:
        holder = self._holder
        name, source = ("", "") if holder is None else (holder.name, holder.source)
        implicit = holder is not None and holder.implicit
        self._events.emit(LeaseChanged(why, name, source, implicit, before, to, by))

    def _held(self, holder: LeaseHolder) -> LeaseHeld:
        return LeaseHeld(holder=holder.name, since=f"{self.held_for:.0f} s")

    def _now(self) -> float:
        return asyncio.get_running_loop().time()


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")
