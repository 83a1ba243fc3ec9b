"""Requests as bytes, and answers as values: no connection, no waiting."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple, TypeVar, cast

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from maya_un.client.doors import ServiceAddress
from maya_un.client.request import Answer, Request
from maya_un.errors import MayaError, ServiceNotAnswering, by_code, from_notice

T = TypeVar("T")

VERSION_HEADER = "Maya"
"""Every answer of ours has it, so that somebody else at an old port is found out."""

_NOBODY = "somebody else answers in its place"


class EncodedRequest(NamedTuple):
    """A request as it goes over the wire."""

    url: str
    headers: dict[str, str]
    content: bytes


def identity(token: str) -> dict[str, str]:
    """Return the headers of somebody who shows this token, "" for none."""
    return {"Authorization": f"Bearer {token}"} if token else {}


def written(request: Request[Any], door: ServiceAddress, lease: str) -> EncodedRequest:
    """Return a request with this control lease, "" for none but that of the service."""
    headers = {"Accept": "application/json", **identity(door.token)}
    if lease or door.lease:
        headers["Maya-Lease"] = lease or door.lease
    if request.key:
        headers["Idempotency-Key"] = request.key
    content = b""
    if request.body is not None:
        headers["Content-Type"] = "application/json"
        content = to_json(request.body)
    return EncodedRequest(door.url + request.target, headers, content)


def read(request: Request[T], status: int, headers: Mapping[str, str], content: bytes) -> T:
    """Return what an answer says.

    Raises the service's own refusal as the error it is, and `ServiceNotAnswering` for the answer of somebody else.
    """
    if VERSION_HEADER not in headers:
        raise ServiceNotAnswering(reason=_NOBODY)
    if status >= 400:
        raise _refusal(content)
    if request.answer is type(None):
        return cast("T", None)
    if request.answer is bytes or request.answer is str:
        return cast("T", content if request.answer is bytes else content.decode())
    try:
        return adapter(request.answer).validate_json(content)
    except ValidationError as error:
        reason = f"its answer is not understood: {error.errors(include_url=False)[0]['msg']}"
        raise ServiceNotAnswering(reason=reason) from error


def stream_url(door: ServiceAddress, path: str) -> str:
    """Return the address of a websocket."""
    return "ws" + door.url.removeprefix("http") + path


def message(text: str | bytes) -> dict[str, Any]:
    """Return a message of the websocket; raises the error that it is, and `ServiceNotAnswering` for what is none."""
    try:
        found: dict[str, Any] = json.loads(text)
        if found["type"] != "error":
            return found
        error = from_notice(int(found["code"]), dict(found["details"]))
    except (KeyError, TypeError, ValueError) as problem:
        raise ServiceNotAnswering(reason=f"its message is not understood: {text[:200]!r}") from problem
    raise error


def _refusal(content: bytes) -> MayaError:
    try:
        problem: dict[str, Any] = json.loads(content)
        return from_notice(int(problem["code"]), dict(problem["details"]), str(problem.get("detail", "")))
    except (KeyError, TypeError, ValueError):
        return ServiceNotAnswering(reason=f"its answer is not understood: {content[:200].decode(errors='replace')}")


@cache
def adapter(kind: type[T] | Answer) -> TypeAdapter[T]:
    """Return what reads values of a kind from JSON."""
    return TypeAdapter(kind.load() if isinstance(kind, Answer) else kind)


def as_error(code: int, message: str) -> MayaError:
    """Return the error of a report, which has its code and its sentence but not its details.

    One that is not known here is `ServiceNotAnswering`, with the sentence as its reason.
    """
    leaf = by_code().get(code)
    if leaf is None:
        return ServiceNotAnswering(reason=message)
    error = leaf()
    error.args = (message,)
    return error
