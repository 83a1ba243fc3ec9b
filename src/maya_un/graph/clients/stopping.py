"""What goes by several wishes over a graph is stopped between two of them as well.

In one process the next wish begins in the same breath in which the one before ends. Across a graph there is a moment
between, in which nothing is under way that a stop could end. So a stop is told as an event, also where nothing moved,
and whoever is in the middle of something gives it up.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.errors import MayaError, Stopped
from maya_un.events import Event, EventLog, MotionStopped

T = TypeVar("T")


async def stoppable(events: EventLog, work: Coroutine[Any, Any, T]) -> T:
    """Return what `work` does; raises `Stopped` where somebody says stop meanwhile, and what `work` raises.

    Either way, and where it is cancelled, it has ended when this does.
    """
    return await given_up(events, lambda event: Stopped() if isinstance(event, MotionStopped) else None, work)


async def given_up(events: EventLog, why: Callable[[Event], MayaError | None], work: Coroutine[Any, Any, T]) -> T:
    """Return what `work` does; cancel it at the first event that is a reason `why`, and raise that, as `stoppable`."""
    task = asyncio.ensure_future(work)
    reason: MayaError | None = None

    def hear(event: Event) -> None:
        nonlocal reason
        if reason is None and (found := why(event)) is not None:
            reason = found
            cancel_once(task)

    with events.listening(hear):
        try:
            return await run_to_rest(task)
        except asyncio.CancelledError:
            if reason is None or is_caller_cancelled():
                raise
            raise reason from None
