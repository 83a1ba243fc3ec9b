"""The table of a twin, and that of a machine, on which only jobs tell where parts are."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
import pytest

from maya_un.assembly.stack import Stack, process_layer, stack
from maya_un.config import Config
from maya_un.errors import NotFound
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.schema.robot import TableView
from maya_un.service.service import Service
from maya_un.values import Point

CUBE, CAN, TRAY = Point(0.5, 1.1, 0.4), Point(1.0, 0.5, 0.4), Point(1.1, 0.5, 0.4)
PICK = {"parts": {"cube": list(CUBE)}, "steps": [{"pick": "cube"}]}


@asynccontextmanager
async def twin(*, homed: bool = True) -> AsyncIterator[Stack]:
    async with stack(Config(), live=False, parts={"cube": CUBE, "can": CAN}) as layers:
        if homed:
            await layers.service.command({"command": "gripper", "open": True})
            await layers.service.command({"command": "home"})
        yield layers


@asynccontextmanager
async def machine() -> AsyncIterator[Service]:
    """Yield a service that knows nothing of the twin behind its controller."""
    async with (
        twin() as layers,
        process_layer(layers.robot, layers.controller, layers.config, address="192.168.1.2") as above,
    ):
        yield above.service


async def ended(service: Service, job: dict[str, Any]) -> None:
    assert (await service.wait((await service.submit(job)).id)).state.value == "done"


async def test_twin_tells_where_the_parts_are_and_which_is_carried() -> None:
    async with twin() as layers:
        service = layers.service
        assert service.table() == TableView("twin", {"cube": CUBE, "can": CAN}, None, holding=False)
        await ended(service, PICK)
        assert service.table() == TableView("twin", {"cube": None, "can": CAN}, "cube", holding=True)
        await service.command({"command": "place", "target": list(TRAY)})
        view = service.table()
        assert (view.carried, view.holding) == (None, False)
        assert view.parts["cube"] == pytest.approx(TRAY, abs=1e-3)


async def test_twin_without_homing_knows_its_parts_and_not_what_it_holds() -> None:
    async with twin(homed=False) as layers:
        view = layers.service.table()
        assert (view.parts, view.carried) == ({"cube": CUBE, "can": CAN}, None)
        assert view.holding is layers.robot.holding


async def test_machine_believes_the_jobs() -> None:
    async with machine() as service:
        assert service.table() == TableView("believed", {}, None, holding=False)
        await ended(service, PICK)
        assert service.table() == TableView("believed", {"cube": None}, "cube", holding=True)
        await service.command({"command": "place", "target": list(TRAY)})
        assert service.table() == TableView("believed", {"cube": TRAY}, None, holding=False)


async def asked(service: Service, path: str) -> Any:
    """Return the answer of HTTP."""
    app = create_app(Bridge(asyncio.get_running_loop(), service))
    async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1") as client:
        return (await client.get(path)).json()


async def test_twin_answers_over_http() -> None:
    async with twin() as layers:
        parts = {"cube": list(CUBE), "can": list(CAN)}
        table = {"source": "twin", "parts": parts, "carried": None, "holding": False}
        assert await asked(layers.service, "/v1/table") == table
        found = await asked(layers.service, "/v1/twin")
        assert found["parts"] == parts
        assert found["joints"] == pytest.approx(layers.controller.state.joints, abs=1e-3)


async def test_the_pose_of_a_twin_can_be_measured_before_homing() -> None:
    async with twin(homed=False) as layers:
        before = (await asked(layers.service, "/v1/twin"))["joints"]
        await layers.controller.guarded_move("b", 0.03)
        after = (await asked(layers.service, "/v1/twin"))["joints"]
        assert after[1] - before[1] == pytest.approx(0.03, abs=1e-4)
        assert [after[0], after[2]] == pytest.approx([before[0], before[2]], abs=1e-4)


async def test_machine_answers_over_http_and_has_no_twin() -> None:
    async with machine() as service:
        table = {"source": "believed", "parts": {}, "carried": None, "holding": False}
        assert await asked(service, "/v1/table") == table
        assert (await asked(service, "/v1/twin"))["code"] == NotFound.code
