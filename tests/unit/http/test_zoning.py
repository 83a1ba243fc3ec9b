"""The paths of zones, asked over HTTP of a real service on a stand-in for the controller."""

from __future__ import annotations

import asyncio
from typing import Any

from tests.unit.http.test_teaching import http_client
from tests.virtual_time import elapse

CRATE: dict[str, Any] = {"kind": "box", "low": [0.3, 0.9, 0.0], "high": [0.7, 1.3, 0.5]}
WHOLE = {**CRATE, "name": "crate", "margin": 0.05, "lines": True}


async def test_a_zone_is_put_listed_and_deleted() -> None:
    async with http_client() as (controller, client):
        assert (await client.get("/v1/zones")).json() == []
        put = await client.put("/v1/zones/crate", json=CRATE)
        assert (put.status_code, put.json()) == (200, WHOLE)
        assert (await client.put("/v1/zones/crate", json=WHOLE | {"margin": 0.1})).json()["margin"] == 0.1
        assert (await client.get("/v1/zones")).json() == [WHOLE | {"margin": 0.1}]
        assert [zone.name for zone in controller.zones] == ["crate"]
        assert (await client.delete("/v1/zones/crate")).json() == {"removed": "crate"}
        assert controller.zones == ()


async def test_a_zone_that_is_not_there_is_not_found() -> None:
    async with http_client() as (_, client):
        answer = await client.delete("/v1/zones/crate")
        assert (answer.status_code, answer.json()["code"]) == (404, 4004)


async def test_invalid_zone_is_refused_by_its_key() -> None:
    async with http_client() as (_, client):
        for body, key in (
            ({}, "kind"),
            (CRATE | {"low": [0.3, 0.9]}, "low.2"),
            (CRATE | {"name": "other"}, "name"),
            (CRATE | {"colour": "red"}, "colour"),
        ):
            answer = await client.put("/v1/zones/crate", json=body)
            assert (answer.status_code, answer.json()["details"]["key"]) == (400, key)
        missing = await client.put("/v1/zones/crate", json=CRATE | {"low": [0.3, 0.9]})
        assert missing.json()["details"]["reason"] == "it is missing"
        assert (await client.put("/v1/zones/a%20b", json=CRATE)).json()["details"]["key"] == "name"
        assert (await client.get("/v1/zones")).json() == []


async def test_command_into_a_zone_is_refused_by_the_zones_name() -> None:
    async with http_client() as (_, client):
        await client.put("/v1/zones/crate", json=CRATE)
        request = {"command": "approach", "target": [0.5, 1.1, 0.4]}
        report = (await client.post("/v1/tasks?wait=true", json=request)).json()
        assert (report["state"], report["code"]) == ("failed", 2101)
        assert "zone crate" in report["message"]


async def test_while_a_job_runs_zones_stay() -> None:
    async with http_client() as (_, client):
        request = {"command": "approach", "target": [0.5, 1.1, 0.4]}
        job = asyncio.create_task(client.post("/v1/tasks?wait=true", json=request))
        await elapse(1.0)
        answer = await client.put("/v1/zones/crate", json=CRATE)
        assert (answer.status_code, answer.json()["code"]) == (409, 2104)
        await job
