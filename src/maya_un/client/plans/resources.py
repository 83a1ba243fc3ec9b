"""Plans of the resources: the queue, pallets, zones and the control lease. Units are m, s."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dmc41x3.i18n import phrase
from maya_un.client import requests
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.request import Request
from maya_un.client.steps import Plan, ReadClock, Sleep
from maya_un.client.targets import Spot, plain
from maya_un.client.transport import HeldLease
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, MayaError
from maya_un.schema.people import LeaseTaken, LeaseView

if TYPE_CHECKING:
    from maya_un.config.model import AnyZone
    from maya_un.schema.jobs import JobLine, PalletInfo, Recovery


def teach_pallet(
    name: str, corners: Sequence[Spot], rows: int, columns: int, *, replace: bool = False
) -> Request[PalletInfo]:
    """Store a pallet under `name`, spanned by three or four corners: names of poses, or points [m]."""
    grid = {"corners": [plain(corner) for corner in corners], "rows": rows, "columns": columns}
    return requests.teach_pallet(name, grid, replace=replace)


def keep_out(name: str, *, kind: str, **keys: object) -> Request[AnyZone]:
    """Add a keep-out zone for this run: a "box", "cylinder" or "half_space", with its keys as configured.

    Raises `InvalidRequest` for another kind or a wrong key, and `Busy` during a motion.
    """
    return requests.put_zone(name, {"kind": kind, **keys})


def recovery() -> Plan[Recovery | None]:
    """Return the interrupted job that waits for a decision, None if there is none."""
    return (yield from requests.queue()).recovery


def change(number: int, *, job: JobLike | None = None, version: str = "", **changes: object) -> Request[JobLine]:
    """Change a job before its start: its priority, notes, depends_on, on_failure, retries, stepwise, or all of it.

    With the `version` of its report it is changed only if nobody else has changed it since (`JobChanged`).
    """
    return requests.change_job(number, changes if job is None else {**changes, "job": body_of(job)}, version=version)


_SHARE = 1.0 / 3.0
"""A lease is renewed after this fraction of its duration."""


def give_back() -> Request[LeaseView]:
    """Release the lease; raises `LeaseLost`."""
    return requests.release_lease().urgently()


def kept(held: HeldLease, taken: LeaseTaken) -> Plan[None]:
    """Renew a lease until it is lost; the next request of the client then raises `LeaseLost`.

    If the service does not answer, the renewal is repeated until the lease has expired.
    """
    until = (yield from ReadClock()) + taken.expires_in
    while True:
        yield from Sleep(_SHARE * min(taken.expires_in, until - (yield from ReadClock())))
        asked = yield from ReadClock()
        try:
            yield from requests.renew_lease().within(max(0.1, until - asked)).urgently()
        except (LeaseLost, LeaseHeld, LeaseNeeded) as error:
            held.lose(error if isinstance(error, LeaseLost) else LeaseLost(reason=str(error)))
            return
        except MayaError as error:
            if (yield from ReadClock()) >= until - 0.05:
                held.lose(LeaseLost(reason=phrase("it could not be renewed: {error}", error=error)))
                return
        else:
            until = asked + taken.expires_in
