"""The paths of the control lease: who drives, taking it, keeping it, handing it on."""

from __future__ import annotations

from typing import Annotated

from fastapi import Response

from maya_un.api.access.operations import Operation
from maya_un.errors import LeaseHeld, LeaseLost, LeaseNeeded, UnknownName
from maya_un.schema.bodies import Offering, Taking
from maya_un.schema.people import LeaseTaken, LeaseView
from maya_un.server.asking import Ask
from maya_un.server.exchange import answer, sent
from maya_un.server.routes import Routes

_TAG = "lease"
_OWN = (LeaseLost, LeaseNeeded, LeaseHeld)

TakingBody = Annotated[Taking, sent(Taking, optional=True)]
OfferingBody = Annotated[Offering, sent(Offering)]


def add_lease(routes: Routes) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/lease", Operation.READ, tag=_TAG, gives=LeaseView, client="lease.view")
    async def lease(ask: Ask) -> Response:
        """Return who has the control lease, for how long and why, and whether it is the caller."""
        return answer(await ask(lambda service: service.lease.view(ask.caller)))

    notes = {"with a note": {"note": "aligning the tray"}, "from whoever holds it": {"force": True}}

    @routes.add(
        "POST",
        "/v1/lease",
        Operation.LEND,
        Operation.LEASE,
        tag=_TAG,
        gives=LeaseTaken,
        refuses=(LeaseHeld,),
        examples=notes,
    )
    async def take_lease(ask: Ask, body: TakingBody) -> Response:
        """Take the control lease; show the `id` of the answer as header `Maya-Lease`."""
        taken = ask(
            lambda service: service.lease.take(ask.caller, note=body.note, patience=body.patience, force=body.force)
        )
        return answer(await taken)

    @routes.add("POST", "/v1/lease/renew", Operation.RENEW, tag=_TAG, gives=LeaseView, refuses=_OWN)
    async def renew_lease(ask: Ask) -> Response:
        """Renew the control lease."""
        return answer(await ask(lambda service: service.lease.renew(ask.caller)))

    @routes.add("DELETE", "/v1/lease", Operation.LEASE, tag=_TAG, gives=LeaseView, refuses=_OWN)
    async def release_lease(ask: Ask) -> Response:
        """Release the control lease."""
        return answer(await ask(lambda service: service.lease.release(ask.caller)))

    offers = {"to a student": {"to": "ana"}}
    offering = (LeaseHeld, UnknownName)

    @routes.add(
        "POST",
        "/v1/lease/offer",
        Operation.LEND,
        tag=_TAG,
        gives=LeaseView,
        refuses=offering,
        examples=offers,
        client="lease.offer",
    )
    async def offer_lease(ask: Ask, body: OfferingBody) -> Response:
        """Offer the control lease to a user, who may take it within a minute."""
        return answer(await ask(lambda service: service.lease.offer(body.to, ask.caller)))

    @routes.add("POST", "/v1/lease/ask", Operation.LEASE, tag=_TAG, gives=LeaseView, client="lease.ask")
    async def ask_for_lease(ask: Ask) -> Response:
        """Ask the holder for the control lease."""
        return answer(await ask(lambda service: service.lease.ask(ask.caller)))
