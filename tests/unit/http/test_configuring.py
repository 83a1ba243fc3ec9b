"""The configuration over HTTP: described, checked, and written to its file for the next start."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from dmc41x3.i18n import LANGUAGES
from maya_un.assembly.stack import Stack, stack
from maya_un.assembly.staff import staffed
from maya_un.config import Config, load, template
from maya_un.config.files import alone, parse, replace, text_of
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.process.computation import MOST_TEXT

MINE = """\
# The machine in the hall.
[geometry]
height = 2.34  # measured twice

[axes.b]
jerk_counts = 50_000

[[zones]]
name = "crate"
kind = "box"
low = [0.0, 1.0, 0.0]
high = [0.3, 1.5, 0.6]
"""
BOX = {"name": "pillar", "kind": "box", "low": [0.9, 0.9, 0.0], "high": [1.0, 1.0, 2.0], "margin": 0.1, "lines": False}


@asynccontextmanager
async def configured(file: Path | None) -> AsyncIterator[tuple[Stack, httpx.AsyncClient]]:
    """Give a robot with the configuration of a file, and a client."""
    config = Config() if file is None else load(file)
    async with stack(config, config_file=file, live=False) as robot:
        bridge = Bridge(asyncio.get_running_loop(), robot.service)
        transport = httpx.ASGITransport(create_app(bridge), raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1:4133") as client:
            yield robot, client


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "config.toml"
    path.write_text(MINE, encoding="utf-8")
    return path


async def check(client: httpx.AsyncClient, **body: Any) -> dict[str, Any]:
    return (await client.post("/v1/config/check", json=body)).json()


async def test_schema_describes_every_setting() -> None:
    async with configured(None) as (_, client):
        schema = (await client.get("/v1/config/schema")).json()
    settings = {one["name"]: one for one in schema["settings"]}
    defaults = {name: one["default"] for name, one in settings.items()}
    nested = {one["name"]: {} for one in schema["sections"]}
    for name, default in defaults.items():
        section, _, key = name.rpartition(".")
        assert settings[name]["section"] == section
        nested.setdefault(section, {})[key] = default
    whole = Config().model_dump(mode="json")
    assert nested[""] == {"zones": []}
    assert nested["axes.b"] == whole["axes"]["b"]
    assert set(defaults) - {"zones"} == {
        *(f"{name}.{key}" for name, section in whole.items() if name not in {"axes", "zones"} for key in section),
        *(f"axes.{axis}.{key}" for axis, section in whole["axes"].items() for key in section),
    }
    for one in (*schema["settings"], *schema["sections"]):
        assert one["description"].keys() == set(LANGUAGES)
        assert one["description"]["es"] != one["description"]["en"]


async def test_schema_has_units_ranges_and_choices() -> None:
    async with configured(None) as (_, client):
        settings = {one["name"]: one for one in (await client.get("/v1/config/schema")).json()["settings"]}
    height = settings["geometry.height"]
    assert (height["type"], height["unit"], height["exclusive_minimum"], height["maximum"]) == ("number", "m", 0, 10)
    assert height["description"]["en"] == "H, height of the anchors above the table"
    assert [settings[f"axes.{axis}.minimum"]["unit"] for axis in "abc"] == ["rad", "m", "m"]
    assert settings["gripper.closed_by"]["choices"] == ["clear", "set"]
    jerk = settings["axes.a.jerk_counts"]
    assert (jerk["optional"], jerk["type"], jerk["unit"], jerk["minimum"]) == (True, "integer", "counts/s3", 1024)
    assert settings["recorder.enabled"]["type"] == "boolean"
    assert settings["camera.url"]["pattern"].startswith("^(https?://")


async def test_check_returns_differences_from_now_and_from_the_default(file: Path) -> None:
    async with configured(file) as (_, client):
        found = await check(client, settings={"cell": {"clearance": 0.2}, "axes": {"b": {"jerk_counts": None}}})
        assert found["mistakes"] == []
        assert found["from_now"] == [
            {"name": "axes.b.jerk_counts", "before": 50000, "after": None},
            {"name": "cell.clearance", "before": 0.1, "after": 0.2},
        ]
        names = [one["name"] for one in found["from_default"]]
        assert names == ["geometry.height", "cell.clearance", "zones"]
        whole = await check(client, text="[cell]\nclearance = 0.2\n")
        assert [one["name"] for one in whole["from_default"]] == ["cell.clearance"]
        assert [one["name"] for one in whole["from_now"]] == [
            *("geometry.height", "axes.b.jerk_counts", "cell.clearance", "zones")
        ]
    assert text_of(file) == MINE


async def test_check_returns_all_mistakes_by_name() -> None:
    settings = {
        "geometry": {"height": 2350, "depth": 1},
        "gripper": {"closed_by": "glue"},
        "camera": {"url": "javascript:alert(1)"},
        "lamp": {"on": True},
        "zones": [{**BOX, "kind": "ball"}],
    }
    async with configured(None) as (_, client):
        found = await check(client, settings=settings)
    assert (found["from_now"], found["from_default"]) == ([], [])
    reasons = {one["name"]: one["reason"] for one in found["mistakes"]}
    assert reasons.keys() == {
        *("geometry.height", "geometry.depth", "gripper.closed_by", "camera.url", "lamp", "zones.0.kind")
    }
    assert reasons["geometry.depth"] == reasons["lamp"] == "there is no such key"
    assert {one["name"]: one["value"] for one in found["mistakes"]}["geometry.height"] == "2350"


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({"geometry": {"delta": 3.0}}, "geometry.delta"),
        ({"axes": {"b": {"minimum": 2.3}}}, "axes.b.minimum"),
        ({"controller": {"outputs": [1]}}, "controller.outputs"),
        ({"geometry": 3}, "geometry"),
        ({"recorder": {"seconds": "x"}}, "recorder.seconds"),
        ({"lamp": {"on": None}}, "lamp"),
        ({"cell": {"clearance": [1, {"a": None}]}}, "cell.clearance"),
        ({"recorder": {"files": 10**30}}, "recorder.files"),
        ({"zones": [{**BOX, "margin": None}]}, "zones.0.margin"),
    ],
)
async def test_contradictions_and_types_are_mistakes(settings: dict[str, Any], name: str) -> None:
    async with configured(None) as (_, client):
        found = await check(client, settings=settings)
    assert [one["name"] for one in found["mistakes"]] == [name]


@pytest.mark.parametrize("text", ["[geometry", "height = 1e999999\n[", "a = " + "[" * 5000, "geometry.height = nan"])
async def test_invalid_text_is_a_mistake(text: str) -> None:
    async with configured(None) as (_, client):
        assert len((await check(client, text=text))["mistakes"]) == 1


async def test_deeply_nested_settings_are_refused() -> None:
    deep = "[" * 900 + "]" * 900
    async with configured(None) as (_, client):
        for body in (f'{{"settings": {{"geometry": {deep}}}}}', '{"settings":' + '{"a":' * 900 + "1" + "}" * 901):
            answer = await client.post("/v1/config/check", content=body)
            assert answer.status_code in {200, 400}
            assert "Traceback" not in answer.text


async def test_written_settings_are_in_force_after_the_next_start(file: Path) -> None:
    changes = {
        "geometry": {"height": 2.36},
        "axes": {"b": {"jerk_counts": None}},
        "camera": {"url": "http://cam:8080/a"},
    }
    async with configured(file) as (robot, client):
        done = (await client.put("/v1/config", json={"settings": changes})).json()
        assert [one["name"] for one in done["from_now"]] == ["geometry.height", "axes.b.jerk_counts", "camera.url"]
        assert (await client.get("/v1/config")).json()["geometry"]["height"] == robot.config.geometry.height == 2.34
    text = text_of(file)
    assert text.startswith("# The machine in the hall.\n[geometry]\nheight = 2.36  # measured twice\n")
    async with configured(file) as (robot, client):
        now = (await client.get("/v1/config")).json()
        assert (now["geometry"]["height"], now["camera"]["url"]) == (2.36, "http://cam:8080/a")
        assert robot.config.axes.b.jerk_counts is None
        assert [zone.name for zone in robot.config.zones] == ["crate"]
        assert (await check(client, settings={}))["from_now"] == []


async def test_whole_configuration_can_be_sent_back(file: Path) -> None:
    async with configured(file) as (robot, client):
        whole = (await client.get("/v1/config")).json()
        whole["zones"].append(BOX)
        whole["cell"]["smooth"] = False
        done = (await client.put("/v1/config", json={"settings": whole})).json()
        assert [one["name"] for one in done["from_now"]] == ["cell.smooth", "zones"]
        expected = robot.config.model_dump(mode="json") | {"cell": whole["cell"], "zones": whole["zones"]}
    assert load(file) == parse(json.loads(json.dumps(_without_none(expected))))
    async with configured(file) as (_, client):
        await client.put("/v1/config", json={"settings": {"zones": []}})
    assert load(file).zones == ()


def _without_none(value: Any) -> Any:
    return {k: _without_none(v) for k, v in value.items() if v is not None} if isinstance(value, dict) else value


async def test_text_replaces_the_file(file: Path) -> None:
    async with configured(file) as (_, client):
        assert (await client.put("/v1/config", json={"text": template()})).json()["from_default"] == []
    assert text_of(file) == template()


async def test_missing_file_is_made(tmp_path: Path) -> None:
    place = tmp_path / "new" / "config.toml"
    async with stack(Config(), config_file=place, live=False) as robot:
        await robot.service.configuring.write({"settings": {"zones": [BOX], "controller": {"outputs": [2, 3]}}})
    assert load(place).controller.outputs == (2, 3)
    assert [zone.name for zone in load(place).zones] == ["pillar"]


async def test_mistakes_are_not_written(file: Path) -> None:
    async with configured(file) as (_, client):
        refused = await client.put("/v1/config", json={"settings": {"geometry": {"height": 2350}}})
        assert (refused.status_code, refused.json()["code"]) == (422, 5001)
        assert refused.json()["details"]["key"] == "geometry.height"
        assert (await client.put("/v1/config", json={"text": "[x"})).json()["code"] == 5001
        with alone(file):
            assert (await client.put("/v1/config", json={"settings": {}})).json()["code"] == 5002
        replace(file, "[broken")
        assert (await client.put("/v1/config", json={"settings": {}})).json()["code"] == 4007
        assert (await client.put("/v1/config", json={"text": MINE})).status_code == 200
    assert text_of(file) == MINE


async def test_robot_without_a_file_refuses_to_write() -> None:
    async with configured(None) as (_, client):
        refused = await client.put("/v1/config", json={"settings": {}})
        assert refused.json()["code"] == 4005


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"text": 3},
        {"settings": []},
        {"text": "", "settings": {}},
        {"text": "", "more": 1},
        {"text": "x" * (MOST_TEXT + 1)},
    ],
)
async def test_invalid_request_is_refused(body: dict[str, Any], file: Path) -> None:
    async with configured(file) as (_, client):
        for answer in (await client.post("/v1/config/check", json=body), await client.put("/v1/config", json=body)):
            assert (answer.status_code, answer.json()["code"]) == (400, 4005)
    assert text_of(file) == MINE


async def test_worker_checks_a_long_text(file: Path) -> None:
    long = template() + "# a remark\n" * 3000
    with staffed(Config()) as staff:
        async with stack(load(file), config_file=file, staff=staff) as robot:
            found = await robot.service.configuring.check(json.dumps({"text": long}).encode())
            assert [one.name for one in found.from_now] == ["geometry.height", "axes.b.jerk_counts", "zones"]
            await robot.service.configuring.write(json.dumps({"text": long}).encode())
    assert text_of(file) == long
