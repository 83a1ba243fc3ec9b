"""Readers of the stream that request all past events again and again, in a process of their own.

`python -m tests.stream_readers PORT COUNT` prints "here" when all readers have asked and the first past event has come,
and runs until it is killed. A reader that is cut off as too slow connects again.
"""

from __future__ import annotations

import asyncio
import json
import struct
import sys
from contextlib import suppress


def frame(message: object) -> bytes:
    """Return a message as a client sends it: masked, here with zeros (RFC 6455, 5.3)."""
    text = json.dumps(message).encode()
    short = len(text) < 126
    head = struct.pack("!BB4x", 0x81, 0x80 | len(text)) if short else struct.pack("!BBH4x", 0x81, 0xFE, len(text))
    return head + text


FRAME = frame({"type": "subscribe", "events": {"since": 0}})

UPGRADE = (
    b"GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


async def read_for_ever(port: int, asked: asyncio.Event, fed: asyncio.Event) -> None:
    """Reconnect for ever."""
    while True:
        with suppress(ConnectionError, asyncio.IncompleteReadError):
            await visit(port, asked, fed)


async def visit(port: int, asked: asyncio.Event, fed: asyncio.Event) -> None:
    """Ask for everything, and again with every piece of it that comes, until cut off."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        writer.write(UPGRADE)
        await reader.readuntil(b"\r\n\r\n")
        writer.write(FRAME)
        asked.set()
        while piece := await reader.read(1 << 20):
            if b'"event"' in piece:
                fed.set()
            writer.write(FRAME)
            await writer.drain()
    finally:
        writer.close()


async def main(port: int, count: int) -> None:
    """Run `count` readers; end all of them if one fails."""
    async with asyncio.TaskGroup() as readers:
        asked, fed = [asyncio.Event() for _ in range(count)], asyncio.Event()
        for one in asked:
            readers.create_task(read_for_ever(port, one, fed))
        for one in (*asked, fed):
            await one.wait()
        print("here", flush=True)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), int(sys.argv[2])))
