"""Bodies of requests as values; answers are written by `maya_un.api.messages`."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from maya_un.errors import InvalidRequest


def decode_object(body: bytes) -> dict[str, Any]:
    """Return the JSON object of a request's body.

    Raises `InvalidRequest` for anything else, NaN and infinities (which are not JSON), a key that stands twice and
    half a character included.
    """
    try:
        value = json.loads(body, parse_constant=_refuse_constant, object_pairs_hook=_once)
        if b"\\u" in body:
            json.dumps(value, ensure_ascii=False).encode()  # a lone surrogate is an error here, and nowhere later
    except RecursionError as error:
        raise InvalidRequest(key="body", reason="it is nested too deeply") from error
    except ValueError as error:
        raise InvalidRequest(key="body", reason=f"it is not JSON ({error})") from error
    if not isinstance(value, dict):
        raise InvalidRequest(key="body", reason="it is not a JSON object")
    return value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    once: dict[str, Any] = {}
    for key, value in pairs:
        if key in once:
            raise ValueError(f"the key {key!r} stands twice")
        once[key] = value
    return once


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number in JSON")
