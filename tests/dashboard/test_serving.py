"""The files of the dashboard over HTTP, without a browser."""

from __future__ import annotations

import gzip
import re

import pytest

from maya_un.dashboard.pages import ASSETS, BROTLI, PAGES, SITE, page_headers
from tests.conventions.source import ROOT
from tests.dashboard.services import Service

ASSET_NAMES = sorted(
    f"/{file.relative_to(SITE).as_posix()}" for file in (SITE / ASSETS).iterdir() if file.suffix != BROTLI
)


def policy_of(headers: dict[str, str]) -> dict[str, set[str]]:
    """Return the sources of each directive of a content security policy."""
    directives = [part.split() for part in headers["content-security-policy"].split(";")]
    return {name: set(sources) for name, *sources in directives}


def test_server_and_page_know_the_same_pages() -> None:
    routes = (ROOT / "web" / "src" / "routes.ts").read_text(encoding="utf-8")
    assert tuple(re.findall(r'\{ path: "([^"]+)"', routes)) == PAGES


@pytest.mark.parametrize("path", PAGES)
def test_a_page_may_run_nothing_but_files_of_this_server(robot_service: Service, path: str) -> None:
    answer = robot_service.request("GET", path)
    assert (answer.status, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    policy = policy_of(answer.headers)
    assert (
        policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == {"'none'"}
    )
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == policy["font-src"] == {"'self'"}
    assert "unsafe" not in answer.headers["content-security-policy"]
    assert answer.headers["cache-control"] == "no-cache"
    assert answer.headers["x-frame-options"] == "DENY"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert answer.headers["cross-origin-opener-policy"] == "same-origin"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert b"<script>" not in answer.body
    assert b"style=" not in answer.body


@pytest.mark.parametrize("path", [*PAGES, "/maya.svg"])
def test_a_file_that_the_browser_has_is_not_sent_again(robot_service: Service, path: str) -> None:
    first = robot_service.request("GET", path)
    again = robot_service.request("GET", path, If_None_Match=first.headers["etag"])
    assert (again.status, again.body) == (304, b"")
    assert again.headers["etag"] == first.headers["etag"]
    assert robot_service.request("GET", path, If_None_Match='"other"').status == 200


@pytest.mark.parametrize(
    ("accepted", "coding"),
    [
        ("", None),
        ("identity", None),
        ("gzip, deflate", "gzip"),
        ("gzip, deflate, br, zstd", "br"),
        ("br;q=0, gzip;q=0.5", "gzip"),
        ("BR; q=1.0", "br"),
        ("brotli, gzip;q=0.0", None),
    ],
)
def test_a_file_has_the_smallest_coding_that_the_client_accepts(
    robot_service: Service, accepted: str, coding: str | None
) -> None:
    answer = robot_service.request("GET", "/maya.svg", Accept_Encoding=accepted)
    assert (answer.headers.get("content-encoding"), answer.headers["vary"]) == (coding, "Accept-Encoding")
    content = (SITE / "maya.svg").read_bytes()
    if coding == "br":
        assert answer.body == (SITE / f"maya.svg{BROTLI}").read_bytes()
    else:
        assert (gzip.decompress(answer.body) if coding else answer.body) == content


def test_codings_of_a_file_have_tags_of_their_own(robot_service: Service) -> None:
    tags = [
        robot_service.request("GET", "/maya.svg", Accept_Encoding=coding).headers["etag"]
        for coding in ("identity", "gzip", "br")
    ]
    assert len(set(tags)) == len(tags)


def test_every_file_but_pictures_and_fonts_has_a_brotli_file(robot_service: Service) -> None:
    for name in ASSET_NAMES:
        if not name.endswith(".woff2"):
            answer = robot_service.request("GET", name, Accept_Encoding="br")
            assert answer.headers["content-encoding"] == "br", name


def test_a_compressed_file_has_no_address_of_its_own(robot_service: Service) -> None:
    assert robot_service.request("GET", f"/maya.svg{BROTLI}").status == 404


@pytest.mark.parametrize("path", ["/", "/maya.svg", ASSET_NAMES[0]])
def test_head_has_the_headers_of_get_and_no_body(robot_service: Service, path: str) -> None:
    got, head = (robot_service.request(method, path) for method in ("GET", "HEAD"))
    assert (head.status, head.body) == (200, b"")
    for name in ("etag", "content-type", "cache-control", "content-length"):
        assert head.headers[name] == got.headers[name]


@pytest.mark.parametrize("path", ["/nothing", "/queue/1", "/v1/nothing", "/assets/nothing.js", "/assets/../pages.py"])
def test_an_unknown_path_is_a_problem(robot_service: Service, path: str) -> None:
    answer = robot_service.request("GET", path)
    assert (answer.status, answer.headers["content-type"]) == (404, "application/problem+json")
    assert answer.json["status"] == 404


def test_a_page_takes_no_other_method(robot_service: Service) -> None:
    assert robot_service.request("POST", "/").status == 405


def test_files_named_by_their_content_are_kept_for_ever(robot_service: Service) -> None:
    for name in ASSET_NAMES:
        answer = robot_service.request("GET", name)
        assert (answer.status, answer.headers["cache-control"]) == (200, "public, max-age=31536000, immutable"), name
        assert re.search(r"-[\w-]{8}\.\w+$", name), name


def test_pictures_may_come_from_the_camera_and_nothing_else_may() -> None:
    without, camera = (
        policy_of({name.lower(): text for name, text in page_headers(url).items()})
        for url in ("", "http://camera.lab:8080/stream?quality=5")
    )
    assert camera["img-src"] - without["img-src"] == {"http://camera.lab:8080"}
    assert {name: sources for name, sources in camera.items() if name != "img-src"} == {
        name: sources for name, sources in without.items() if name != "img-src"
    }


@pytest.mark.parametrize("url", ["javascript:alert(1)", "http://", "no address", "http:///;script-src *"])
def test_an_address_that_is_none_adds_no_source(url: str) -> None:
    assert page_headers(url) == page_headers("")
