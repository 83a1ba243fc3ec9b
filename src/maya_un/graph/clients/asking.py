"""Wishes over a graph: what goes wrong there is raised here, with the code and words of the floor that said it."""

from __future__ import annotations

from maya_un.cancellation import run_to_rest
from maya_un.errors import NodeGone, ServiceFailed, UnknownInterface
from maya_un.graph.outcome import error_of
from maya_un.graph.protocol import Feedback, GoalStatus, Graph, Message
from maya_un.graph.table import Row


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
