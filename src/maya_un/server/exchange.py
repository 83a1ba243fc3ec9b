"""What every route takes and gives: a JSON object, an answer as JSON."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Depends, Request, Response

from maya_un.api.messages import to_json
from maya_un.server.codec import decode_object


async def _json_body(request: Request) -> dict[str, Any]:
    return decode_object(await request.body())


Body = Annotated[dict[str, Any], Depends(_json_body)]
"""The JSON object a request carries."""


def answer(value: object, status: int = 200) -> Response:
    """Return a message as an answer."""
    return Response(to_json(value), status, media_type="application/json")
