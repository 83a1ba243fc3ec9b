"""The context of a request: its caller, its operation, and its answer."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Annotated, TypeVar

from fastapi import Depends, Request

from dmc41x3.i18n import phrase
from maya_un.errors import Cancelled, InvalidRequest, MayaError
from maya_un.http.bridge import Bridge
from maya_un.http.connections import Rights, caller_of
from maya_un.http.errors import language_of
from maya_un.http.routing import RouteRule, rule_of
from maya_un.service.access.operations import Caller, Operation, allowed, require
from maya_un.service.service import Service

T = TypeVar("T")


class RequestContext:
    """Calls the service for `caller` with the operations of the route; `subject` is that of the audit log.

    `stops` is the number of stops of the robot when the request came.
    """

    def __init__(
        self,
        request: Request,
        bridge: Bridge,
        caller: Caller,
        operations: tuple[Operation, ...],
        subject: str,
        stops: int,
    ) -> None:
        self._request = request
        self.bridge = bridge
        self._operations = operations
        self._subject = subject
        self._stops = stops
        self.caller = caller

    @property
    def language(self) -> str:
        """The language that the client prefers."""
        return language_of(self._request.headers)

    async def __call__(self, work: Callable[[Service], Awaitable[T]], *operations: Operation, subject: str = "") -> T:
        """Return the result of `work`; `subject` is that of the audit log, by default the one in the path.

        It is called as the first of `operations`, by default all operations of the route, that the caller's role
        includes; if the role includes none, as the last, which is refused.
        """
        of = operations or self._operations
        chosen = next((one for one in of if allowed(self.caller.role, one)), of[-1])
        return await self.bridge.call(self.caller, chosen, work, subject or self._subject, stops=self._stops)

    async def unless_left(self, work: Callable[[Service], Awaitable[T]]) -> T:
        """Return the answer of `work`; if the client disconnects, cancel it and raise `Cancelled`.

        The body of the request must have been read.
        """
        asked = asyncio.ensure_future(self(work))
        left = asyncio.ensure_future(self._left())
        try:
            await asyncio.wait({asked, left}, return_when=asyncio.FIRST_COMPLETED)
            if not asked.done():
                raise Cancelled
            return asked.result()
        finally:
            asked.cancel()
            left.cancel()
            await asyncio.wait({asked, left})

    async def while_allowed(self, answer: Awaitable[T], operation: Operation) -> T:
        """Return a slow answer; raises `NotSignedIn` or `NotAllowed` if the caller's rights end before."""
        asked = asyncio.ensure_future(answer)
        ended: asyncio.Future[MayaError] = asyncio.get_running_loop().create_future()

        def changed(now: Caller | MayaError) -> None:
            refusal = _refusal(now, operation)
            if refusal is not None and not ended.done():
                ended.set_result(refusal)

        rights: Rights = self._request.app.state.rights
        try:
            with rights.watched(lambda: self.caller, changed):
                await asyncio.wait({asked, ended}, return_when=asyncio.FIRST_COMPLETED)
            if not asked.done():
                raise ended.result()
            return asked.result()
        finally:
            asked.cancel()
            await asyncio.wait({asked})

    async def _left(self) -> None:
        while (await self._request.receive())["type"] != "http.disconnect":
            pass


def _refusal(now: Caller | MayaError, operation: Operation) -> MayaError | None:
    """Return the error that now refuses an operation to a caller, None if it is still allowed."""
    if isinstance(now, MayaError):
        return now
    try:
        require(now, operation)
    except MayaError as refusal:
        return refusal
    return None


async def _asking(request: Request) -> RequestContext:
    rule = rule_of(request)
    bridge: Bridge = request.app.state.bridge
    stops = bridge.stops  # to identify a caller takes time, and a stop may be answered meanwhile
    caller = await caller_of(request, bridge, rule.operations)
    request.state.who = caller.name
    subject = _subject(request)
    if not any(allowed(caller.role, operation) for operation in rule.operations):
        await bridge.call(caller, rule.operations[-1], _nothing, subject)  # refused before the body is read
    _refuse_unknown(request, rule)
    return RequestContext(request, bridge, caller, rule.operations, subject, stops)


async def _nothing(_service: Service) -> None:
    """Do nothing."""


def _subject(request: Request) -> str:
    """Return the subject of a request from its path, like "job 17"; "" if the path names none."""
    return " ".join(f"{kind} {name}" for kind, name in request.path_params.items())


def _refuse_unknown(request: Request, rule: RouteRule) -> None:
    for key in request.query_params:
        if key not in rule.query:
            raise InvalidRequest(
                key=f"query.{key}", reason=phrase("known here: {names}", names=", ".join(rule.query) or phrase("none"))
            )


Ask = Annotated[RequestContext, Depends(_asking)]
"""The context of a request, through which a route calls the service."""
