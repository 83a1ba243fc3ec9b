"""Find a stop among the messages of a client while all others wait."""

from __future__ import annotations

from maya_un.api.access.operations import Operation
from maya_un.errors import InvalidRequest
from maya_un.graph.table import ABORT, STOP, asked_by_topic
from maya_un.rosbridge.decoding import decoded
from maya_un.rosbridge.fields import Fields


def stop_in(text: str | bytes) -> str | None:
    """Return the service of the stop that a message requests, None for other messages."""
    try:
        fields = Fields(decoded(text))
        match fields.get("op"):
            case "call_service":
                _, service = fields.name("service")
                return service if service in (STOP.name, ABORT.name) else None
            case "publish":
                _, topic = fields.name("topic")
                return STOP.name if asked_by_topic(topic) is Operation.STOP else None
            case _:
                return None
    except InvalidRequest:
        return None
