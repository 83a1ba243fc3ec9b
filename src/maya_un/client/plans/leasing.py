"""The control lease: who drives, and being the one."""

from __future__ import annotations

from maya_un.client import requests
from maya_un.client.driving import HeldLease
from maya_un.client.request import Request
from maya_un.client.steps import Plan, ReadClock, Sleep
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, MayaError
from maya_un.schema.people import LeaseTaken, LeaseView

_SHARE = 1.0 / 3.0
"""A lease is renewed after this share of the time for which it holds."""


def give_back() -> Request[LeaseView]:
    """Release the lease; raises `LeaseLost`."""
    return requests.release_lease().urgently()


def kept(held: HeldLease, taken: LeaseTaken) -> Plan[None]:
    """Renew a lease until it is lost; whoever uses the client is told by its next request.

    A service that cannot be asked is asked again until the lease has ended by itself.
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
                held.lose(LeaseLost(reason=f"it could not be renewed: {error}"))
                return
        else:
            until = asked + taken.expires_in
