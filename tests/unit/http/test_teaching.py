"""The paths of poses and pallets, asked over HTTP of a real service on a stand-in for the controller."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import datetime, timedelta

import httpx
import pytest

from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.process.process import Process
from maya_un.process.spec.poses import PoseStore
from maya_un.robot.robot import MayaRobot
from maya_un.service.service import Service
from tests.fakes import FakeController

GRID = {"corners": ["shelf", [0.6, 1.0, 0.4]], "rows": 1, "columns": 4}


@asynccontextmanager
async def http_client(*, homed: bool = True) -> AsyncIterator[tuple[FakeController, httpx.AsyncClient]]:
    controller = FakeController(homed=homed)
    robot, store = MayaRobot(controller, controller.config), PoseStore(controller.mechanism)
    process = Process(robot, controller, controller.config, store.taught)
    service = Service(process, robot, controller, controller.config, store=store)
    transport = httpx.ASGITransport(create_app(Bridge(asyncio.get_running_loop(), service)), raise_app_exceptions=False)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
        yield controller, client
    await process.close()


async def test_a_pose_is_put_read_renamed_and_deleted() -> None:
    async with http_client() as (controller, client):
        put = await client.put("/v1/poses/shelf")
        assert put.status_code == 200
        pose = put.json()
        assert (pose["name"], pose["joints"]) == ("shelf", list(controller.state.joints or ()))
        assert datetime.fromisoformat(pose["taught"]).utcoffset() == timedelta(0)
        assert (await client.get("/v1/poses")).json() == [pose]
        assert (await client.get("/v1/poses/shelf")).json() == pose
        renamed = await client.patch("/v1/poses/shelf", json={"name": "año"})
        assert renamed.json() == {**pose, "name": "año"}
        assert (await client.get("/v1/poses/a%C3%B1o")).json()["name"] == "año"
        assert (await client.delete("/v1/poses/a%C3%B1o")).json() == {"forgotten": "año"}
        assert (await client.get("/v1/poses")).json() == []


@pytest.mark.parametrize("homed", [True, False])
async def test_a_pose_can_be_a_point_to_which_the_robot_does_not_move(homed: bool) -> None:
    async with http_client(homed=homed) as (controller, client):
        put = await client.put("/v1/poses/shelf", json={"point": [0.6, 1.0, 0.4]})
        assert put.status_code == 200
        pose = put.json()
        assert pose["point"] == pytest.approx([0.6, 1.0, 0.4])
        assert pose["joints"] == (await client.get("/v1/ik?x=0.6&y=1.0&z=0.4")).json()
        assert not controller.state.moving
        moved = await client.put("/v1/poses/shelf?replace=true", json={"point": [0.6, 1.0, 0.5]})
        assert moved.json()["point"] == pytest.approx([0.6, 1.0, 0.5])


async def test_a_pallet_is_put_read_renamed_and_deleted() -> None:
    async with http_client() as (controller, client):
        await client.put("/v1/poses/shelf")
        pallet = (await client.put("/v1/pallets/tray", json=GRID)).json()
        assert (pallet["name"], pallet["rows"], pallet["columns"]) == ("tray", 1, 4)
        assert pallet["corners"][:2] == [list(controller.state.point or ()), [0.6, 1.0, 0.4]]
        assert (await client.get("/v1/pallets")).json() == [pallet]
        renamed = await client.patch("/v1/pallets/tray", json={"name": "box"})
        assert renamed.json() == (await client.get("/v1/pallets/box")).json() == {**pallet, "name": "box"}
        assert (await client.delete("/v1/poses/shelf")).status_code == 422
        assert (await client.delete("/v1/pallets/box")).status_code == 200
        assert (await client.delete("/v1/poses/shelf")).status_code == 200


async def test_a_taught_name_is_a_target() -> None:
    async with http_client() as (_, client):
        await client.put("/v1/poses/shelf")
        report = await client.post("/v1/tasks?wait=true", json={"command": "approach", "target": "shelf"})
        assert (report.status_code, report.json()["state"]) == (200, "done")


async def test_overwriting_a_taught_pose_must_be_requested() -> None:
    async with http_client() as (_, client):
        await client.put("/v1/poses/shelf")
        again = await client.put("/v1/poses/shelf")
        assert (again.status_code, again.json()["code"]) == (409, 4011)
        assert (await client.put("/v1/poses/shelf?replace=true")).status_code == 200


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "code"),
    [
        ("GET", "/v1/poses/nowhere", None, 404, 4010),
        ("DELETE", "/v1/poses/nowhere", None, 404, 4010),
        ("PATCH", "/v1/poses/nowhere", {"name": "x"}, 404, 4010),
        ("GET", "/v1/pallets/shelf", None, 404, 4010),
        ("PUT", "/v1/poses/2", None, 422, 4001),
        ("PUT", "/v1/poses/far", {"point": [9.0, 9.0, 0.4]}, 422, 2101),
        ("PUT", "/v1/poses/far", {"point": [0.6, 1.0]}, 400, 4005),
        ("PUT", "/v1/poses/far", {"point": [0.6, 1.0, 0.4], "joints": [1.0, 1.0, 1.0]}, 400, 4005),
        ("PUT", "/v1/poses/shelf", {"point": [0.6, 1.0, 0.4]}, 409, 4011),
        ("PATCH", "/v1/poses/shelf", {}, 400, 4005),
        ("PATCH", "/v1/poses/shelf", {"name": "x", "to": "y"}, 400, 4005),
        ("PATCH", "/v1/poses/shelf", {"name": 3}, 422, 4001),
        ("PUT", "/v1/pallets/shelf", GRID, 409, 4011),
        ("PUT", "/v1/pallets/tray", {**GRID, "rows": 0}, 400, 4005),
        ("PUT", "/v1/pallets/tray", {**GRID, "corners": ["shelf", "shelf"]}, 422, 4001),
        ("PUT", "/v1/pallets/tray", None, 400, 4005),
        ("POST", "/v1/poses/shelf", None, 405, 4005),
    ],
)
async def test_impossible_request_is_refused_with_its_code(
    method: str, path: str, body: object, status: int, code: int
) -> None:
    async with http_client() as (_, client):
        await client.put("/v1/poses/shelf")
        response = await client.request(method, path, json=body)
        assert (response.status_code, response.json()["code"]) == (status, code)
        assert [pose["name"] for pose in (await client.get("/v1/poses")).json()] == ["shelf"]


async def test_nothing_is_taught_before_homing() -> None:
    async with http_client(homed=False) as (_, client):
        response = await client.put("/v1/poses/shelf")
        assert (response.status_code, response.json()["code"]) == (409, 2103)


@pytest.mark.parametrize("name", ["", "a%2Fb", "%ed%b3%bf", "a%20b"])
async def test_invalid_name_gets_one_answer_in_any_spelling(name: str) -> None:
    async with http_client() as (_, client):
        refused = await client.put(f"/v1/poses/{name}")
        unknown = await client.delete(f"/v1/pallets/{name}")
    assert (refused.status_code, refused.json()["code"]) == (422, 4001)
    assert (unknown.status_code, unknown.json()["code"]) == (404, 4010)
