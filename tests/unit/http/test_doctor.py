"""The checks of `maya doctor` over HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest

from maya_un.http.doctor import host
from tests.unit.http.test_teaching import http_client

pytestmark = pytest.mark.usefixtures("folder")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "kept"))
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("MAYA_CONFIG", str(tmp_path / "maya.toml"))
    (tmp_path / "maya.toml").touch()
    return tmp_path


async def findings(client: httpx.AsyncClient, language: str = "en") -> dict[str, dict[str, Any]]:
    """Return what is found by its key."""
    answer = await client.get("/v1/doctor", headers={"Accept-Language": language})
    assert answer.status_code == 200
    return {finding["key"]: finding for finding in answer.json()["findings"]}


async def test_robot_configuration_and_computer_are_checked() -> None:
    async with http_client() as (_, client):
        found = await findings(client)
    checks = {"service", "robot", "limits", "lease", "queue", "configuration", "storage", "disk", "ports", "clock"}
    assert checks <= {finding["check"] for finding in found.values()}
    assert found["robot_well"]["outcome"] == "ok"
    assert {"service_ready"} == {key for key, one in found.items() if one["check"] == "service"}
    assert found["config_good"]["meaning"].endswith("maya.toml is valid.")


async def test_problems_have_a_remedy_in_the_language_of_the_reader(folder: Path) -> None:
    (folder / "maya.toml").write_text("[cell]\ngrasp_hight = 0.4\n")
    async with http_client(homed=False) as (_, client):
        english, spanish = await findings(client), await findings(client, "es")
    bad = english["config_bad"]
    assert (bad["check"], bad["outcome"]) == ("configuration", "fail")
    assert "grasp_hight" in bad["meaning"]
    assert bad["remedy"] == "Correct it, then run `maya config check`."
    assert english["robot_not_homed"]["outcome"] == "warn"
    assert "service_answers" in english
    assert spanish["config_bad"]["remedy"] not in {"", bad["remedy"]}


async def test_check_that_fails_hides_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(host, "disk", broken)
    async with http_client() as (_, client):
        found = await findings(client)
    assert (found["check_failed"]["check"], found["check_failed"]["outcome"]) == ("disk", "fail")
    assert "storage_none" in found
