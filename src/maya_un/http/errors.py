"""Errors as answers: problem+json (RFC 9457) with a stable code, message and details, in the client's language."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from http import HTTPStatus

from pydantic_core import PydanticSerializationError, to_json
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match, Route

from dmc41x3.i18n import LANGUAGES, PHRASE, marked
from maya_un.errors import (
    EventsForgotten,
    InternalError,
    InvalidRequest,
    LastAdministrator,
    MachineError,
    MayaError,
    NotAllowed,
    NotFound,
    NotSignedIn,
    NotTaught,
    StorageFailed,
    TooManyRequests,
    TooMuchAsked,
    WorkerFailed,
)

_DEFAULT = "en"


def language_of(headers: Mapping[str, str]) -> str:
    """Return the supported language that Accept-Language prefers, English by default."""
    best, most = _DEFAULT, 0.0
    for choice in headers.get("accept-language", "").split(","):
        name, _, rest = choice.partition(";")
        language = name.strip()[:2].lower()
        weight = _weight(rest)
        if language in LANGUAGES and weight > most:
            best, most = language, weight
    return best


def _weight(rest: str) -> float:
    key, _, value = rest.strip().partition("=")
    try:
        return float(value) if key.strip() == "q" else 1.0
    except ValueError:
        return 0.0


_CONFLICTS = {
    *(1010, 2103, 2104, 2105, 2106, 2108, 2111, 2112, 2201, 2202, 3001, 3002),
    *(4011, 4012, 4014, 4015, 4022, 4103, 4104, 4105),
}
"""Codes of refusals because of the current state, not because of the content of the request."""

_STATUSES = {
    NotFound: HTTPStatus.NOT_FOUND,
    NotTaught: HTTPStatus.NOT_FOUND,
    EventsForgotten: HTTPStatus.GONE,
    NotSignedIn: HTTPStatus.UNAUTHORIZED,
    NotAllowed: HTTPStatus.FORBIDDEN,
    LastAdministrator: HTTPStatus.FORBIDDEN,
    TooManyRequests: HTTPStatus.TOO_MANY_REQUESTS,
    TooMuchAsked: HTTPStatus.TOO_MANY_REQUESTS,
    StorageFailed: HTTPStatus.SERVICE_UNAVAILABLE,
    WorkerFailed: HTTPStatus.SERVICE_UNAVAILABLE,
    InvalidRequest: HTTPStatus.BAD_REQUEST,
    InternalError: HTTPStatus.INTERNAL_SERVER_ERROR,
}


_STARLETTE = (marked("Not Found", PHRASE), marked("Method Not Allowed", PHRASE))
"""Reasons of Starlette: they are translated as phrases of ours."""

AGAIN = 1
"""`Retry-After` of a refusal by the worker processes [s]: a computation may end at any time."""


def status_of(kind: type[MayaError]) -> int:
    """Return the HTTP status of errors of this kind."""
    if kind in _STATUSES:
        return _STATUSES[kind]
    if issubclass(kind, MachineError):
        return HTTPStatus.SERVICE_UNAVAILABLE
    return HTTPStatus.CONFLICT if kind.code in _CONFLICTS else HTTPStatus.UNPROCESSABLE_ENTITY


def problem(error: MayaError, language: str = "en", status: int | None = None) -> Response:
    """Return `error` as an answer; `status` replaces the error's HTTP status if given."""
    chosen = status_of(type(error)) if status is None else status
    body = {
        "type": f"urn:maya:error:{error.code}",
        "title": title_of(type(error)),
        "status": chosen,
        "code": error.code,
        "detail": error.text(language),
        "details": error.details,
    }
    headers = {"Content-Language": language, "Vary": "Accept-Language"}
    if isinstance(error, NotSignedIn):
        headers["WWW-Authenticate"] = 'Bearer realm="Maya"'
    if (wait := _wait(error)) is not None:
        headers["Retry-After"] = str(wait)
    return Response(_encoded(body), chosen, headers, "application/problem+json")


def _wait(error: MayaError) -> object | None:
    """Return the time after which a client may try again [s], None if waiting does not help."""
    if isinstance(error, TooManyRequests):
        return error.details["wait"]
    return AGAIN if isinstance(error, TooMuchAsked | WorkerFailed) else None


def _encoded(body: Mapping[str, object]) -> bytes:
    try:
        return to_json(body, fallback=str, inf_nan_mode="strings")
    except PydanticSerializationError:  # a lone surrogate in a name; JSON can escape it, UTF-8 cannot encode it
        return json.dumps(body, default=str).encode("ascii")


def title_of(kind: type[MayaError]) -> str:
    """Return the name of an error in words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", kind.__name__).capitalize()


async def on_maya_error(request: Request, error: Exception) -> Response:
    """Answer an error of Maya."""
    assert isinstance(error, MayaError)
    request.state.code = error.code
    return problem(error, language_of(request.headers))


async def on_http_error(request: Request, error: Exception) -> Response:
    """Answer an unknown path or method, or the request for the allowed methods of a path (OPTIONS)."""
    assert isinstance(error, HTTPException)
    methods = _methods(request)
    if methods and request.method == "OPTIONS":
        return Response(status_code=HTTPStatus.NO_CONTENT, headers={"Allow": methods})
    refusal = InvalidRequest(key=f"{request.method} {request.url.path}", reason=error.detail)
    answer = problem(refusal, language_of(request.headers), error.status_code)
    answer.headers.update(error.headers or {})
    if methods:
        answer.headers["Allow"] = methods
    return answer


def _methods(request: Request) -> str:
    """Return the allowed methods of the path of a request, "" for an unknown path."""
    found: set[str] = set()
    for route in request.app.routes:
        if isinstance(route, Route) and route.matches(request.scope)[0] is not Match.NONE:
            found |= route.methods or set()
    if "GET" in found:
        found.add("HEAD")
    return ", ".join(sorted(found | {"OPTIONS"})) if found else ""
