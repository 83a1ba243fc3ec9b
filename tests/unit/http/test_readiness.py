from __future__ import annotations

import asyncio
import threading
from dataclasses import replace
from typing import cast

import httpx
import pytest

from dmc41x3.loops import run
from maya_un.errors import NodeGone
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.routes.system import READINESS_TIMEOUT, readiness, storage_of
from maya_un.process.journal.sqlite import SqliteJournal
from maya_un.schema.robot import Readiness
from maya_un.service.service import Service
from maya_un.values import Mode
from tests.unit.http.service_stand_in import Now, ServiceStandIn, app_client
from tests.virtual_time import elapse


def bridge_to(service: ServiceStandIn, journal: SqliteJournal | None = None) -> Bridge:
    """Return the bridge to a stand-in, within the running loop."""
    return Bridge(asyncio.get_running_loop(), cast("Service", service), journal=journal)


async def test_responsive_robot_is_ready() -> None:
    assert await readiness(bridge_to(ServiceStandIn()), "en") == Readiness(True, ())


@pytest.mark.parametrize(("language", "word"), [("en", "connection"), ("es", "conexión")])
async def test_without_a_link_it_is_not(language: str, word: str) -> None:
    service = ServiceStandIn()
    service.now = Now(state=replace(Now().state, mode=Mode.DISCONNECTED))
    found = await readiness(bridge_to(service), language)
    assert (found.ready, [reason.code for reason in found.reasons]) == (False, [1010])
    assert word in found.reasons[0].message


async def test_missing_layer_makes_it_not_ready() -> None:
    bridge = bridge_to(ServiceStandIn())
    bridge.missing = lambda: [NodeGone(node="robot_controller")]
    found = await readiness(bridge, "en")
    assert (found.ready, [reason.code for reason in found.reasons]) == (False, [1011])
    assert found.reasons[0].message.startswith("robot_controller has ended")


async def test_hanging_loop_is_not_ready_and_reported_in_time() -> None:
    service = ServiceStandIn()
    service.hangs = True
    began = asyncio.get_running_loop().time()
    found = await readiness(bridge_to(service), "en")
    assert [reason.code for reason in found.reasons] == [1021]
    assert asyncio.get_running_loop().time() - began == READINESS_TIMEOUT
    await elapse(0.0)  # the word that nobody waits any more travels from one loop to the other


async def test_with_a_journal_that_cannot_be_written_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SqliteJournal, "failing", property(lambda _: "no room is left"))
    monkeypatch.setattr(SqliteJournal, "commits", property(lambda _: 7))
    service = ServiceStandIn()
    service.failing = "no room is left"
    bridge = bridge_to(service, object.__new__(SqliteJournal))
    found = await readiness(bridge, "en")
    assert [reason.code for reason in found.reasons] == [5007]
    assert "no room is left" in found.reasons[0].message
    assert storage_of(bridge) == ("no room is left", 7)


async def test_a_probe_reads_it_from_the_status() -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        good = await client.get("/v1/ready")
        service.now = Now(state=replace(Now().state, mode=Mode.DISCONNECTED))
        bad = await client.get("/v1/ready", headers={"Accept-Language": "es"})
    assert (good.status_code, good.json()) == (200, {"ready": True, "reasons": []})
    assert (bad.status_code, bad.json()["reasons"][0]["code"]) == (503, 1010)


@pytest.mark.waits("1 s until a thread whose loop hangs counts as not ready")
def test_process_lives_and_is_not_ready_while_the_loop_of_the_robot_hangs() -> None:
    loop, hanging = asyncio.new_event_loop(), threading.Event()
    loop.call_soon(hanging.wait)
    bridge = Bridge(loop, cast("Service", ServiceStandIn()))

    async def asked() -> tuple[httpx.Response, httpx.Response, Readiness]:
        transport = httpx.ASGITransport(create_app(bridge), client=("127.0.0.1", 50_000))
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
            health, ready = await client.get("/v1/health"), await client.get("/v1/ready")
            hanging.set()
            return health, ready, await readiness(bridge, "en")

    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    health, ready, after = run(asked())
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()
    assert (health.status_code, ready.status_code) == (200, 503)
    assert [reason["code"] for reason in ready.json()["reasons"]] == [1021]
    assert after == Readiness(True, ())
