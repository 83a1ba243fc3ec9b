"""Frames of a server, read back by another implementation of the standard."""

from __future__ import annotations

import json
from typing import Any

from websockets.client import ClientProtocol
from websockets.frames import Frame, Opcode
from websockets.protocol import State as Phase
from websockets.uri import parse_uri


def texts(frames: bytes) -> list[bytes]:
    """Return the texts of whole frames; fails for anything else."""
    client = ClientProtocol(parse_uri("ws://localhost/"), state=Phase.OPEN, max_size=None)
    client.receive_data(frames)
    found: list[bytes] = []
    for event in client.events_received():
        assert isinstance(event, Frame)
        assert event.opcode is Opcode.TEXT
        assert event.fin
        found.append(bytes(event.data))
    return found


def messages(frames: bytes) -> list[dict[str, Any]]:
    """Return the messages of whole frames."""
    return [json.loads(text) for text in texts(frames)]
