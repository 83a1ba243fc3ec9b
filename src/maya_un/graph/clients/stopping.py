"""What goes by several wishes over a graph is stopped between two of them as well.

In one process the next wish begins in the same breath in which the one before ends. Across a graph there is a moment
between, in which nothing is under way that a stop could end. So a stop is told as an event, also where nothing moved,
and whoever is in the middle of something gives it up.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

from maya_un.errors import Stopped
from maya_un.events import Event, EventLog, Kind
from maya_un.graph.clients.asking import whole


async def stoppable(events: EventLog, work: Coroutine[Any, Any, None]) -> None:
    """Do `work`; raises `Stopped` where somebody says stop meanwhile, and what `work` raises.

    Either way, and where it is cancelled, it has ended when this does.
    """
    task = asyncio.ensure_future(work)
    said = False

    def hear(event: Event) -> None:
        nonlocal said
        if event.kind is Kind.STOPPED and not said:
            said = True
            if not task.cancelling():
                task.cancel()

    with events.listening(hear):
        try:
            await whole(task)
        except asyncio.CancelledError:
            this = asyncio.current_task()
            if not said or (this is not None and this.cancelling()):
                raise
            raise Stopped from None
