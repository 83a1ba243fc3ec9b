"""Bodies of requests as values; answers are written by `maya_un.api.messages`."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from maya_un.errors import InvalidRequest


def decode_object(body: bytes) -> dict[str, Any]:
    """Return the JSON object of a request's body.

    Raises `InvalidRequest` for anything else, NaN and infinities (which are not JSON) included.
    """
    try:
        value = json.loads(body, parse_constant=_refuse_constant)
    except RecursionError as error:
        raise InvalidRequest(key="body", reason="it is nested too deeply") from error
    except ValueError as error:
        raise InvalidRequest(key="body", reason=f"it is not JSON ({error})") from error
    if not isinstance(value, dict):
        raise InvalidRequest(key="body", reason="it is not a JSON object")
    return value


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number in JSON")
