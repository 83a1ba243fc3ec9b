"""Routes for the faults of the twin."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from fastapi import Response

from maya_un.errors import NotFound, UnknownName
from maya_un.http.exchange import answer, sent
from maya_un.http.request_context import Ask
from maya_un.http.routing import Routes
from maya_un.schema.twin import FaultRequest, FaultsOfTwin
from maya_un.service.access.operations import Operation
from maya_un.service.service import Service
from maya_un.service.twin import TwinService

FaultBody = Annotated[FaultRequest, sent(FaultRequest, optional=True)]

_TWIN = "twin"
_PATH = "/v1/twin/faults"
_EXAMPLES = {"late replies for a minute": {"values": {"seconds": 0.2}, "seconds": 60.0}}


def add_twin(routes: Routes) -> None:
    """Add the routes for the faults of the twin."""

    @routes.add("GET", _PATH, Operation.READ, tag=_TWIN, gives=FaultsOfTwin, refuses=(NotFound,), client="twin_faults")
    async def twin_faults(ask: Ask) -> Response:
        """Return the faults that the twin can have, and the active ones."""
        return await _answered(ask, lambda twin: twin.faults(ask.language))

    @routes.add(
        "PUT",
        _PATH + "/{name}",
        Operation.INJECT,
        tag=_TWIN,
        gives=FaultsOfTwin,
        refuses=(NotFound, UnknownName),
        examples=_EXAMPLES,
        client="inject_fault",
    )
    async def inject_fault(ask: Ask, name: str, body: FaultBody) -> Response:
        """Begin a fault of the twin. It replaces an active fault with the same name at the same place."""
        return await _answered(ask, lambda twin: twin.inject(name, body.values or {}, body.seconds, ask.language))

    @routes.add(
        "DELETE",
        _PATH + "/{name}",
        Operation.INJECT,
        tag=_TWIN,
        gives=FaultsOfTwin,
        refuses=(NotFound, UnknownName),
        client="clear_fault",
    )
    async def clear_fault(ask: Ask, name: str) -> Response:
        """End the active faults of one name."""
        return await _answered(ask, lambda twin: twin.clear(name, ask.language))

    @routes.add(
        "DELETE",
        _PATH,
        Operation.INJECT,
        tag=_TWIN,
        gives=FaultsOfTwin,
        refuses=(NotFound,),
        client="clear_faults",
    )
    async def clear_faults(ask: Ask) -> Response:
        """End all faults of the twin."""
        return await _answered(ask, lambda twin: twin.clear(None, ask.language))


async def _answered(ask: Ask, work: Callable[[TwinService], FaultsOfTwin]) -> Response:
    async def carried_out(service: Service) -> FaultsOfTwin:
        return work(service.faults)

    return answer(await ask(carried_out))
