"""Actions: goals that a client sends, and actions that a client offers to others."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from dmc41x3.i18n import phrase
from maya_ros.graph import types
from maya_ros.graph.outcome import cancelled_goal, goal_to_its_end
from maya_ros.graph.protocol import Feedback, GoalResult, GoalStatus, GraphHandle, Message, stamp
from maya_ros.rosbridge import outgoing
from maya_ros.rosbridge.client import ROWS, Id, RosbridgeClient, StatusLevel
from maya_ros.rosbridge.incoming import Fields
from maya_ros.rosbridge.limits import LONGEST_MESSAGE, SERVED, SMALLEST_FRAGMENT, UNDER_WAY
from maya_ros.rosbridge.outgoing import COMPRESSIONS
from maya_un.cancellation import wait_for_end
from maya_un.errors import Cancelled, InvalidRequest, MayaError, ServiceFailed
from maya_un.http.log import written_down

UNKNOWN, SUCCEEDED, CANCELED, ABORTED = 0, 4, 5, 6
"""Outcomes of a goal, in the numbers of the newer protocol (action_msgs/GoalStatus)."""

_STATUS: Mapping[GoalStatus, int] = {
    GoalStatus.SUCCEEDED: SUCCEEDED,
    GoalStatus.PREEMPTED: CANCELED,
    GoalStatus.RECALLED: CANCELED,
    GoalStatus.ABORTED: ABORTED,
}


class _SentGoal:
    """One goal of a client: its fields, and whether its client has received the result (`over`)."""

    def __init__(self, client: RosbridgeClient, fields: Fields) -> None:
        """Read the action and id of a message; raises `InvalidRequest`."""
        self._client = client
        self.said = fields.text("action")
        self.name = fields.id
        self.action = self.kind = ""
        self.goal: Message = {}
        self.over = False
        self._feedback = False
        self._compression = "none"
        self._fragment = 0

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
        """Carry out the goal and return its outcome, also after a cancellation."""
        told = self.tell if self._feedback else None
        return await goal_to_its_end(self._client.graph, self.action, self.kind, self.goal, told)

    def tell(self, feedback: Message) -> None:
        """Send feedback."""
        values = outgoing.as_plain(f"{self.kind}Feedback", feedback)
        self._say({"op": "action_feedback", "action": self.said, "values": values})

    def tell_end(self, ended: GoalResult) -> None:
        """Send the outcome and result."""
        status = _STATUS.get(ended.outcome)
        if status is None:
            self.tell_failure(_why(ended))
        else:
            values = outgoing.as_plain(f"{self.kind}Result", ended.result)
            self.over = True
            self._say({"op": "action_result", "action": self.said, "values": values, "status": status, "result": True})

    def tell_failure(self, reason: str) -> None:
        """Send a failure without a result."""
        self.over = True
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
                raise InvalidRequest(
                    key="action", reason=phrase("at most {most} goals of a client may be under way", most=UNDER_WAY)
                )
        except MayaError as error:
            goal.tell_failure(self._client.words(error))
            return
        self._goals += 1
        task = self._client.spawn(self._carry_out(goal), f"goal {goal.action}")
        if goal.name is not None:
            self._tasks[goal.name] = (goal.action, task)
        task.add_done_callback(lambda _: self._see_to_its_end(goal))

    async def _carry_out(self, goal: _SentGoal) -> None:
        try:
            goal.tell_end(await goal.ended())
        except MayaError as error:
            goal.tell_failure(self._client.words(error))
        except Exception as defect:  # noqa: BLE001 - a client gets one sentence, the log the rest
            goal.tell_failure(self._client.words(written_down(defect)))

    def _see_to_its_end(self, goal: _SentGoal) -> None:
        """Forget a goal; report the end of one that was cancelled before its task had its first turn."""
        self._goals -= 1
        self._tasks.pop(goal.name, None)
        if not goal.over:
            try:
                goal.tell_end(cancelled_goal(goal.kind))
            except MayaError as error:
                goal.tell_failure(self._client.words(error))

    def cancel_action_goal(self, fields: Fields) -> None:
        """Carry out `cancel_action_goal`; the result of the goal reports its end."""
        _, action = fields.name("action")
        found = self._tasks.get(fields.id)
        if found is None or found[0] != action:
            raise InvalidRequest(key="id", reason="no goal of this name is under way")
        found[1].cancel()


def _why(ended: GoalResult) -> str:
    code, sentence = ended.result.get("code"), ended.result.get("message")
    if code and sentence:
        return f"{code}: {sentence}"
    return f"the goal was {ended.outcome.name.lower()}"


_numbers = itertools.count(1)


class _Given(NamedTuple):
    """A goal that the client carries out: the receiver of its feedback, and the future of its result."""

    feedback: Feedback
    ended: asyncio.Future[Message]


class _Action:
    """One action that a client carries out."""

    def __init__(self, client: RosbridgeClient, said: str, action: str, kind: str) -> None:
        self._client = client
        self._said = said
        self._action = action
        self._kind = kind
        self._given: dict[str, _Given] = {}
        self.held: GraphHandle | None = None

    async def act(self, goal: Message, feedback: Feedback) -> Message:
        """Have the client carry out a goal; if cancelled, send the client a cancel and wait for the end."""
        if len(self._given) >= UNDER_WAY:
            raise ServiceFailed(service=self._action, reason="too many goals wait for it already")
        name = f"action_goal:{self._said}:{next(_numbers)}"
        ended: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._given[name] = _Given(feedback, ended)
        args = outgoing.as_plain(f"{self._kind}Goal", goal)
        same = {"id": name, "action": self._said}
        self._client.say({"op": "send_action_goal", **same, "action_type": self._kind, "args": args, "feedback": True})
        try:
            await wait_for_end(ended, lambda: self._client.say({"op": "cancel_action_goal", **same}))
            return ended.result()
        finally:
            del self._given[name]

    def given(self, name: Any) -> _Given:
        """Return a goal that is under way; raises `InvalidRequest`."""
        found = self._given.get(name) if isinstance(name, str) else None
        if found is None or found.ended.done():
            raise InvalidRequest(key="id", reason="no goal of this name is under way")
        return found

    def end(self, ended: asyncio.Future[Message], fields: Fields) -> None:
        """Take the result of a goal."""
        status = fields.whole("status", SUCCEEDED, 0, 255)
        if not fields.flag("result", default=True) or status not in (SUCCEEDED, CANCELED):
            reason = fields.get("values")
            told = reason if isinstance(reason, str) and reason else phrase("its server gave no reason")
            ended.set_exception(ServiceFailed(service=self._action, reason=told[:500]))
        elif status == CANCELED:
            ended.set_exception(Cancelled())
        else:
            now = stamp(self._client.press.now())
            ended.set_result(types.conform(f"{self._kind}Result", fields.record("values"), stamp=now))

    def close(self, reason: str) -> None:
        """Stop serving; goals under way fail with `reason`."""
        if self.held is not None:
            self.held.close()
        for given in self._given.values():
            if not given.ended.done():
                given.ended.set_exception(ServiceFailed(service=self._action, reason=reason))


class ClientActions:
    """The actions that one client carries out."""

    def __init__(self, client: RosbridgeClient) -> None:
        self._client = client
        self._actions: dict[str, _Action] = {}
        self.ops: dict[str, Callable[[Fields], Any]] = {
            "advertise_action": self.advertise_action,
            "unadvertise_action": self.unadvertise_action,
            "action_feedback": self.action_feedback,
            "action_result": self.action_result,
        }

    async def advertise_action(self, fields: Fields) -> None:
        """Carry out `advertise_action`; an action that another server carries out is refused."""
        said, action = fields.name("action")
        kind = fields.kind()
        if len(self._actions) >= SERVED:
            raise InvalidRequest(key="action", reason=phrase("a client carries out at most {most}", most=SERVED))
        ours = self._actions.pop(action, None)
        if ours is not None:
            ours.close(phrase("it was advertised again"))
        elif action in ROWS or f"{action}/status" in await self._client.graph.directory.topics():
            raise InvalidRequest(key="action", reason=phrase("{name} is served already", name=action))
        one = _Action(self._client, said, action, kind)
        one.held = self._client.graph.act(action, kind, one.act)
        self._actions[action] = one
        self._client.tell(StatusLevel.info, f"advertised action {said}", fields.id)

    def unadvertise_action(self, fields: Fields) -> None:
        """Carry out `unadvertise_action`."""
        said, action = fields.name("action")
        one = self._actions.pop(action, None)
        if one is None:
            self._client.tell(StatusLevel.warning, f"{said} is not carried out by this client", fields.id)
            return
        one.close(phrase("its server unadvertised it"))
        self._client.tell(StatusLevel.info, f"unadvertised action {said}", fields.id)

    def action_feedback(self, fields: Fields) -> None:
        """Carry out `action_feedback`."""
        self._of(fields).given(fields.get("id")).feedback(fields.record("values"))

    def action_result(self, fields: Fields) -> None:
        """Carry out `action_result`."""
        one = self._of(fields)
        one.end(one.given(fields.get("id")).ended, fields)

    def _of(self, fields: Fields) -> _Action:
        said, action = fields.name("action")
        one = self._actions.get(action)
        if one is None:
            raise InvalidRequest(key="action", reason=phrase("{name} is not carried out by this client", name=said))
        return one

    def close(self) -> None:
        """Stop serving all actions."""
        for one in self._actions.values():
            one.close(phrase("its server disconnected"))
        self._actions.clear()
