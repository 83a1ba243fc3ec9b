"""How a route is declared: its operation, parameters, body, answer and errors."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, NamedTuple, TypeVar, get_type_hints

from fastapi import APIRouter, Request
from fastapi.params import Depends, Header, Query

from maya_un.errors import MayaError
from maya_un.http.exchange import BodyReader, RawBody
from maya_un.service.access.operations import Operation

Handler = TypeVar("Handler", bound=Callable[..., Any])


SOON = 10.0
"""Longest wait for an ordinary answer [s]."""

AT_REST = 120.0
"""Longest wait for an answer that is sent when the robot is at rest, or is computed from a long job [s]."""

LONGEST_MOTION = 3600.0
"""Longest wait for the answer to a motion [s]."""

HURRY = 2.0
"""Longest wait for the answer to a stop [s]."""


class RouteParameter(NamedTuple):
    """A parameter of a handler that comes from the query or, if it is a `header`, from a header of a request."""

    hint: Any
    default: Any
    header: bool = False


@dataclass(frozen=True, slots=True)
class RouteRule:
    """Metadata of a route: its operations, most powerful first; none for a route without authentication.

    `takes` parses the body, `gives` is the type of the answer, with `status` or one of `also`. `options` are the
    parameters of its query and its idempotency key by name; `refuses` lists errors that it answers besides those of
    every route. `client` is the method of the Python client, like "queue.pause", "" for none; `patience` is the longest
    time until the answer [s].
    """

    operations: tuple[Operation, ...]
    takes: BodyReader | RawBody | None
    gives: Any
    media: str
    status: int
    also: tuple[int, ...]
    refuses: tuple[type[MayaError], ...]
    examples: dict[str, Any]
    options: Mapping[str, RouteParameter]
    client: str = ""
    patience: float = SOON

    @property
    def query(self) -> list[str]:
        """The names allowed in the query of a request, sorted."""
        return sorted(name for name, option in self.options.items() if not option.header)


class Routes:
    """Routes in `router`, and the rule of each by its handler. They find the bridge in the state of the application."""

    def __init__(self) -> None:
        self.router = APIRouter()
        self.rules: dict[Callable[..., Any], RouteRule] = {}

    def add(  # noqa: PLR0913 - every fact of a route is a parameter
        self,
        method: str,
        path: str,
        *operations: Operation,
        tag: str,
        gives: Any,
        media: str = "application/json",
        status: int = HTTPStatus.OK,
        also: tuple[int, ...] = (),
        refuses: tuple[type[MayaError], ...] = (),
        examples: dict[str, Any] | None = None,
        client: str = "",
        patience: float = SOON,
    ) -> Callable[[Handler], Handler]:
        """Return the decorator that adds a handler; its name is the operation id of generated clients.

        `examples` are request bodies by description. The Python client is generated from the arguments
        (scripts/gen_client.py).
        """

        def added(handler: Handler) -> Handler:
            self.router.add_api_route(
                path,
                handler,
                methods=[method],
                tags=[tag],
                operation_id=handler.__name__,
                response_model=None,
                status_code=status,
                summary=(inspect.getdoc(handler) or "").split(".")[0].split(";")[0],
            )
            reader = _reader_of(handler)
            known = examples or {}
            found = _options_of(handler, path)
            self.rules[handler] = RouteRule(
                operations, reader, gives, media, status, also, refuses, known, found, client, patience
            )
            return handler

        return added


def _options_of(handler: Callable[..., Any], path: str = "") -> dict[str, RouteParameter]:
    """Return the options of a handler, including those of the functions it depends on."""
    found: dict[str, RouteParameter] = {}
    hints = get_type_hints(handler, include_extras=True)
    for name, parameter in inspect.signature(handler).parameters.items():
        marks = getattr(hints[name], "__metadata__", ())
        needed = [mark.dependency for mark in marks if isinstance(mark, Depends)]
        for one in needed:
            found |= _options_of(one) if inspect.isfunction(one) else {}
        if hints[name] is not Request and not needed and f"{{{name}" not in path:
            header = any(isinstance(mark, Header) for mark in marks)
            key = next((mark.alias for mark in marks if isinstance(mark, Query) and mark.alias), name)
            found[key] = RouteParameter(hints[name], parameter.default, header)
    return found


def _reader_of(handler: Callable[..., Any]) -> BodyReader | RawBody | None:
    for hint in get_type_hints(handler, include_extras=True).values():
        for mark in getattr(hint, "__metadata__", ()):
            if isinstance(mark, Depends) and isinstance(mark.dependency, BodyReader | RawBody):
                return mark.dependency
    return None


def rule_of(request: Request) -> RouteRule:
    """Return the rule of the route that serves a request."""
    rules: dict[Callable[..., Any], RouteRule] = request.app.state.rules
    return rules[request.scope["endpoint"]]
