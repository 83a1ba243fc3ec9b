"""The last seconds of the states over HTTP, of a robot on the twin."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.recorder.tables import MACHINE_COLUMNS
from tests.calm import SELDOM_BEATING
from tests.recorded import recording_store
from tests.unit.http.test_teaching import http_client
from tests.virtual_time import elapse


@asynccontextmanager
async def recording(folder: Path) -> AsyncIterator[tuple[Stack, httpx.AsyncClient]]:
    async with stack(SELDOM_BEATING, recordings=recording_store(folder)) as running:
        app = create_app(Bridge(asyncio.get_running_loop(), running.service))
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
            yield running, client


async def test_last_seconds_are_answered_as_columns(tmp_path: Path) -> None:
    async with recording(tmp_path) as (running, client):
        homing = asyncio.ensure_future(running.service.command({"command": "home"}))
        await elapse(8.0)
        found = (await client.get("/v1/scope?seconds=5&rate=100")).json()
        await running.service.stop()
        await homing
        await elapse(1.0)
        rest = (await client.get("/v1/scope?seconds=0.5&rate=100")).json()["columns"]
        counts = running.service.state.counts
    assert found["end"] - found["begin"] == pytest.approx(5.0)
    assert found["speed"] == 1.0
    columns = found["columns"]
    assert list(columns) == [column.key for column in MACHINE_COLUMNS]
    times = columns["time"]["values"]
    assert times == sorted(times)
    assert found["begin"] <= times[0] <= found["begin"] + 0.2
    assert len(times) == pytest.approx(100, abs=10)
    assert {len(column["values"]) for column in columns.values()} == {len(times)}
    assert {columns[name]["unit"] for name in ("time", "a", "b", "b_counts", "mode")} == {"s", "rad", "m", "counts", ""}
    assert [rest[f"{axis}_counts"]["values"][-1] for axis in "abc"] == list(counts)
    assert len(set(columns["b_counts"]["values"])) > 20
    assert set(columns["a"]["values"]) == {None}
    assert set(columns["moving"]["values"]) <= {0, 1}


async def test_columns_and_rate_are_chosen(tmp_path: Path) -> None:
    async with recording(tmp_path) as (_, client):
        await elapse(11.0)
        found = (await client.get("/v1/scope?seconds=10&rate=2&signal=b_counts&signal=mode")).json()["columns"]
    assert list(found) == ["time", "mode", "b_counts"]
    assert len(found["time"]["values"]) == pytest.approx(20, abs=1)


async def test_memory_that_does_not_reach_back_says_so(tmp_path: Path) -> None:
    async with recording(tmp_path) as (_, client):
        await elapse(3.0)
        found = (await client.get("/v1/scope?seconds=300")).json()
    assert found["end"] - found["begin"] == pytest.approx(3.0, abs=0.5)


@pytest.mark.parametrize("query", ["seconds=0", "seconds=301", "seconds=nan", "rate=0", "rate=101", "signal=w", "x=1"])
async def test_invalid_query_is_refused(query: str, tmp_path: Path) -> None:
    async with recording(tmp_path) as (_, client):
        refused = await client.get(f"/v1/scope?{query}")
        assert refused.status_code in {400, 422}
        assert refused.json()["code"] in {4003, 4005}


async def test_robot_without_a_recorder_has_no_scope() -> None:
    async with http_client() as (_, client):
        refused = await client.get("/v1/scope")
        assert (refused.status_code, refused.json()["code"]) == (400, 4005)
