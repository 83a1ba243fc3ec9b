"""The terminal over HTTP, of a robot on the twin."""

from __future__ import annotations

import asyncio

import httpx
import pytest

from maya_un.service import service
from maya_un.values import Mode
from tests.unit.http.test_teaching import http_client
from tests.unit.http.test_twin_faults import seen, twin_client

PATH = "/v1/terminal"


async def asked(client: httpx.AsyncClient, command: str) -> dict[str, object]:
    answer = await client.post(PATH, json={"command": command})
    assert answer.status_code == 200, answer.text
    found: dict[str, object] = answer.json()
    return found


async def test_controller_answers_commands_that_read() -> None:
    async with twin_client() as (running, client):
        reply = await asked(client, "TPABC")
        counts = [int(part) for part in str(reply["reply"]).split(",")]
        assert counts == list(running.service.state.counts)
        assert (reply["command"], reply["code"], reply["reason"]) == ("TPABC", 0, "")
        assert "IHB AVAILABLE" in str((await asked(client, "TH"))["reply"]).splitlines()
        assert float(str((await asked(client, "MG 7/2"))["reply"])) == 3.5


async def test_refusal_of_the_controller_is_answered_with_its_code() -> None:
    async with twin_client() as (_, client):
        reply = await asked(client, "MG no_such_name")
        assert (reply["reply"], reply["code"]) == ("", 9)
        assert reply["reason"]


@pytest.mark.parametrize(
    "command", ["BGA", "KPA=1", "ST", "TP;BGA", "TC1", 'MG "x"{N}', "SB 1", "XQ", "ZAB=0", "hello"]
)
async def test_command_that_may_change_something_is_not_sent(command: str) -> None:
    async with twin_client() as (running, client):
        sent = bytearray()
        running.controller.tap(lambda direction, data: sent.extend(data) if direction == "tx" else None)
        refused = await client.post(PATH, json={"command": command})
        assert (refused.status_code, refused.json()["code"]) == (422, 4056)
        assert command in refused.json()["detail"]
        assert command.encode() not in sent


@pytest.mark.parametrize(
    "body", [{}, {"command": ""}, {"command": "TP" * 41}, {"command": 3}, {"command": "TP", "x": 1}]
)
async def test_invalid_body_is_refused(body: dict[str, object]) -> None:
    async with twin_client() as (_, client):
        refused = await client.post(PATH, json=body)
        assert refused.status_code in {400, 422}
        assert refused.json()["code"] in {4001, 4005}


async def test_terminal_reads_while_a_motion_goes_on() -> None:
    async with twin_client() as (running, client):
        homing = asyncio.ensure_future(running.service.command({"command": "home"}))
        await seen(running, lambda state: state.mode is Mode.HOMING)
        replies = [await asked(client, "TV") for _ in range(20)]
        assert {reply["code"] for reply in replies} == {0}
        report = await homing
        assert report.code == 0


async def test_long_answer_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MOST_REPLY", 5)
    async with twin_client() as (_, client):
        assert len(str((await asked(client, "TH"))["reply"])) == 5


async def test_audit_log_has_the_command() -> None:
    async with twin_client() as (_, client):
        await asked(client, "KPA=?")
        await client.post(PATH, json={"command": "BGA"})
        refused, read = (await client.get("/v1/audit?limit=2")).json()
        assert (read["operation"], read["detail"], read["code"]) == ("terminal", "KPA=?", 0)
        assert (refused["operation"], refused["detail"], refused["code"]) == ("terminal", "BGA", 4056)


async def test_controller_of_another_process_has_no_terminal() -> None:
    async with http_client() as (_, client):
        refused = await client.post(PATH, json={"command": "TP"})
        assert (refused.status_code, refused.json()["code"]) == (422, 4021)
