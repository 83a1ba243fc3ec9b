"""A client's text as an object."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from maya_un.errors import InvalidRequest


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object that a client sent; raises `InvalidRequest` for whatever is none.

    Half a character is refused here: nobody behind this could send it on. So are bytes that are no text: what a client
    says is JSON, though it may be told CBOR.
    """
    try:
        value = json.loads(text, parse_constant=_refused)
        if "\\u" in (text if isinstance(text, str) else text.decode()):
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError as error:
        raise InvalidRequest(key="message", reason="it is nested too deeply") from error
    except ValueError as error:
        raise InvalidRequest(key="message", reason=f"it is not JSON ({error})") from error
    if not isinstance(value, dict):
        raise InvalidRequest(key="message", reason="it is not a JSON object")
    return value


def _refused(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a number in JSON")
