"""The endpoint of the node rosbridge, with clients that have less rights than the graph's user."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Sequence

import pytest
from starlette.datastructures import Headers

from dmc41x3.loops import run
from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.table import HOME, MOVE
from maya_ros.ros1.serving import edge_of, endpoint_of
from maya_ros.rosbridge.endpoint import Endpoint, Everybody
from maya_un.errors import InvalidValue, MayaError, NotSignedIn
from maya_un.http.origins import OriginPolicy
from maya_un.service.access.operations import ROS, Caller, Role
from tests.rosbridge_clients import DATE, ClientOutput
from tests.virtual_time import turn

PAGE = "http://localhost:5173"


class Users(Everybody):
    """Knows everybody as a user of one role, until the rights end."""

    def __init__(self, role: Role) -> None:
        self.role = role
        self.revoked = False
        self._listeners: list[Callable[[], None]] = []

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return somebody of the role."""
        del authorization, loopback, stopping, alone
        return Caller("ana", self.role, source, lease, token="t")

    async def current(self, asked: Sequence[Caller]) -> list[Caller | MayaError]:
        """Return the callers, or that their rights have ended."""
        return [NotSignedIn(reason="test") if self.revoked else caller for caller in asked]

    def heard_by(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a listener when the rights end."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def revoke(self) -> None:
        """End all rights."""
        self.revoked = True
        for listener in tuple(self._listeners):
            listener()


class Wire(ClientOutput):
    """The connection of a client, who leaves at its end if it `responds`."""

    def __init__(self, endpoint: Endpoint, *, responds: bool = True) -> None:
        super().__init__()
        self._endpoint = endpoint
        self._responds = responds

    def end(self, code: int, reason: str) -> None:
        """Leave."""
        super().end(code, reason)
        if self._responds:
            self.leave()

    def leave(self) -> None:
        """Close the connection."""
        self._endpoint.leave(self)  # pyright: ignore[reportArgumentType]

    def enter(self, *, local: bool) -> Callable[..., None]:
        """Enter, and return what says an operation."""
        headers = Headers({"authorization": "Bearer x"})
        session = self._endpoint.enter(self, headers, "127.0.0.1", local=local)  # pyright: ignore[reportArgumentType]
        return lambda op, **message: session.take(json.dumps({"op": op, **message}))


def test_student_cannot_drive_as_the_user_of_the_graph() -> None:
    async def main() -> None:
        bus, done = Bus(), list[Message]()

        async def home(goal: Message, feedback: Feedback) -> Message:
            done.append(goal)
            feedback({})
            return success()

        bus.node("hw").act(HOME.name, HOME.type, home)
        endpoint = endpoint_of(bus.node("rosbridge"), lambda: DATE, OriginPolicy(), Users(Role.STUDENT))
        wire = Wire(endpoint)
        wire.enter(local=True)("send_action_goal", action=HOME.name, id=1, args={})
        while not wire.said:
            await turn()
        assert wire.said[0]["values"].startswith("4102")
        assert done == []
        wire.end(1000, "")
        await asyncio.sleep(0)

    run(main())


@pytest.mark.parametrize(("local", "responds"), [(False, True), (True, True), (True, False)])
def test_nothing_remains_of_a_client_whose_rights_have_ended(local: bool, responds: bool) -> None:
    async def main() -> None:
        bus, users, stopped = Bus(), Users(Role.OPERATOR), asyncio.Event()
        begun = asyncio.Event()

        async def act(_: Message, feedback: Feedback) -> Message:
            feedback({})
            begun.set()
            try:
                return await asyncio.get_running_loop().create_future()
            finally:
                stopped.set()

        bus.node("hw").act(MOVE.name, MOVE.type, act)
        endpoint = endpoint_of(bus.node("rosbridge"), lambda: DATE, OriginPolicy(), users)
        wire = Wire(endpoint, responds=responds)
        say = wire.enter(local=local)
        say("subscribe", topic=f"{MOVE.name}/result", type=f"{MOVE.type}ActionResult")
        say("subscribe", topic="/news", type="std_msgs/String")
        say("advertise", topic=f"{MOVE.name}/goal", type=f"{MOVE.type}ActionGoal")
        say("publish", topic=f"{MOVE.name}/goal", msg={"goal": {"a": 1.0, "b": 1.0, "c": 1.0}})
        news = bus.node("hw").advertise("/news", "std_msgs/String")
        await begun.wait()
        assert news.readers == 1
        users.revoke()
        await asyncio.wait_for(stopped.wait(), 5.0)
        while news.readers:
            await turn()
        say("advertise", topic="/late", type="std_msgs/String")
        wire.leave()
        await turn()
        assert [code for code, _ in wire.ended] == [NotSignedIn.code]
        assert endpoint.clients == 0
        assert bus.topics.find("/late") is None

    run(main())


@pytest.mark.parametrize("pages", [PAGE, [PAGE]])
def test_origins_are_one_page_or_several(pages: object) -> None:
    assert edge_of(pages).origins == {PAGE}
    assert edge_of([]) == OriginPolicy()


@pytest.mark.parametrize("pages", [5, {PAGE: 1}, [PAGE, 5], None, True, "", "http://"])
def test_origins_of_another_form_are_refused(pages: object) -> None:
    with pytest.raises(InvalidValue, match="origin"):
        edge_of(pages)
