"""The endpoint of the node rosbridge, with clients that have less rights than the graph's user."""

from __future__ import annotations

import asyncio
import json

from starlette.datastructures import Headers

from dmc41x3.loops import run
from maya_ros.graph.bus import Bus
from maya_ros.graph.outcome import success
from maya_ros.graph.protocol import Feedback, Message
from maya_ros.graph.table import HOME
from maya_ros.ros1.serving import endpoint_of
from maya_ros.rosbridge.endpoint import Everybody
from maya_un.http.origins import OriginPolicy
from maya_un.service.access.operations import ROS, Caller, Role
from tests.rosbridge_clients import DATE, ClientOutput
from tests.virtual_time import turn


class Students(Everybody):
    """Knows everybody as a student."""

    async def caller(
        self, authorization: str | None, lease: str, source: str, *, loopback: bool, stopping: bool, alone: Caller = ROS
    ) -> Caller:
        """Return a student."""
        del authorization, loopback, stopping, alone
        return Caller("ana", Role.STUDENT, source, lease, token="t")


def test_student_cannot_drive_as_the_user_of_the_graph() -> None:
    async def main() -> None:
        bus, done = Bus(), list[Message]()

        async def home(goal: Message, feedback: Feedback) -> Message:
            done.append(goal)
            feedback({})
            return success()

        bus.node("hw").act(HOME.name, HOME.type, home)
        endpoint = await endpoint_of(bus.node("rosbridge"), lambda: DATE, OriginPolicy(), Students())
        wire = ClientOutput()
        session = endpoint.enter(wire, Headers({"authorization": "Bearer x"}), "127.0.0.1", local=True)  # pyright: ignore[reportArgumentType]
        session.take(json.dumps({"op": "send_action_goal", "action": HOME.name, "id": 1, "args": {}}))
        while not wire.said:
            await turn()
        assert wire.said[0]["values"].startswith("4102")
        assert done == []
        endpoint.leave(wire)  # pyright: ignore[reportArgumentType]
        await asyncio.sleep(0)

    run(main())
