"""Server-sent events, read with a bound on what one of them may hold."""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ServerSentEvent:
    """An event; `whole` is False if its data had more than the bound, and then `data` is not to be used."""

    name: str
    data: bytes
    whole: bool = True


async def events(chunks: AsyncIterator[bytes], most: int) -> AsyncGenerator[ServerSentEvent]:
    """Yield the events in a stream of bytes, each with at most `most` bytes of data."""
    name, data, whole = "", bytearray(), True
    async for line, complete in _lines(chunks, most + len(b"data: ")):
        if not line and complete:
            if name or data:
                yield ServerSentEvent(name, bytes(data), whole)
            name, data, whole = "", bytearray(), True
            continue
        field, _, value = line.partition(b":")
        value = value.removeprefix(b" ")
        if field == b"event":
            name = value.decode(errors="replace")
        elif field == b"data":
            whole = whole and complete and len(data) + len(value) <= most
            if whole:
                data += (b"\n" if data else b"") + value


async def _lines(chunks: AsyncIterator[bytes], most: int) -> AsyncGenerator[tuple[bytes, bool]]:
    """Yield each line up to `most` bytes, and whether that is all of it."""
    line, complete = bytearray(), True
    async for chunk in chunks:
        first, *others = chunk.split(b"\n")
        complete = _add(line, first, most) and complete
        for part in others:
            yield bytes(line).removesuffix(b"\r"), complete
            line.clear()
            complete = _add(line, part, most)


def _add(line: bytearray, part: bytes, most: int) -> bool:
    """Append what fits; return whether that is all."""
    room = most - len(line)
    line += part[:room]
    return len(part) <= room
