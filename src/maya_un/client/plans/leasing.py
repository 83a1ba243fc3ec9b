"""The control lease: who drives, and being the one."""

from __future__ import annotations

from typing import Any

from maya_un.api.leasing import LeaseTaken, LeaseView
from maya_un.client.driving import Held
from maya_un.client.steps import Clock, Plan, Request, Rest, get, post
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, MayaError

_SHARE = 1.0 / 3.0
"""A lease is renewed after this share of the time for which it holds."""


def view() -> Request[LeaseView]:
    """Tell who drives, for how long and why, and whether it is oneself."""
    return get("/v1/lease", LeaseView)


def take(note: str, *, force: bool) -> Request[LeaseTaken]:
    """Become the driver; raises `LeaseHeld`, `NotAllowed`."""
    body: dict[str, Any] = {"note": note} if note else {}
    return post("/v1/lease", LeaseTaken, {**body, "force": True} if force else body)


def give_back() -> Request[LeaseView]:
    """Drive no longer; raises `LeaseLost`."""
    return Request("DELETE", "/v1/lease", LeaseView, urgent=True)


def offer(to: str) -> Request[LeaseView]:
    """Let `to` take the lease within a minute; raises `UnknownName`, `NotAllowed`, `LeaseHeld`."""
    return post("/v1/lease/offer", LeaseView, {"to": to})


def ask() -> Request[LeaseView]:
    """Let the one who drives know that one would like to."""
    return post("/v1/lease/ask", LeaseView)


def kept(held: Held, taken: LeaseTaken) -> Plan[None]:
    """Renew a lease until it is lost; whoever uses the client is told by its next request.

    A service that cannot be asked is asked again until the lease has ended by itself.
    """
    until = (yield from Clock()) + taken.expires_in
    while True:
        yield from Rest(_SHARE * min(taken.expires_in, until - (yield from Clock())))
        asked = yield from Clock()
        try:
            yield from Request("POST", "/v1/lease/renew", LeaseView, timeout=max(0.1, until - asked), urgent=True)
        except (LeaseLost, LeaseHeld, LeaseNeeded) as error:
            held.lose(error if isinstance(error, LeaseLost) else LeaseLost(reason=str(error)))
            return
        except MayaError as error:
            if (yield from Clock()) >= until - 0.05:
                held.lose(LeaseLost(reason=f"it could not be renewed: {error}"))
                return
        else:
            until = asked + taken.expires_in
