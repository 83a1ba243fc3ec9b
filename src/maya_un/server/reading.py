"""The paths that only look: status, events, the twin's table."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Response

from maya_un.api.access.operations import Operation
from maya_un.api.history import MOST_EVENTS
from maya_un.api.service import Service
from maya_un.errors import EventsForgotten, NotFound
from maya_un.schema.robot import EventMessage, Status, Table
from maya_un.server.asking import Ask
from maya_un.server.bridge import Bridge
from maya_un.server.exchange import answer
from maya_un.server.numbers import MOST
from maya_un.server.routes import Routes

LONGEST_WAIT = 60.0
"""Longest wait for a new event [s, real time]."""

FEW_EVENTS = 100
"""So many are answered at once; for more, whoever asks waits for a turn."""

_TAG = "looking"


def add_reading(routes: Routes, bridge: Bridge) -> None:
    """Add the paths."""

    @routes.add("GET", "/v1/status", Operation.READ, tag=_TAG, gives=Status, client="status")
    async def status(ask: Ask) -> Response:
        """Return everything about now: the machine, the motion under way, the queue."""
        return answer(await ask(lambda service: service.status()))

    @routes.add("GET", "/v1/events", Operation.READ, tag=_TAG, gives=list[EventMessage], refuses=(EventsForgotten,))
    async def events(
        ask: Ask,
        since: Annotated[int, Query(ge=0, le=MOST, description="numbered above")] = 0,
        wait: Annotated[float, Query(ge=0, le=LONGEST_WAIT, description="for one, where there is none [s]")] = 0.0,
        run: Annotated[int | None, Query(ge=1, le=MOST, description="of this run; without it, of the present")] = None,
        limit: Annotated[int, Query(ge=1, le=MOST_EVENTS, description="so many at most")] = MOST_EVENTS,
    ) -> Response:
        """Return the events numbered above `since`, oldest first.

        Without any, wait up to `wait` seconds for one.
        """
        asked = bridge.events(ask.caller, since, wait, run, min(limit, FEW_EVENTS))
        few = await (ask.while_allowed(asked, Operation.READ) if wait else asked)
        if len(few) < FEW_EVENTS or limit == FEW_EVENTS:
            return answer(few)
        async with bridge.past.turn():
            return answer(await bridge.events(ask.caller, since, 0.0, run, limit))

    @routes.add("GET", "/v1/twin", Operation.READ, tag=_TAG, gives=Table, refuses=(NotFound,))
    async def twin(ask: Ask) -> Response:
        """Return where the parts stand on the twin's table [m], by its own record."""

        async def looked_at(_service: Service) -> Table:
            if bridge.parts is None:
                raise NotFound(what="twin", number="on a real machine")
            return Table(dict(bridge.parts()))

        return answer(await ask(looked_at))
