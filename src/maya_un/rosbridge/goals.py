"""Goals that a client sends by the action operations of the newer protocol."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from maya_un.errors import Cancelled, InvalidRequest, MayaError
from maya_un.graph import types
from maya_un.graph.outcome import failure
from maya_un.graph.protocol import GoalResult, GoalStatus, Message
from maya_un.rosbridge import forms
from maya_un.rosbridge.client import ROWS, Id, RosbridgeClient
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.limits import LONGEST_MESSAGE, SMALLEST_FRAGMENT, UNDER_WAY
from maya_un.rosbridge.outgoing import COMPRESSIONS
from maya_un.server.crash import written_down

UNKNOWN, SUCCEEDED, CANCELED, ABORTED = 0, 4, 5, 6
"""How a goal ended, in the numbers of the newer protocol (action_msgs/GoalStatus)."""

_STATUS: Mapping[GoalStatus, int] = {
    GoalStatus.SUCCEEDED: SUCCEEDED,
    GoalStatus.PREEMPTED: CANCELED,
    GoalStatus.RECALLED: CANCELED,
    GoalStatus.ABORTED: ABORTED,
}


class _SentGoal:
    """One goal of a client: what it said, and the last result that was heard of its action."""

    def __init__(self, client: RosbridgeClient, fields: Fields) -> None:
        """Read the action and id of a message; raises `InvalidRequest`."""
        self._client = client
        self.said = fields.text("action")
        self.name = fields.id
        self.action = self.kind = ""
        self.goal: Message = {}
        self._feedback = False
        self._compression = "none"
        self._fragment = 0
        self._last: GoalResult | None = None

    def read(self, fields: Fields) -> None:
        """Read the other fields; raises `InvalidRequest`. Results are JSON or a picture of it, as for services."""
        _, self.action = fields.name("action")
        row = ROWS.get(self.action)
        self.kind = fields.kind("action_type", needed=row is None) or (row.type if row else "")
        self.goal = fields.record("args")
        self._feedback = fields.flag("feedback", default=False)
        self._compression = "png" if fields.one_of("compression", COMPRESSIONS, "none") == "png" else "none"
        self._fragment = fields.whole("fragment_size", 0, SMALLEST_FRAGMENT, LONGEST_MESSAGE)

    async def ended(self) -> GoalResult:
        """Have it carried out; one that is cancelled is told as it ended.

        Whoever cancels `do` learns that the goal has ended but not how, so its results are listened to beside it.
        """
        heard = self._client.graph.subscribe(f"{self.action}/result", f"{self.kind}ActionResult", self._heard)
        told = self.tell if self._feedback else None
        try:
            return await self._client.graph.do(self.action, self.kind, self.goal, told)
        except asyncio.CancelledError:
            return self._last or GoalResult(GoalStatus.PREEMPTED, _fitting(self.kind, failure(Cancelled())))
        finally:
            heard.close()

    def _heard(self, message: Message) -> None:
        outcome = GoalStatus(message["status"]["status"])
        if outcome is not GoalStatus.REJECTED:
            self._last = GoalResult(outcome, message["result"])

    def tell(self, feedback: Message) -> None:
        """Tell how far it is."""
        values = forms.as_plain(f"{self.kind}Feedback", feedback)
        self._say({"op": "action_feedback", "action": self.said, "values": values})

    def tell_end(self, ended: GoalResult) -> None:
        """Tell how it ended."""
        status = _STATUS.get(ended.outcome)
        if status is None:
            self.tell_failure(_why(ended))
        else:
            values = forms.as_plain(f"{self.kind}Result", ended.result)
            self._say({"op": "action_result", "action": self.said, "values": values, "status": status, "result": True})

    def tell_failure(self, reason: str) -> None:
        """Tell that it was not carried out at all."""
        self._say({"op": "action_result", "action": self.said, "values": reason, "status": UNKNOWN, "result": False})

    def _say(self, message: dict[str, Any]) -> None:
        named = {} if self.name is None else {"id": self.name}
        self._client.say({**message, **named}, self._compression, self._fragment, self.name)


class ClientGoals:
    """The goals of one client that are under way."""

    def __init__(self, client: RosbridgeClient) -> None:
        self._client = client
        self._tasks: dict[Id, tuple[str, asyncio.Task[None]]] = {}
        self._goals = 0
        self._closing = False
        self.ops = {"send_action_goal": self.send_action_goal, "cancel_action_goal": self.cancel_action_goal}

    def send_action_goal(self, fields: Fields) -> None:
        """Carry out `send_action_goal`; feedback and result follow later.

        A refused goal that names an action gets a result as well, because its client waits for that.
        """
        goal = _SentGoal(self._client, fields)
        if goal.name in self._tasks:
            raise InvalidRequest(key="id", reason="a goal of this name is under way")
        try:
            goal.read(fields)
            if self._goals >= UNDER_WAY:
                raise InvalidRequest(key="action", reason=f"at most {UNDER_WAY} goals of a client may be under way")
        except MayaError as error:
            goal.tell_failure(self._client.words(error))
            return
        self._goals += 1
        task = self._client.spawn(self._carry_out(goal), f"goal {goal.action}")
        if goal.name is not None:
            self._tasks[goal.name] = (goal.action, task)

    async def _carry_out(self, goal: _SentGoal) -> None:
        try:
            goal.tell_end(await goal.ended())
        except MayaError as error:
            goal.tell_failure(self._client.words(error))
        except Exception as defect:  # noqa: BLE001 - a client gets one sentence, the log the rest
            goal.tell_failure(self._client.words(written_down(defect)))
        finally:
            self._goals -= 1
            self._tasks.pop(goal.name, None)

    def cancel_action_goal(self, fields: Fields) -> None:
        """Carry out `cancel_action_goal`; that the goal has ended is told by its result."""
        _, action = fields.name("action")
        found = self._tasks.get(fields.id)
        if found is None or found[0] != action:
            raise InvalidRequest(key="id", reason="no goal of this name is under way")
        found[1].cancel()


def _fitting(kind: str, result: Message) -> Message:
    known = types.fields(f"{kind}Result")
    return types.conform(f"{kind}Result", {name: value for name, value in result.items() if name in known})


def _why(ended: GoalResult) -> str:
    code, sentence = ended.result.get("code"), ended.result.get("message")
    if code and sentence:
        return f"{code}: {sentence}"
    return f"the goal was {ended.outcome.name.lower()}"
