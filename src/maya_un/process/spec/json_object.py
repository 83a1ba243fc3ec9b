"""Parse JSON objects from clients."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from dmc41x3.i18n import phrase
from maya_un.errors import InvalidRequest

MOST_VALUES = 100_000
"""Most values, keys and brackets of an object; the longest job has about a third of them."""


def decode_object(body: bytes) -> dict[str, Any]:
    """Return the JSON object of a request's body.

    Raises `InvalidRequest` for anything else, including NaN and infinities (which are not JSON), a repeated key, a lone
    surrogate and more than `MOST_VALUES` values.
    """
    require_few(body)
    try:
        value = json.loads(
            body.decode("utf-8-sig"), parse_constant=_refuse_constant, object_pairs_hook=_unique_json_keys
        )
        if b"\\u" in body:
            json.dumps(value, ensure_ascii=False).encode()  # detect a lone surrogate here, and not later
    except RecursionError as error:
        raise InvalidRequest(key="body", reason="it is nested too deeply") from error
    except ValueError as error:
        raise InvalidRequest(key="body", reason=phrase("it is not JSON ({error})", error=error)) from error
    if not isinstance(value, dict):
        raise InvalidRequest(key="body", reason="it is not a JSON object")
    return value


def require_few(text: str | bytes, key: str = "body") -> None:
    """Raise `InvalidRequest` if JSON has more than `MOST_VALUES`; count punctuation instead of parsing."""
    marks = map(text.count, ",:[{") if isinstance(text, str) else map(text.count, b",:[{")
    if sum(marks) > MOST_VALUES:
        raise InvalidRequest(key=key, reason=phrase("it has more than {most} values", most=MOST_VALUES))


def _unique_json_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    once: dict[str, Any] = {}
    for key, value in pairs:
        if key in once:
            raise ValueError(phrase("the key {key!r} appears twice", key=key))
        once[key] = value
    return once


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(phrase("{name} is not a number in JSON", name=name))
