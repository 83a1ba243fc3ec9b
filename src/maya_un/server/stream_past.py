"""Past events for a reader that missed them: looked up a page at a time, until what all readers share goes on."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from maya_un.api.messages import EventMessage
from maya_un.errors import EventsForgotten
from maya_un.server.stream_hub import Hub
from maya_un.server.stream_messages import event_frame
from maya_un.server.stream_reader import CHUNK, Reader

PAGE = 500
"""So many past events are looked up at once."""

LookUp = Callable[[int, int], Awaitable[list[EventMessage]]]
"""Answers events of this run numbered above the first number, at most as many as the second, oldest first."""


async def catch_up(reader: Reader, hub: Hub, look_up: LookUp, room: Callable[[], Awaitable[object]]) -> None:
    """Send a reader the events that the hub's ring no longer has, and let the hub go on from there.

    `room` is awaited before every write. Raises `EventsForgotten` where one is missing, and what `look_up` raises.
    """
    reader.catching = True
    while reader.seen is not None and not hub.ring.reaches(reader.seen):
        page = await look_up(reader.seen, PAGE)
        if not page or page[0].seq != reader.seen + 1:
            raise EventsForgotten(since=reader.seen, oldest=page[0].seq if page else hub.ring.first)
        for frames in _chunks(hub.run, page):
            await room()
            reader.send_past(frames)
        reader.seen = page[-1].seq
    reader.catching = False
    hub.send_events(reader)


def _chunks(run: int, page: list[EventMessage]) -> list[bytes]:
    chunks, chunk = list[bytes](), b""
    for event in page:
        chunk += event_frame(run, event)
        if len(chunk) >= CHUNK:
            chunks.append(chunk)
            chunk = b""
    return [*chunks, chunk] if chunk else chunks
