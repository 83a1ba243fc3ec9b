"""The robot's side of the link: no rosbridge and no address may harm it."""

from __future__ import annotations

import asyncio
import json

import pytest
from websockets.asyncio.server import ServerConnection, serve

from maya_ros.graph.table import STEP_COMMAND, STEP_RESULT, STEP_STATUS
from maya_un.coms.agent import Agent
from maya_un.coms.robot import Rosbridge
from maya_un.coms.transport import Report, ReportKind
from maya_un.errors import RobotNotReached
from maya_un.http import dates
from maya_un.http.sockets import bound_socket
from tests.unit.coms.memory import Memory


@pytest.mark.parametrize("url", ["ws://a..b:9090", "ws://localhost:99999", "ws://[::1", "localhost:9090", "http://x"])
async def test_invalid_address_is_named(url: str) -> None:
    with pytest.raises(RobotNotReached):
        async with Rosbridge(url).connected():
            pass


async def test_credentials_in_the_address_are_shown_nowhere() -> None:
    with bound_socket(0) as listener:
        port = listener.getsockname()[1]
    robot = Rosbridge(f"ws://anna:geheim@127.0.0.1:{port}/?token=secreto")
    shown = json.dumps(Agent("MAYA", robot, Memory(), dates.now).status())
    with pytest.raises(RobotNotReached) as caught:
        async with robot.connected():
            pass
    for text in (shown, str(caught.value), repr(caught.value.details)):
        assert "127.0.0.1" in text
        assert "geheim" not in text
        assert "secreto" not in text


async def test_invalid_report_is_skipped() -> None:
    nested = "[" * 100_000
    accepted = json.dumps({"id": "1", "state": "accepted", "command": "home"})
    said = [(STEP_RESULT.name, nested), (STEP_STATUS.name, nested), (STEP_COMMAND.name, accepted)]
    said += [(STEP_STATUS.name, "[]"), (STEP_RESULT.name, '{"id": 7}'), (STEP_STATUS.name, '{"id": "1", "state": []}')]
    result = json.dumps({"id": "1", "success": True})

    async def foreign(socket: ServerConnection) -> None:
        for topic, text in [*said, (STEP_RESULT.name, result)]:
            await socket.send(json.dumps({"op": "publish", "topic": topic, "msg": {"data": text}}))
        await socket.wait_closed()

    async with serve(foreign, "127.0.0.1", 0) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        async with asyncio.timeout(30.0), Rosbridge(f"ws://127.0.0.1:{port}").connected() as link:
            assert await link.receive() == Report("1", ReportKind.RESULT, result)
