"""A websocket client for benchmarks that costs next to nothing: what is measured is the server."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Mapping
from typing import cast

TEXT, PING, PONG = 0x81, 0x89, 0x8A
"""First bytes of frames."""

Seen = Callable[[bytes, float], None]
"""Told the text of every message, and when it came [s, monotonic]."""


class Client(asyncio.Protocol):
    """Says one `request` to /v1/stream and hands on what comes; understands frames of a server, answers its pings."""

    def __init__(self, request: Mapping[str, object], seen: Seen) -> None:
        self._request = json.dumps(request).encode()
        self._seen = seen
        self._transport: asyncio.Transport | None = None
        self._buffer = b""
        self.open = asyncio.Event()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Ask for the upgrade."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.write(
            b"GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )

    def data_received(self, data: bytes) -> None:
        """Take the frames out of what came."""
        now = time.monotonic()
        self._buffer += data
        if not self.open.is_set() and not self._opened():
            return
        while len(self._buffer) >= 4:
            short = self._buffer[1]
            begin, length = (2, short) if short < 126 else (4, int.from_bytes(self._buffer[2:4], "big"))
            if len(self._buffer) < begin + length:
                return
            payload = self._buffer[begin : begin + length]
            if self._buffer[0] == PING:
                self._say(PONG, payload)
            else:
                self._seen(payload, now)
            self._buffer = self._buffer[begin + length :]

    def close(self) -> None:
        """Hang up."""
        assert self._transport is not None
        self._transport.close()

    def _opened(self) -> bool:
        _, ended, rest = self._buffer.partition(b"\r\n\r\n")
        if not ended:
            return False
        self._buffer = rest
        self._say(TEXT, self._request)
        self.open.set()
        return True

    def _say(self, kind: int, payload: bytes) -> None:
        assert self._transport is not None
        assert len(payload) < 126
        self._transport.write(bytes((kind, 0x80 | len(payload))) + bytes(4) + payload)


def time_in(text: bytes) -> float:
    """Return the time that stands in a state or an event [s]."""
    begin = text.index(b'"time":') + 7
    return float(text[begin : text.index(b",", begin)])
