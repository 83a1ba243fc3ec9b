"""The files of the dashboard as they are served: types, headers, compression."""

from __future__ import annotations

import re

import httpx
import pytest
from fastapi import FastAPI

from maya_un.dashboard.pages import BROTLI, PAGES, SITE, add_dashboard

OPENER = "cross-origin-opener-policy"


def dashboard(base: str = "http://localhost") -> httpx.AsyncClient:
    app = FastAPI()
    add_dashboard(app)
    return httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url=base)


@pytest.mark.parametrize("page", PAGES)
async def test_page_may_run_its_own_scripts_only(page: str) -> None:
    async with dashboard() as client:
        answer = await client.get(page)
    policy = dict(one.split(" ", 1) for one in answer.headers["content-security-policy"].split("; "))
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == policy["worker-src"] == policy["connect-src"] == "'self'"
    assert answer.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize("base", ["http://localhost:4133", "http://127.0.0.1:4133", "https://lab:4134"])
async def test_trusted_origin_gets_the_opener_policy(base: str) -> None:
    async with dashboard(base) as client:
        assert (await client.get("/")).headers[OPENER] == "same-origin"


async def test_plain_http_from_elsewhere_gets_no_opener_policy() -> None:
    async with dashboard("http://192.0.2.7:4134") as client:
        assert OPENER not in (await client.get("/")).headers


async def test_worker_keeps_files_that_are_served_and_nothing_of_the_interface() -> None:
    async with dashboard() as client:
        worker = await client.get("/worker.js")
        kept = re.findall(r'"(/[^"]*)"', worker.text.partition("BUILD=")[0])
        missing = [path for path in kept if (await client.get(path)).status_code != 200]
    assert worker.headers["content-type"].startswith("text/javascript")
    assert worker.headers["cache-control"] == "no-cache"
    assert "/" in kept
    assert not missing
    assert len(kept) == sum(file.is_file() and file.suffix != BROTLI for file in SITE.rglob("*")) - 1
    assert not [path for path in kept if path.startswith("/v1")]


async def test_icons_of_the_app_are_pictures_of_their_size() -> None:
    async with dashboard() as client:
        icons = (await client.get("/maya.webmanifest")).json()["icons"]
        for icon in icons:
            picture = await client.get(icon["src"])
            assert picture.headers["content-type"] == icon["type"]
            if icon["type"] == "image/png":
                width, height = (int.from_bytes(picture.content[at : at + 4]) for at in (16, 20))
                assert icon["sizes"] == f"{width}x{height}"
