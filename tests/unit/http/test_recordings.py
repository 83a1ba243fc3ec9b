"""Recordings over HTTP, of a real robot on the twin, decoded in a real worker."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from urllib.parse import quote

import httpx
import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from tests.recorded import recording_store
from tests.virtual_time import elapse


@asynccontextmanager
async def recorded_robot(folder: Path) -> AsyncIterator[tuple[Stack, httpx.AsyncClient]]:
    with staffed(Config()) as staff:
        async with stack(Config(), recordings=recording_store(folder), staff=staff) as robot:
            await elapse(3.0)
            bridge = Bridge(asyncio.get_running_loop(), robot.service)
            transport = httpx.ASGITransport(create_app(bridge), raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
                yield robot, client


async def test_a_recording_is_read_as_columns_events_and_table(tmp_path: Path) -> None:
    async with recorded_robot(tmp_path) as (_, client):
        name = (await client.post("/v1/recordings")).json()["name"]
        place = f"/v1/recordings/{quote(name)}"
        whole = (await client.get(f"{place}/states")).json()
        times = whole["columns"]["time"]["values"]
        assert len(times) > 10
        assert whole["end"] - whole["begin"] == pytest.approx(3.0, abs=0.1)
        some = (await client.get(f"{place}/states", params={"from": 1.0, "to": 2.0, "rate": 5})).json()
        kept = some["columns"]["time"]["values"]
        assert len(kept) == pytest.approx(5, abs=1)
        assert all(1.0 <= time < 2.0 for time in kept)
        events = (await client.get(f"{place}/events")).json()
        assert events[0]["kind"] == "connected"
        table = await client.get(f"{place}/csv")
        assert table.headers["content-type"] == "text/csv; charset=utf-8"
        assert table.headers["content-disposition"] == f'attachment; filename="{name.removesuffix(".mcap")}.csv"'
        assert len(table.text.splitlines()) == len(times) + 1


@pytest.mark.parametrize("what", ["states", "events", "csv"])
async def test_unknown_recording_and_invalid_query_are_refused(what: str, tmp_path: Path) -> None:
    async with recorded_robot(tmp_path) as (_, client):
        for name in ("2026-11-21T19-25-20Z-asked.mcap", "..%2Fmaya.db", "x"):
            assert (await client.get(f"/v1/recordings/{name}/{what}")).status_code == 404
        name = (await client.post("/v1/recordings")).json()["name"]
        for query in ("from=nan", "to=1e10", "from=a", "rate=0&", "begin=0"):
            answer = await client.get(f"/v1/recordings/{name}/{what}?{query}")
            assert answer.json()["code"] == 4005, query
        (tmp_path / name).write_bytes(b"damaged")
        assert (await client.get(f"/v1/recordings/{name}/{what}")).json()["code"] == 4007
