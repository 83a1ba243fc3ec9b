"""Past events for a reader that missed many: sent a piece at a time, until what all readers share goes on.

A piece is a turn of the share that all readers of the past have, so however many ask for it, and however often, the
loop is there for the others.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from maya_un.errors import EventsForgotten
from maya_un.schema.robot import EventMessage
from maya_un.server.share import LoopShare
from maya_un.server.stream_hub import StreamHub
from maya_un.server.stream_messages import event_frame
from maya_un.server.stream_reader import CHUNK, StreamReader

PAGE = 250
"""So many past events are looked up at once."""

NEAR = 250
"""A client that is at most this many events behind gets them at once, and then the new ones."""

LookUp = Callable[[int, int], Awaitable[list[EventMessage]]]
"""Answers events of this run numbered above the first number, at most as many as the second, oldest first."""


async def catch_up(
    reader: StreamReader, hub: StreamHub, look_up: LookUp, room: Callable[[], Awaitable[object]], share: LoopShare
) -> None:
    """Send a reader the events that it lacks, out of the hub's ring or looked up, and let the hub go on from there.

    `room` is awaited before every piece. Raises `EventsForgotten` where one is missing, and what `look_up` raises.
    """
    ring = hub.ring
    reader.catching = True
    while reader.seen is not None and not (ring.reaches(reader.seen) and ring.last - reader.seen <= NEAR):
        await room()
        async with share.turn():
            if ring.reaches(reader.seen):
                upto, frames = ring.after(reader.seen, CHUNK)
            else:
                page = await look_up(reader.seen, PAGE)
                if not page or page[0].seq != reader.seen + 1:
                    raise EventsForgotten(since=reader.seen, oldest=page[0].seq if page else ring.first)
                upto, frames = page[-1].seq, b"".join(event_frame(hub.run, event) for event in page)
            reader.send_past(upto, frames)
    reader.catching = False
    hub.send_events(reader)
