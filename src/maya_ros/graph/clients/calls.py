"""Calls over a graph: errors with code and words of the server, and a stop between two calls.

In one process the next wish begins in the same breath in which the one before ends. Across a graph there is a moment
between, in which nothing is under way that a stop could end. So a stop is told as an event, also where nothing moved,
and whoever is in the middle of something gives it up.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

from maya_ros.graph.outcome import error_of
from maya_ros.graph.protocol import Feedback, GoalStatus, Graph, Message
from maya_ros.graph.table import Row
from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.errors import MayaError, NodeGone, ServiceFailed, Stopped, UnknownInterface
from maya_un.events import Event, EventLog, MotionStopped


async def done(graph: Graph, row: Row, goal: Message, feedback: Feedback | None = None) -> Message:
    """Have the goal of an action carried out and return its result.

    Raises the error that its server tells of, and `NodeGone` where there is none, or none any more. Being cancelled
    cancels the goal, and ends when the server says that it has ended.
    """
    gone = NodeGone(node=row.sources[0])
    try:
        ended = await run_to_rest(graph.do(row.name, row.type, goal, feedback))
    except NodeGone:  # it knows the action only, not whose it is
        raise gone from None
    if not ended.result:
        raise gone
    error = error_of(ended.result, row.name)
    if error is not None:
        raise error
    if ended.outcome is not GoalStatus.SUCCEEDED:
        raise ServiceFailed(service=row.name, reason=f"it ended as {ended.outcome.name.lower()}")
    return ended.result


async def called(graph: Graph, row: Row, request: Message) -> Message:
    """Return the response of a service; raises the error that it tells of, and `NodeGone` where nobody answers.

    Being cancelled cancels what is being answered, and ends when that is over.
    """
    try:
        response = await run_to_rest(graph.call(row.name, request, row.type))
    except (ServiceFailed, UnknownInterface):
        raise NodeGone(node=row.sources[0]) from None
    error = error_of(response, row.name)
    if error is not None:
        raise error
    return response


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
