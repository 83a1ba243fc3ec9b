"""Request and answer of every route.

Authentication: the source of a request, its caller by token or session, and the rights of open connections. Input and
output: path numbers, bodies parsed as messages, answers as JSON.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Annotated, Any, Protocol

from fastapi import Depends, Path, Request, Response
from pydantic import TypeAdapter, ValidationError
from starlette.requests import HTTPConnection

from maya_un.errors import InvalidRequest, InvalidValue, MayaError
from maya_un.http.bridge import Bridge
from maya_un.http.log import written_down
from maya_un.process.spec.json_object import decode_object
from maya_un.schema.encoding import to_json
from maya_un.service.access.operations import STOPPING, Caller, Operation

LEASE = "Maya-Lease"
"""The header that carries the control lease."""

CALLER = "maya_caller"
"""The key of the caller in the ASGI scope of a request from another interface of this process."""

_FORWARDED = ("forwarded", "x-forwarded-for", "x-real-ip")


def source_of(connection: HTTPConnection) -> str:
    """Return the address from which a request came, as in the audit log."""
    return "" if connection.client is None else connection.client.host


def is_local(connection: HTTPConnection) -> bool:
    """Return whether a request was made on this computer.

    A request with a header of forwarding does not count: a proxy on this computer may forward requests from anywhere.
    """
    if any(name in connection.headers for name in _FORWARDED):
        return False
    try:
        return ip_address(source_of(connection)).is_loopback
    except ValueError:
        return False


async def caller_of(connection: HTTPConnection, bridge: Bridge, operations: tuple[Operation, ...]) -> Caller:
    """Return the caller of a request for one of `operations`; raises `NotSignedIn` and `TooManyRequests`."""
    known: Caller | None = connection.scope.get(CALLER)
    if known is not None:
        return known
    return await bridge.caller(
        connection.headers.get("authorization"),
        connection.headers.get(LEASE, ""),
        source_of(connection),
        loopback=is_local(connection),
        stopping=STOPPING.issuperset(operations) and bool(operations),
    )


LOOK_AGAIN = 1.0
"""Period of the check for expired tokens [s]."""


class RightsSource(Protocol):
    """Source of rights; implemented by `http.bridge.Bridge`."""

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return each caller with the current role, or the error that ended the caller's rights."""
        ...

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` in the running loop after each change; return a function that ends this."""
        ...


Who = Callable[[], Caller | None]
"""Returns the caller of a connection, None while unknown."""

Changed = Callable[[Caller | MayaError], None]
"""Called with the caller and the current rights, or with the error that ended them."""


@dataclass(slots=True, eq=False)
class _Watched:
    """A watched connection."""

    who: Who
    changed: Changed


class Rights:
    """Checks all connections of an interface together; does nothing without connections."""

    def __init__(self, source: RightsSource) -> None:
        self._source = source
        self._watched: list[_Watched] = []
        self._looking: asyncio.Task[None] | None = None
        self._news = asyncio.Event()

    def __len__(self) -> int:
        """Return the number of watched connections."""
        return len(self._watched)

    @contextmanager
    def watched(self, who: Who, changed: Changed) -> Iterator[None]:
        """Call `changed` after each change of the rights of the caller `who`, while the block runs."""
        one = _Watched(who, changed)
        self._watched.append(one)
        self._news.set()  # the rights may have ended before it was watched
        if self._looking is None:
            self._looking = asyncio.get_running_loop().create_task(self._look(), name="rights of connections")
        try:
            yield
        finally:
            self._watched.remove(one)
            if not self._watched:
                self._end()

    def _end(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None

    async def _look(self) -> None:
        end = self._source.heard_by(self._news.set)
        try:
            while True:
                with suppress(TimeoutError):
                    async with asyncio.timeout(LOOK_AGAIN):
                        await self._news.wait()
                self._news.clear()
                try:
                    await self._look_once()
                except Exception as defect:  # noqa: BLE001 - no code awaits this task; the next check follows anyway
                    written_down(defect)
        finally:
            end()

    async def _look_once(self) -> None:
        asked = [(one, caller) for one in self._watched if (caller := one.who()) is not None]
        if not asked:
            return
        found = await self._source.current([caller for _, caller in asked])
        for (one, before), now in zip(asked, found, strict=True):
            if now != before and one in self._watched and one.who() is before:
                one.changed(now)


MOST = 2**53
"""The greatest number that JSON carries exactly."""

JobNumber = Annotated[int, Path(ge=1, le=MOST, description="number of a job")]
"""The number of a job."""


LONG = 16_384
"""Longest body that is parsed in the loop [bytes]; only bodies that may contain a job can be longer."""


class BodyReader:
    """Parses the object in a request's body as one of `kinds`; a route declares it with `sent`.

    With several kinds, `choose` returns the kind of an object. With `optional`, an empty body means an empty object.
    """

    def __init__(self, *kinds: type, choose: Callable[[Mapping[str, Any]], type] | None = None, optional: bool) -> None:
        self.kinds = kinds
        self.optional = optional
        self.choose = choose
        self._adapters: dict[type, TypeAdapter[Any]] = {kind: TypeAdapter(kind) for kind in kinds}

    async def __call__(self, request: Request) -> Any:
        """Return the parsed body; raises `InvalidRequest` and `InvalidValue`."""
        body = await request.body()
        if not body.strip() and self.optional:
            body = b"{}"
        found = decode_object(body)
        kind = self.kinds[0] if self.choose is None else self.choose(found)
        try:
            return self._adapters[kind].validate_json(body, strict=True)
        except ValidationError as error:
            raise refusal(error) from error


def refusal(error: ValidationError) -> MayaError:
    """Return Maya's error for the first error that pydantic found."""
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"]) or "body"
    match first["type"]:
        case "missing":
            return InvalidRequest(key=key, reason="it is missing")
        case "unexpected_keyword_argument" | "extra_forbidden":
            return InvalidRequest(key=key, reason="there is no such key")
        case _:
            words = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
            return InvalidValue(key=key, value=repr(first["input"])[:64], reason=f"it {words}")


def sent(*kinds: type, choose: Callable[[Mapping[str, Any]], type] | None = None, optional: bool = False) -> Any:
    """Return the dependency of a route on the message in its request's body."""
    return Depends(BodyReader(*kinds, choose=choose, optional=optional), use_cache=False)


class RawBody:
    """Base of bodies that are not parsed as a message; `schema` describes the body."""

    def __init__(self, schema: Mapping[str, Any]) -> None:
        self.schema = schema


class ParsedBody(RawBody):
    """Parses the object of a request; a worker parses one longer than `LONG`."""

    async def __call__(self, request: Request) -> dict[str, Any]:
        """Return the body as an object; raises `InvalidRequest`."""
        body = await request.body()
        if len(body) <= LONG:
            return decode_object(body)
        bridge: Bridge = request.app.state.bridge
        return await bridge.asked(lambda service: service.previews.decoded(body, source_of(request)))


class LongBody(RawBody):
    """Parses the object of a request; passes one longer than `LONG` on as bytes, for a worker."""

    async def __call__(self, request: Request) -> dict[str, Any] | bytes:
        """Return the object, or the bytes; raises `InvalidRequest`."""
        body = await request.body()
        return body if len(body) > LONG else decode_object(body)


def sent_long(schema: Mapping[str, Any]) -> Any:
    """Return the dependency of a route on an object that may be long."""
    return Depends(LongBody(schema), use_cache=False)


def sent_as_written(schema: Mapping[str, Any]) -> Any:
    """Return the dependency of a route on an object that the service parses further."""
    return Depends(ParsedBody(schema), use_cache=False)


def answer(value: object, status: int = 200) -> Response:
    """Return a message as an answer."""
    return as_json(to_json(value), status)


def as_json(data: bytes, status: int = 200) -> Response:
    """Return an answer from JSON text."""
    return Response(data, status, media_type="application/json")
