"""Frames of a websocket as a server sends them: final and not masked (RFC 6455, 5.2), so that clients share them."""

from __future__ import annotations

import struct

TEXT, BINARY = 0x81, 0x82


def framed(content: bytes, kind: int = TEXT) -> bytes:
    """Return `content` (of a text: UTF-8) as one frame."""
    length = len(content)
    if length < 126:
        return bytes((kind, length)) + content
    if length < 65_536:
        return struct.pack("!BBH", kind, 126, length) + content
    return struct.pack("!BBQ", kind, 127, length) + content
