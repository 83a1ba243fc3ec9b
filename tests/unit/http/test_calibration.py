"""The calibration over HTTP, of a robot on the twin and of files of made-up points."""

from __future__ import annotations

import asyncio
import tomllib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from maya_un.assembly.stack import Stack, stack
from maya_un.assembly.staff import staffed
from maya_un.config.files import parse
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.kinematics.calibration import FittedConstants, model
from maya_un.service.calibration import service
from maya_un.service.calibration.points import PointNotebook, read
from maya_un.values import Point
from maya_un.workers import WorkerSet
from tests.calm import CALM
from tests.unit.http.test_teaching import http_client
from tests.unit.kinematics.calibration.bench import TRUTH, measured, random_counts

PATH = "/v1/calibration"


@asynccontextmanager
async def calibrating(
    folder: Path, *, homed: bool = False, staff: WorkerSet | None = None
) -> AsyncIterator[tuple[Stack, httpx.AsyncClient]]:
    """Open a robot whose points are in `folder`."""
    async with stack(CALM, places=folder / "poses.toml", live=homed, staff=staff) as running:
        if homed:
            await running.service.command({"command": "home"})
        bridge = Bridge(asyncio.get_running_loop(), running.service, gate=running.gate)
        transport = httpx.ASGITransport(create_app(bridge), raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
            yield running, client


def write_points(folder: Path, number: int) -> None:
    """Write points of a machine with other constants, the fifth of which is wrong by a hand's breadth."""
    rng = np.random.default_rng(21)
    seen = measured(TRUTH, random_counts(rng, number), rng)
    notebook = PointNotebook(folder / "calibration.csv", CALM)
    for index, (counts, place) in enumerate(zip(seen.counts, seen.points, strict=True)):
        a, b, c = counts.round().astype(int).tolist()
        x, y, z = place + np.array([0.08, 0.0, -0.05]) * (index == 4)
        notebook.add((a, b, c), Point(x, y, z))


async def test_point_is_measured_at_the_present_position_and_removed(tmp_path: Path) -> None:
    async with calibrating(tmp_path, homed=True) as (running, client):
        assert (await client.get(PATH)).json() == {
            "path": str(tmp_path / "calibration.csv"), "points": [], "extendable": True, "fit": None
        }  # fmt: skip
        state = running.service.state
        assert state.point is not None
        x, y, z = state.point
        added = await client.post(f"{PATH}/points", json={"point": [x + 0.01, y, z]})
        assert added.status_code == 201
        (point,) = added.json()["points"]
        assert point["counts"] == list(state.counts)
        assert point["joints"] == pytest.approx(list(state.joints or ()), abs=1e-6)
        assert point["expected"] == pytest.approx([x, y, z], abs=1e-6)
        assert point["off"] == pytest.approx(0.01, abs=1e-5)
        await client.post(f"{PATH}/points", json={"point": [x, y, z]})
        first, second = (await client.get(PATH)).json()["points"]
        left = (await client.delete(f"{PATH}/points/{first['row']}")).json()["points"]
        assert left == [second]
        again = await client.delete(f"{PATH}/points/{first['row']}")
        assert (again.status_code, again.json()["code"]) == (404, 4004)
        assert len(read(tmp_path / "calibration.csv", CALM).observations) == 1


async def test_point_that_took_the_row_of_the_one_that_was_read_stays(tmp_path: Path) -> None:
    async with calibrating(tmp_path, homed=True) as (running, client):
        point = running.service.state.point
        assert point is not None
        x, y, z = point
        (read_before,) = (await client.post(f"{PATH}/points", json={"point": [x + 0.01, y, z]})).json()["points"]
        await client.delete(PATH)
        (now,) = (await client.post(f"{PATH}/points", json={"point": [x, y, z]})).json()["points"]
        assert now["row"] == read_before["row"]
        place = f"{PATH}/points/{now['row']}"
        for measured in (read_before["measured"], [x, y], ["nan", "nan", "nan"]):
            refused = await client.delete(place, params={"measured": measured})
            assert (refused.status_code, refused.json()["code"]) == (404, 4004)
        assert (await client.get(PATH)).json()["points"] == [now]
        left = await client.delete(place, params={"measured": now["measured"]})
        assert (left.status_code, left.json()["points"]) == (200, [])


async def test_point_that_is_not_plausible_is_refused(tmp_path: Path) -> None:
    async with calibrating(tmp_path, homed=True) as (_, client):
        for point in ([0.0, 0.0, 0.0], [500.0, 1200.0, 400.0], [0.5, 1.2], None, ["a", 1, 2]):
            refused = await client.post(f"{PATH}/points", json={"point": point})
            assert refused.status_code in {400, 422}
            assert refused.json()["code"] in {4001, 4005}
        assert (await client.get(PATH)).json()["points"] == []


async def test_robot_that_is_not_homed_takes_no_point(tmp_path: Path) -> None:
    async with calibrating(tmp_path) as (_, client):
        refused = await client.post(f"{PATH}/points", json={"point": [0.5, 1.2, 0.4]})
        assert (refused.status_code, refused.json()["code"]) == (409, 2103)


async def test_fit_finds_the_constants_and_the_wrong_point(tmp_path: Path) -> None:
    write_points(tmp_path, 30)
    async with calibrating(tmp_path) as (_, client):
        answered = await client.post(f"{PATH}/fit")
        assert answered.status_code == 200
        found = answered.json()
        kept = (await client.get(PATH)).json()
    require_truth(found)
    assert kept["fit"] == found
    worst = max(kept["points"], key=lambda point: point["off"])
    assert found["outliers"] == [kept["points"][4]["row"]] == [worst["row"]]
    (wrong,) = [one for one in found["residuals"] if not one["used"]]
    assert wrong["row"] == worst["row"]
    assert np.linalg.norm(wrong["after"]) == pytest.approx(0.094, abs=0.01)


def require_truth(found: dict[str, Any]) -> None:
    constants = {constant["name"]: constant for constant in found["constants"]}
    assert constants["zero_a"]["fitted"] == pytest.approx(TRUTH.zero_a, abs=5.0 * constants["zero_a"]["error"])
    assert constants["gripper_height"]["held"]
    assert (found["measured"], found["used"]) == (30, 29)
    assert found["rms_after"] < 0.003
    assert found["rms_before"] > 0.01


async def test_toml_of_a_fit_is_a_configuration_that_fits_the_points(tmp_path: Path) -> None:
    write_points(tmp_path, 30)
    async with calibrating(tmp_path) as (_, client):
        found = (await client.post(f"{PATH}/fit", json={"hold": ["height"]})).json()
    fitted = parse(tomllib.loads(found["toml"]))
    assert fitted.geometry.height == CALM.geometry.height
    seen = read(tmp_path / "calibration.csv", fitted).observations
    off = model.points(FittedConstants.of(fitted), seen.counts) - seen.points
    assert off == pytest.approx(np.array([one["after"] for one in found["residuals"]]), abs=1e-5)


async def test_fit_is_forgotten_when_the_points_change(tmp_path: Path) -> None:
    write_points(tmp_path, 30)
    async with calibrating(tmp_path) as (_, client):
        await client.post(f"{PATH}/fit")
        view = (await client.get(PATH)).json()
        assert view["fit"] is not None
        changed = await client.delete(f"{PATH}/points/{view['points'][0]['row']}")
        assert changed.json()["fit"] is None


async def test_too_few_points_and_unknown_constants_are_refused(tmp_path: Path) -> None:
    write_points(tmp_path, 2)
    async with calibrating(tmp_path) as (_, client):
        refused = await client.post(f"{PATH}/fit")
        assert (refused.status_code, refused.json()["code"]) == (422, 4009)
        unknown = await client.post(f"{PATH}/fit", json={"hold": ["weight"]})
        assert (unknown.status_code, unknown.json()["code"]) == (422, 4003)
        (tmp_path / "calibration.csv").unlink()
        empty = await client.post(f"{PATH}/fit")
        assert (empty.status_code, empty.json()["code"]) == (422, 4007)


async def test_points_of_another_configuration_must_be_removed_first(tmp_path: Path) -> None:
    write_points(tmp_path, 3)
    file = tmp_path / "calibration.csv"
    file.write_text(file.read_text().replace("# datum ", "# datum 1"))
    async with calibrating(tmp_path, homed=True) as (running, client):
        view = (await client.get(PATH)).json()
        assert (len(view["points"]), view["extendable"]) == (3, False)
        point = list(running.service.state.point or ())
        refused = await client.post(f"{PATH}/points", json={"point": point})
        assert (refused.status_code, refused.json()["code"]) == (400, 4005)
        assert (await client.delete(PATH)).json()["extendable"] is True
        assert len((tmp_path / "calibration.csv.old").read_text().splitlines()) == 6
        added = (await client.post(f"{PATH}/points", json={"point": point})).json()
        assert added["points"][0]["off"] == pytest.approx(0.0, abs=1e-5)


async def test_head_of_another_configuration_is_not_continued(tmp_path: Path) -> None:
    write_points(tmp_path, 1)
    file = tmp_path / "calibration.csv"
    file.write_text(file.read_text().replace("# datum ", "# datum 1"))
    async with calibrating(tmp_path, homed=True) as (running, client):
        (only,) = (await client.get(PATH)).json()["points"]
        await client.delete(f"{PATH}/points/{only['row']}")
        point = list(running.service.state.point or ())
        (added,) = (await client.post(f"{PATH}/points", json={"point": point})).json()["points"]
        assert added["counts"] == list(running.service.state.counts)


async def test_number_of_points_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MOST_POINTS", 1)
    async with calibrating(tmp_path, homed=True) as (running, client):
        point = list(running.service.state.point or ())
        codes = [(await client.post(f"{PATH}/points", json={"point": point})).status_code for _ in range(2)]
        assert codes == [201, 400]


async def test_damaged_file_is_refused_with_its_row(tmp_path: Path) -> None:
    (tmp_path / "calibration.csv").write_text("a,b,c,x,y,z\n1,2,3,4\n")
    async with calibrating(tmp_path) as (_, client):
        refused = await client.get(PATH)
        assert (refused.status_code, refused.json()["code"]) == (422, 4001)
        assert "row 2" in refused.json()["detail"]


async def test_robot_without_a_folder_has_no_points() -> None:
    async with http_client() as (_, client):
        for answer in (
            await client.get(PATH),
            await client.delete(PATH),
            await client.post(f"{PATH}/points", json={"point": [0.5, 1.2, 0.5]}),
            await client.post(f"{PATH}/fit"),
        ):
            assert (answer.status_code, answer.json()["code"]) == (404, 4004)


async def test_fit_runs_in_a_worker(tmp_path: Path) -> None:
    write_points(tmp_path, 30)
    with staffed(CALM) as staff:
        async with calibrating(tmp_path, staff=staff) as (_, client):
            require_truth((await client.post(f"{PATH}/fit")).json())
