"""Results of commands over a graph: code and sentence of an error, and calls that raise the error again.

Results of actions and of /maya_command have the fields success, code and message. A std_srvs/Trigger has no code. When
it fails, its message is the code, a colon, a space and the sentence.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from typing import Any, NamedTuple, TypeVar

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.protocol import Act, Feedback, GoalRefused, GoalResult, GoalStatus, Graph, Message
from maya_ros.graph.table import Row
from maya_un.cancellation import cancel_once, is_caller_cancelled, run_to_rest
from maya_un.errors import (
    Cancelled,
    InternalError,
    MayaError,
    NodeGone,
    ServiceFailed,
    Stopped,
    UnknownInterface,
    from_sentence,
)
from maya_un.events import Event, EventLog, MotionStopped

ENDED = frozenset(
    {GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.RECALLED}
)
"""Final outcomes of a goal."""


class ActionOutcome(NamedTuple):
    """Outcome of an act, SUCCEEDED, ABORTED, PREEMPTED or REJECTED, and its result."""

    outcome: GoalStatus
    result: Message


def success() -> Message:
    """Return the result of a command that succeeded."""
    return {"success": True, "code": "", "message": ""}


def failure(error: MayaError) -> Message:
    """Return the result of a command that failed or was refused."""
    return {"success": False, "code": str(error.code), "message": str(error)}


def trigger_failure(error: MayaError) -> Message:
    """Return the response of a std_srvs/Trigger or SetBool that failed."""
    return {"success": False, "message": f"{error.code}: {error}"}


def error_of(result: Mapping[str, object], name: str = "") -> MayaError | None:
    """Return the error in a result or a response, None if it succeeded.

    An error with an unknown code, or without one, is a `ServiceFailed` of `name`.
    """
    if result.get("success"):
        return None
    code, sentence = str(result.get("code", "")), str(result.get("message", ""))
    if "code" not in result:
        code, _, rest = sentence.partition(": ")
        sentence = rest if code.isdecimal() else sentence
    try:
        return from_sentence(int(code), sentence)
    except (KeyError, ValueError):
        return ServiceFailed(service=name, reason=sentence or "it gave no reason")


async def run_goal(act: Act, goal: Message, feedback: Feedback) -> ActionOutcome:
    """Carry out a goal in this task and return its outcome; cancelling the task cancels the goal.

    A stopped goal counts as preempted, like a cancelled one; other errors abort it.
    """
    try:
        result = await act(goal, feedback)
    except GoalRefused as refused:
        return ActionOutcome(GoalStatus.REJECTED, refused.result)
    except asyncio.CancelledError:
        return ActionOutcome(GoalStatus.PREEMPTED, failure(Cancelled()))
    except (Stopped, Cancelled) as error:
        return ActionOutcome(GoalStatus.PREEMPTED, failure(error))
    except MayaError as error:
        return ActionOutcome(GoalStatus.ABORTED, failure(error))
    except Exception as defect:  # noqa: BLE001 - the client of the goal must learn that it ended
        asyncio.get_running_loop().call_exception_handler({"message": "a goal failed", "exception": defect})
        return ActionOutcome(GoalStatus.ABORTED, failure(InternalError(reason=repr(defect))))
    return ActionOutcome(GoalStatus.SUCCEEDED if result.get("success", True) else GoalStatus.ABORTED, result)


async def run_action(graph: Graph, row: Row, goal: Message, feedback: Feedback | None = None) -> Message:
    """Send the goal of an action to its server and return the result.

    Raises the error that the server reports, and `NodeGone` if the server is missing or vanishes. Cancelling this call
    cancels the goal, and ends when the server reports the goal's end.
    """
    gone = NodeGone(node=row.sources[0])
    try:
        ended = await run_to_rest(graph.do(row.name, row.type, goal, feedback))
    except NodeGone:  # it names the action, not the node
        raise gone from None
    if not ended.result:
        raise gone
    error = error_of(ended.result, row.name)
    if error is not None:
        raise error
    if ended.outcome is not GoalStatus.SUCCEEDED:
        raise ServiceFailed(
            service=row.name, reason=phrase("it ended as {outcome}", outcome=ended.outcome.name.lower())
        )
    return ended.result


async def goal_to_its_end(
    graph: Graph, action: str, kind: str, goal: Message, feedback: Feedback | None = None
) -> GoalResult:
    """Carry out a goal and return its outcome, also after a cancellation.

    A caller that cancels `Graph.do` learns that the goal has ended but not how, so the results are subscribed to as
    well.
    """
    last: GoalResult | None = None

    def heard(message: Message) -> None:
        nonlocal last
        outcome = GoalStatus(message["status"]["status"])
        if outcome is not GoalStatus.REJECTED:
            last = GoalResult(outcome, message["result"])

    results = graph.subscribe(f"{action}/result", f"{kind}ActionResult", heard)
    try:
        return await graph.do(action, kind, goal, feedback)
    except asyncio.CancelledError:
        return last or cancelled_goal(kind)
    finally:
        results.close()


def cancelled_goal(kind: str) -> GoalResult:
    """Return the outcome of a cancelled goal of an action of this type; raises `UnknownInterface`."""
    known = types.fields(f"{kind}Result")
    fitting = {name: value for name, value in failure(Cancelled()).items() if name in known}
    return GoalResult(GoalStatus.PREEMPTED, fitting)


async def call_service(graph: Graph, row: Row, request: Message) -> Message:
    """Return the response of a service; raises the error in the response, and `NodeGone` if no node answers.

    Cancelling this call cancels the request, and ends when the work of the request has ended.
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


async def cancel_on_stop(events: EventLog, work: Coroutine[Any, Any, T]) -> T:
    """Return the result of `work`; raises `Stopped` if a stop comes meanwhile, and what `work` raises.

    In every case, `work` has ended when this returns.
    """
    return await cancel_on_event(events, lambda event: Stopped() if isinstance(event, MotionStopped) else None, work)


async def cancel_on_event(
    events: EventLog, why: Callable[[Event], MayaError | None], work: Coroutine[Any, Any, T]
) -> T:
    """Return the result of `work`; at the first event for which `why` returns an error, cancel `work` and raise it.

    In every case, `work` has ended when this returns.
    """
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
