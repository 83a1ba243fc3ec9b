"""The HTTP server of `maya coms`: which pages of a browser may use it."""

from __future__ import annotations

from typing import NoReturn

import httpx
import pytest

from maya_un.coms.server import AgentSwitch, application
from maya_un.errors import InvalidRequest, InvalidValue

AT = "http://127.0.0.1:3000"


def unmakable() -> NoReturn:
    raise InvalidValue(key="MAYA_COMS_URL", value="", reason="it is missing")


async def asked(method: str, path: str, **headers: str) -> httpx.Response:
    transport = httpx.ASGITransport(application(AgentSwitch(unmakable, "MAYA")))
    async with httpx.AsyncClient(transport=transport, base_url=AT) as client:
        return await client.request(method, path, headers=headers)


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
