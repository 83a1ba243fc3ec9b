"""How wishes end, as results on the graph: code and sentence instead of an error, and the error of them again.

Results of actions and of /maya_command have the fields success, code and message. A std_srvs/Trigger has no code: where
it failed, its message is the code, a colon, a space and the sentence.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import NamedTuple

from maya_ros.graph.protocol import Act, Feedback, GoalRefused, GoalStatus, Message
from maya_un.errors import Cancelled, InternalError, MayaError, ServiceFailed, Stopped, from_sentence

ENDED = frozenset(
    {GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.RECALLED}
)
"""Outcomes after which a goal changes no more."""


class ActionOutcome(NamedTuple):
    """How an act ended: SUCCEEDED, ABORTED, PREEMPTED or REJECTED, and with which result."""

    outcome: GoalStatus
    result: Message


def success() -> Message:
    """Return the result of what was done."""
    return {"success": True, "code": "", "message": ""}


def failure(error: MayaError) -> Message:
    """Return the result of what failed, or was refused."""
    return {"success": False, "code": str(error.code), "message": str(error)}


def trigger_failure(error: MayaError) -> Message:
    """Return the response of a std_srvs/Trigger or SetBool that failed."""
    return {"success": False, "message": f"{error.code}: {error}"}


def error_of(result: Mapping[str, object], name: str = "") -> MayaError | None:
    """Return the error that a result or a response tells of, None where it succeeded.

    One without a code that we know is a `ServiceFailed` of `name`.
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


async def carried(act: Act, goal: Message, feedback: Feedback) -> ActionOutcome:
    """Carry out a goal in this task, which may be cancelled to cancel the goal, and return how that ended.

    What somebody stopped counts as preempted, as what was cancelled; other errors abort it.
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
    except Exception as defect:  # noqa: BLE001 - whoever waits for the goal must hear that it ended
        asyncio.get_running_loop().call_exception_handler({"message": "a goal failed", "exception": defect})
        return ActionOutcome(GoalStatus.ABORTED, failure(InternalError(reason=repr(defect))))
    return ActionOutcome(GoalStatus.SUCCEEDED if result.get("success", True) else GoalStatus.ABORTED, result)
