"""The faults of the twin over HTTP, of a whole robot on the twin."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import httpx
import pytest

from dmc41x3.twin.wire.faults import TABLE
from maya_un.assembly.stack import Stack, stack
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.values import State
from tests.calm import CALM
from tests.unit.http.test_teaching import http_client
from tests.virtual_time import elapse

PATH = "/v1/twin/faults"


@asynccontextmanager
async def twin_client() -> AsyncIterator[tuple[Stack, httpx.AsyncClient]]:
    async with stack(CALM) as running:
        bridge = Bridge(asyncio.get_running_loop(), running.service, gate=running.gate, callers=running.access.callers)
        transport = httpx.ASGITransport(create_app(bridge), raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
            yield running, client


async def seen(running: Stack, wanted: Callable[[State], bool]) -> None:
    """Wait for a state."""
    async for state in running.service.watch():
        if wanted(state):
            return


async def test_every_fault_of_the_table_is_listed_in_both_languages() -> None:
    async with twin_client() as (_, client):
        english = (await client.get(PATH)).json()
        spanish = (await client.get(PATH, headers={"Accept-Language": "es"})).json()
    assert english["active"] == []
    assert [kind["name"] for kind in english["kinds"]] == [fault.name for fault in TABLE]
    for one, other in zip(english["kinds"], spanish["kinds"], strict=True):
        assert one["words"] != other["words"]
        assert all(a["words"] != b["words"] for a, b in zip(one["parameters"], other["parameters"], strict=True))
    kinds = {kind["name"]: kind for kind in english["kinds"]}
    assert (kinds["reset"]["lasts"], kinds["abort_input"]["lasts"]) == (False, True)
    axis, side, active = kinds["stuck_limit"]["parameters"]
    assert (axis["default"], side["choices"], active["default"]) == ("A", ["forward", "reverse"], True)
    seconds = kinds["latency"]["parameters"][0]
    assert (seconds["unit"], seconds["minimum"], seconds["maximum"]) == ("s", 0.0, 60.0)


async def test_fault_acts_on_the_robot_until_it_is_removed() -> None:
    async with twin_client() as (running, client):
        begun = await client.put(f"{PATH}/stuck_limit", json={"values": {"axis": "B", "side": "reverse"}})
        assert begun.status_code == 200
        (fault,) = begun.json()["active"]
        values = {"axis": "B", "side": "reverse", "active": True}
        assert fault == {"fault": "stuck_limit", "values": values, "seconds": None}
        await seen(running, lambda state: state.reverse_limit[1])
        assert (await client.delete(f"{PATH}/stuck_limit")).json()["active"] == []
        await seen(running, lambda state: not state.reverse_limit[1])


async def test_fault_ends_after_its_time() -> None:
    async with twin_client() as (running, client):
        (fault,) = (await client.put(f"{PATH}/drop", json={"values": {"probability": 0}, "seconds": 5})).json()[
            "active"
        ]
        assert 0.0 < fault["seconds"] <= 5.0
        await elapse(5.1)
        assert (await client.get(PATH)).json()["active"] == []
        assert running.twin is not None and running.twin.controller.faults.active == []


async def test_all_faults_end_at_once() -> None:
    async with twin_client() as (_, client):
        await client.put(f"{PATH}/abort_input")
        await client.put(f"{PATH}/encoder_loss", json={"values": {"axis": "C"}})
        assert (await client.delete(PATH)).json()["active"] == []


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("earthquake", {}),
        ("latency", {"values": {"minutes": 1}}),
        ("latency", {"values": {"seconds": 61}}),
        ("latency", {"values": {"seconds": [1]}}),
        ("latency", {"seconds": 0}),
        ("latency", {"seconds": 1e9}),
        ("encoder_loss", {"values": {"axis": "H"}}),
        ("abort_input", {"for": 3}),
    ],
)
async def test_invalid_fault_is_refused(name: str, body: dict[str, Any]) -> None:
    async with twin_client() as (_, client):
        refused = await client.put(f"{PATH}/{name}", json=body)
        assert refused.status_code in {400, 422}
        assert refused.json()["code"] in {4001, 4003, 4005}, refused.text
        assert (await client.get(PATH)).json()["active"] == []


async def test_real_machine_has_no_such_faults() -> None:
    async with http_client() as (_, client):
        for answer in (
            await client.get(PATH),
            await client.put(f"{PATH}/abort_input"),
            await client.delete(f"{PATH}/abort_input"),
            await client.delete(PATH),
        ):
            assert (answer.status_code, answer.json()["code"]) == (404, 4004)
