"""The paths that ask about the machine itself, asked over HTTP of a real service."""

from __future__ import annotations

from math import cos, sin

import pytest

from maya_un.config import Config
from tests.unit.http.test_teaching import http_client
from tests.unit.http.test_zoning import CRATE


async def test_a_point_and_its_joints_lead_to_each_other() -> None:
    async with http_client() as (_, client):
        joints = (await client.get("/v1/ik?x=0.5&y=1.2&z=0.5")).json()
        assert joints == pytest.approx([0.394791, 1.929378, 1.929378], abs=1e-6)
        back = (await client.get("/v1/fk", params=dict(zip("abc", joints, strict=True)))).json()
        assert back == pytest.approx([0.5, 1.2, 0.5], abs=1e-9)


async def test_unreachable_point_is_answered_by_reach_and_refused_by_ik() -> None:
    async with http_client() as (_, client):
        answer = (await client.get("/v1/reach?x=0.5&y=1.2&z=2.2")).json()
        assert (answer["reachable"], answer["joints"]) == (False, None)
        assert "meet 50 mm above their anchors" in answer["reason"]
        refused = await client.get("/v1/ik?x=0.5&y=1.2&z=2.2")
        assert (refused.status_code, refused.json()["code"]) == (422, 2101)
        assert (await client.get("/v1/fk?a=0&b=0.6&c=0.6")).json()["code"] == 2101


@pytest.mark.parametrize("query", ["x=0.5&y=1.2", "x=nan&y=1&z=1", "x=inf&y=1&z=1", "x=10001&y=1&z=1", "x=a&y=1&z=1"])
async def test_invalid_point_is_refused(query: str) -> None:
    async with http_client() as (_, client):
        for path in ("/v1/reach", "/v1/ik"):
            answer = await client.get(f"{path}?{query}")
            assert answer.status_code in {400, 422}
            assert answer.json()["code"] in {4001, 4005}


async def test_constants_include_the_zones_of_this_run() -> None:
    async with http_client() as (_, client):
        await client.put("/v1/zones/crate", json=CRATE)
        found = Config.model_validate_json((await client.get("/v1/config")).content)
        assert [zone.name for zone in found.zones] == ["crate"]
        assert found.model_copy(update={"zones": ()}) == Config()


async def test_nearest_limit_of_every_unit_is_that_of_the_position() -> None:
    async with http_client() as (controller, client):
        assert controller.state.point is not None
        x, y, z = controller.state.point
        for zoned in (False, True):
            reach = (await client.get("/v1/reach", params={"x": x, "y": y, "z": z})).json()
            nearest = (await client.get("/v1/margins")).json()["nearest"]
            assert {one["unit"] for one in nearest} == {"m", "rad", "load"}
            for one in nearest:
                margins = [other["margin"] for other in reach["margins"] if other["unit"] == one["unit"]]
                assert one["margin"] == pytest.approx(min(margins), abs=1e-6)
            assert any(one["zone"] == "near" for one in nearest) is zoned
            box = {"kind": "box", "low": [x - 0.1, y - 0.1, 0.0], "high": [x + 0.1, y + 0.1, z - 0.06]}
            assert (await client.put("/v1/zones/near", json=box)).status_code == 200


async def test_no_limit_is_near_before_homing() -> None:
    async with http_client(homed=False) as (_, client):
        assert (await client.get("/v1/margins")).json() == {"nearest": []}


async def test_many_points_are_answered_as_one_by_one() -> None:
    points = [[0.1 * x, 0.1 * y, 0.4] for x in range(-10, 20) for y in range(10)]
    async with http_client() as (_, client):
        await client.put("/v1/zones/crate", json=CRATE)
        found = (await client.post("/v1/reach", json={"points": points})).json()["reachable"]
        assert {True, False} == set(found)
        for point, reachable in list(zip(points, found, strict=True))[::7]:
            one = await client.get("/v1/reach", params=dict(zip("xyz", point, strict=True)))
            assert one.json()["reachable"] is reachable
        assert (await client.post("/v1/reach", json={"points": []})).json() == {"reachable": []}


@pytest.mark.parametrize(
    "points", [[[0.0, 0.0]], [[0.0, 0.0, 1e5]], [[0.0, 0.0, "a"]], [[0.0] * 3] * 501, {"x": 1}, None]
)
async def test_invalid_points_are_refused(points: object) -> None:
    async with http_client() as (_, client):
        answer = await client.post("/v1/reach", json={"points": points})
        assert (answer.status_code, answer.json()["code"]) in {(422, 4001), (400, 4005)}


async def test_shape_encloses_what_is_reachable() -> None:
    async with http_client() as (_, client):
        shape = (await client.get("/v1/workspace?z=0.4")).json()
        assert shape["outline"][0] == shape["outline"][-1]
        ((near, far),) = shape["rings"]
        angle = 0.5 * sum(shape["boom"])
        distances = [near - 0.01, near + 0.01, far - 0.01, far + 0.01]
        points = [[d * sin(angle), d * cos(angle), 0.4] for d in distances]
        found = (await client.post("/v1/reach", json={"points": points})).json()["reachable"]
        assert found == [False, True, True, False]
        assert (await client.get("/v1/workspace")).json() == {**shape, "z": None, "rings": []}
