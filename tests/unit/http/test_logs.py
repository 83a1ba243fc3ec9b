"""The log over HTTP."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from maya_un.http import log
from tests.unit.http.test_teaching import http_client


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))
    return tmp_path


async def test_written_lines_are_answered_oldest_first() -> None:
    with log.kept(people=False):
        log.note("http", logging.INFO, "POST /v1/stop 200", who="ada")
        log.note("coms", logging.WARNING, "no answer", code=5001)
    async with http_client() as (_, client):
        first, second = (await client.get("/v1/logs")).json()
        assert (first["kind"], first["level"], first["text"]) == ("http", "info", "POST /v1/stop 200")
        assert first["detail"] == {"who": "ada"}
        assert (second["level"], second["code"]) == ("warning", 5001)
        assert (await client.get("/v1/logs?level=warning")).json() == [second]
        assert (await client.get("/v1/logs?limit=1")).json() == [second]
        assert (await client.get("/v1/logs", params={"since": second["time"]})).json()[-1] == second
        assert (await client.get("/v1/logs?since=2999-01-01")).json() == []


async def test_missing_log_has_no_entries() -> None:
    async with http_client() as (_, client):
        assert (await client.get("/v1/logs")).json() == []


async def test_unreadable_log_is_refused_by_name(folder: Path) -> None:
    (folder / "maya.log").mkdir()
    async with http_client() as (_, client):
        refused = await client.get("/v1/logs")
        assert (refused.status_code, refused.json()["code"]) == (422, 4007)
        assert "maya.log" in refused.json()["detail"]


@pytest.mark.parametrize("query", ["since=soon", "since=0001-01-01", "level=loud", "limit=0", "limit=1001", "follow=1"])
async def test_invalid_query_is_refused(query: str) -> None:
    async with http_client() as (_, client):
        refused = await client.get(f"/v1/logs?{query}")
        assert refused.status_code in {400, 422}
        assert refused.json()["code"] in {4001, 4005}
