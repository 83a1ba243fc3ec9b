"""Actions that a client carries out for others in the graph, by the operations of the newer protocol."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from typing import Any, NamedTuple

from maya_un.cancellation import wait_for_end
from maya_un.errors import Cancelled, InvalidRequest, ServiceFailed
from maya_un.graph import types
from maya_un.graph.protocol import Feedback, GraphHandle, Message
from maya_un.graph.stamps import stamp
from maya_un.rosbridge import forms
from maya_un.rosbridge.client import ROWS, RosbridgeClient, StatusLevel
from maya_un.rosbridge.fields import Fields
from maya_un.rosbridge.goals import CANCELED, SUCCEEDED
from maya_un.rosbridge.limits import SERVED, UNDER_WAY

_numbers = itertools.count(1)


class _Given(NamedTuple):
    """A goal that the client was given: where its feedback goes, and what waits for its result."""

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
        """Have the client carry a goal out; being cancelled, it is told so and waited for."""
        if len(self._given) >= UNDER_WAY:
            raise ServiceFailed(service=self._action, reason="too many goals wait for it already")
        name = f"action_goal:{self._said}:{next(_numbers)}"
        ended: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._given[name] = _Given(feedback, ended)
        args = forms.as_plain(f"{self._kind}Goal", goal)
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
            told = reason if isinstance(reason, str) and reason else "its server says so"
            ended.set_exception(ServiceFailed(service=self._action, reason=told[:500]))
        elif status == CANCELED:
            ended.set_exception(Cancelled())
        else:
            now = stamp(self._client.press.now())
            ended.set_result(types.conform(f"{self._kind}Result", fields.record("values"), stamp=now))

    def close(self, reason: str) -> None:
        """Carry out nothing any more; whoever waits is told why."""
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
        """Carry out `advertise_action`; what others carry out cannot be taken from them."""
        said, action = fields.name("action")
        kind = fields.kind()
        if len(self._actions) >= SERVED:
            raise InvalidRequest(key="action", reason=f"a client carries out at most {SERVED}")
        ours = self._actions.pop(action, None)
        if ours is not None:
            ours.close("it was advertised anew")
        elif action in ROWS or f"{action}/status" in await self._client.graph.directory.topics():
            raise InvalidRequest(key="action", reason=f"{action} is served already")
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
        one.close("whoever carried it out does so no more")
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
            raise InvalidRequest(key="action", reason=f"{said} is not carried out by this client")
        return one

    def close(self) -> None:
        """Carry out nothing any more."""
        for one in self._actions.values():
            one.close("whoever carried it out has gone")
        self._actions.clear()
