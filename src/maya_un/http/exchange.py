"""Input and output of every route: numbers in paths, bodies parsed as messages, answers as JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

from fastapi import Depends, Path, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import TypeAdapter, ValidationError

from maya_un.errors import InvalidRequest
from maya_un.http.bridge import Bridge
from maya_un.http.connections import source_of
from maya_un.http.errors import language_of, problem
from maya_un.http.middleware import LONG
from maya_un.process.spec.json_object import decode_object
from maya_un.schema.encoding import MOST, to_json
from maya_un.validation import reason_of, refusal_of

JobNumber = Annotated[int, Path(ge=1, le=MOST, description="number of a job")]
"""The number of a job."""


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
            raise refusal_of(error) from error


async def on_validation_error(request: Request, error: Exception) -> Response:
    """Answer an invalid value in the path or query."""
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    return problem(InvalidRequest(key=key, reason=reason_of(first)), language_of(request.headers))


def sent(*kinds: type, choose: Callable[[Mapping[str, Any]], type] | None = None, optional: bool = False) -> Any:
    """Return the dependency of a route on the message in its request's body."""
    return Depends(BodyReader(*kinds, choose=choose, optional=optional), use_cache=False)


class RawBody:
    """Base of bodies that are not parsed as a message; `schema` returns the JSON Schema of the body."""

    def __init__(self, schema: Callable[[], Mapping[str, Any]]) -> None:
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


def sent_long(schema: Callable[[], Mapping[str, Any]]) -> Any:
    """Return the dependency of a route on an object that may be long."""
    return Depends(LongBody(schema), use_cache=False)


def sent_as_written(schema: Callable[[], Mapping[str, Any]]) -> Any:
    """Return the dependency of a route on an object that the service parses further."""
    return Depends(ParsedBody(schema), use_cache=False)


def answer(value: object, status: int = 200) -> Response:
    """Return a message as an answer."""
    return as_json(to_json(value), status)


def as_json(data: bytes, status: int = 200) -> Response:
    """Return an answer from JSON text."""
    return Response(data, status, media_type="application/json")
