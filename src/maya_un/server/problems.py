"""Errors as answers: problem+json (RFC 9457) with our stable code, words and details."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic_core import PydanticSerializationError, to_json
from starlette.exceptions import HTTPException

from maya_un.errors import InternalError, InvalidRequest, MachineError, MayaError, NotFound, NotTaught

_CONFLICTS = {1010, 2103, 2104, 2105, 2106, 2108, 2111, 2112, 2201, 2202, 3001, 3002, 4011}
"""Refusals because of what the robot is doing just now, not because of what was asked."""


def status_of(error: MayaError) -> int:
    """Return the HTTP status of an error."""
    if isinstance(error, InternalError):
        return 500
    if isinstance(error, MachineError):
        return 503
    if isinstance(error, NotFound | NotTaught):
        return 404
    if error.code in _CONFLICTS:
        return 409
    return 400 if isinstance(error, InvalidRequest) else 422


def problem(error: MayaError, language: str = "en", status: int | None = None) -> Response:
    """Return `error` as an answer; `status` where HTTP has a better one than the error's own."""
    chosen = status_of(error) if status is None else status
    body = {
        "type": f"urn:maya:error:{error.code}",
        "title": _title(error),
        "status": chosen,
        "code": error.code,
        "detail": error.text(language),
        "details": error.details,
    }
    return Response(_encoded(body), chosen, media_type="application/problem+json")


def _encoded(body: Mapping[str, object]) -> bytes:
    try:
        return to_json(body, fallback=str, inf_nan_mode="strings")
    except PydanticSerializationError:  # half a character in a name; JSON can escape what UTF-8 cannot hold
        return json.dumps(body, default=str).encode("ascii")


def _title(error: MayaError) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(error).__name__).capitalize()


def language_of(request: Request) -> str:
    """Return the language a client asks for by Accept-Language."""
    return "es" if request.headers.get("accept-language", "").startswith("es") else "en"


async def on_maya_error(request: Request, error: Exception) -> Response:
    """Answer an error of the house."""
    assert isinstance(error, MayaError)
    return problem(error, language_of(request))


async def on_validation_error(request: Request, error: Exception) -> Response:
    """Answer a path or query value of the wrong kind."""
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    return problem(InvalidRequest(key=key, reason=first["msg"]), language_of(request))


async def on_http_error(request: Request, error: Exception) -> Response:
    """Answer an unknown path or method."""
    assert isinstance(error, HTTPException)
    refusal = InvalidRequest(key=f"{request.method} {request.url.path}", reason=error.detail)
    answer = problem(refusal, language_of(request), error.status_code)
    answer.headers.update(error.headers or {})
    return answer
