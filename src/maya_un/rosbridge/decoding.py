"""A client's text as an object."""

from __future__ import annotations

import json
from typing import Any

from maya_un.errors import InvalidRequest
from maya_un.process.decoding import require_few


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object that a client sent; raises `InvalidRequest` for whatever is none.

    Half a character is refused here: nobody behind this could send it on. So are bytes that are no text: what a client
    says is JSON, though it may be told CBOR. NaN and Infinity, which Python and some JavaScript write, are understood.
    """
    try:
        value = parsed(text)
    except ValueError as error:
        raise not_json(error) from error
    return as_object(value)


def parsed(text: str | bytes) -> Any:
    """Parse JSON; raises `ValueError`, and `InvalidRequest` if it nests too deeply."""
    require_few(text, "message")
    try:
        value = json.loads(text)
        if "\\u" in (text if isinstance(text, str) else text.decode()):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError as error:
        raise InvalidRequest(key="message", reason="it is nested too deeply") from error
    return value


def not_json(error: ValueError) -> InvalidRequest:
    """Return the error for a text that is not JSON."""
    return InvalidRequest(key="message", reason=f"it is not JSON ({error})")


def as_object(value: Any) -> dict[str, Any]:
    """Return a value that is an object; raises `InvalidRequest` for another."""
    if not isinstance(value, dict):
        raise InvalidRequest(key="message", reason="it is not a JSON object")
    return value
