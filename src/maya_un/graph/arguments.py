"""Arguments of services that come as a list: the values of the first fields, in the order of the definition."""

from __future__ import annotations

from collections.abc import Sequence

from maya_un.errors import InvalidMessage
from maya_un.graph.protocol import Message, Request


def by_name(kind: str, fields: Sequence[str], request: Request) -> Message:
    """Return a request of the type `kind` by the names of its `fields`; raises `InvalidMessage` for too many values.

    A list of one object that names fields of the request is that request: some clients wrap it so.
    """
    if not isinstance(request, list):
        return request
    if len(request) == 1 and isinstance(request[0], dict) and set(fields).issuperset(request[0]):
        return request[0]
    if len(request) > len(fields):
        raise InvalidMessage(name=kind, reason=f"it has {len(fields)} fields, not {len(request)}")
    return dict(zip(fields, request, strict=False))
