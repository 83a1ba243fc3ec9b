"""The HTTP server of `maya coms`: which pages of a browser may use it."""

from __future__ import annotations

import asyncio
from typing import Any, NoReturn

import httpx
import pytest

from maya_un.coms.agent import Agent
from maya_un.coms.robot import Rosbridge
from maya_un.coms.server import AgentSwitch, application
from maya_un.errors import InternalError, InvalidRequest, InvalidValue
from tests.unit.coms.memory import Memory
from tests.virtual_time import turn
from tests.waiting import until

AT = "http://127.0.0.1:3000"


def unmakable() -> NoReturn:
    raise InvalidValue(key="MAYA_COMS_URL", value="", reason="it is missing")


async def asked(method: str, path: str, **headers: str) -> httpx.Response:
    transport = httpx.ASGITransport(application(AgentSwitch(unmakable, "MAYA")))
    async with httpx.AsyncClient(transport=transport, base_url=AT) as client:
        return await client.request(method, path, headers=headers)


class Defective(Agent):
    """An agent with a defect."""

    async def run(self) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(self._fail())

    async def _fail(self) -> None:
        raise UnicodeEncodeError("ascii", "secret-token", 0, 1, "it is a defect")


async def test_agent_that_ended_is_reported_and_connects_again() -> None:
    logged = list[dict[str, Any]]()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: logged.append(context))
    made = [Defective("MAYA", Rosbridge("ws://lab:1"), Memory(), lambda: "") for _ in range(2)]
    switch = AgentSwitch(lambda: made[0], "MAYA", password_in_clear=True)
    switch.connect()
    assert switch.status()["state"] == "connecting"
    await until(lambda: bool(logged))
    status = switch.status()
    assert (status["state"], status["password_in_clear"]) == ("failed", True)
    assert (status["supervisors"]["connected"], status["supervisors"]["code"]) == (False, InternalError.code)
    assert "UnicodeEncodeError" in status["supervisors"]["waits_for"]
    assert "secret-" not in str(status)
    made.pop(0)
    switch.connect()
    assert switch.status()["state"] == "connecting"
    await until(lambda: len(logged) == 2)
    await switch.disconnect()
    assert switch.status()["state"] == "idle"


class Gated(Defective):
    """An agent with a defect that shows when its gate opens."""

    def __init__(self, gate: asyncio.Event) -> None:
        super().__init__("MAYA", Rosbridge("ws://lab:1"), Memory(), lambda: "")
        self._gate = gate

    async def run(self) -> None:
        await self._gate.wait()
        await self._fail()


async def test_failure_of_an_earlier_agent_is_not_that_of_its_successor() -> None:
    logged = list[dict[str, Any]]()
    asyncio.get_running_loop().set_exception_handler(lambda _, context: logged.append(context))
    gate = asyncio.Event()
    made = [Gated(gate), Gated(asyncio.Event())]
    switch = AgentSwitch(lambda: made.pop(0), "MAYA")
    switch.connect()
    await turn()
    gate.set()
    await asyncio.sleep(0)  # the agent has ended, and its end is not yet noted
    switch.connect()
    assert made == []
    await until(lambda: bool(logged))
    assert switch.status()["state"] == "connecting"
    await switch.disconnect()


@pytest.mark.parametrize("headers", [{}, {"Origin": AT}])
async def test_a_program_of_this_computer_reads_the_state(headers: dict[str, str]) -> None:
    answer = await asked("GET", "/status", **headers)
    assert (answer.status_code, answer.json()) == (200, {"state": "idle", "name": "MAYA"})


@pytest.mark.parametrize(
    "headers",
    [{"Origin": "http://127.0.0.1:8888"}, {"Origin": "https://elsewhere.example"}, {"Host": "elsewhere.example:3000"}],
)
@pytest.mark.parametrize("request_line", ["GET /status", "POST /connect", "POST /disconnect"])
async def test_a_page_of_another_address_is_refused(request_line: str, headers: dict[str, str]) -> None:
    method, path = request_line.split()
    answer = await asked(method, path, **headers)
    assert (answer.status_code, answer.json()["code"]) == (403, InvalidRequest.code)


async def test_connecting_without_an_address_says_why() -> None:
    answer = await asked("POST", "/connect")
    assert (answer.status_code, answer.json()["code"]) == (409, InvalidValue.code)
