"""Texts of users, pages of other sites, and tokens: nothing of them may do or say more than it should."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import product
from typing import Any
from urllib.parse import quote

import pytest

from maya_un.dashboard.pages import PAGES
from tests.dashboard.services import PASSWORD, Service
from tests.dashboard.tabs import ELSEWHERE, Tab
from tests.waiting import eventually

EVIL = "<img src=x onerror=window.caught=1>{{7*7}}"
"""A name that would load a picture, run a script and compute, if it were not shown as it is."""

NOTES = f"<script>window.caught=1</script>{EVIL}"

SHOWN = ("/history?job={job}", "/queue")
"""Addresses that show the name of a job."""


@pytest.fixture
def named(robot: Service) -> Iterator[int]:
    """Return a job that waits, whose name and notes are evil; so are other names, as far as they are accepted."""
    robot.ask("POST /v1/queue/pause", {"when": "now"})
    name, notes = quote(EVIL, safe=""), quote(NOTES, safe="")
    job = {"name": EVIL, "parts": {"cube": [0.41, 1.13]}, "steps": [{"gripper": "open"}]}
    number = robot.ask(f"POST /v1/jobs?notes={notes}", job)["id"]
    for kind, body in (("poses", None), ("zones", {"kind": "box", "low": [0.1, 1.0, 0.0], "high": [0.2, 1.1, 0.1]})):
        robot.refused(f"PUT /v1/{kind}/{name}", body)
    robot.refused("POST /v1/users", {"name": EVIL, "role": "viewer"})
    yield number
    robot.ask(f"DELETE /v1/jobs/{number}")
    robot.ask("POST /v1/queue/resume")


def inert(tab: Tab, where: str) -> None:
    """Fail if a text of a user became an element, or ran."""
    assert tab.get("window.caught ?? null") is None, where
    assert tab.get("document.querySelectorAll('img[src=x], main script').length") == 0, where
    assert "49" not in tab.get("[...document.querySelectorAll('b, td, h2, h3')].map((one) => one.innerText)"), where


@pytest.mark.parametrize("path", PAGES)
def test_texts_of_users_are_shown_as_they_are(named: int, bare_tab: Tab, path: str) -> None:
    for address in [path, *(one.format(job=named) for one in SHOWN if one.startswith(f"{path}?"))]:
        bare_tab.open(address)
        inert(bare_tab, address)
        if path == "/history":
            bare_tab.until(f"document.querySelector('main').innerText.includes({EVIL!r})")
            inert(bare_tab, address)


@pytest.fixture(scope="module")
def empty_page() -> Iterator[int]:
    """Return the port of this machine at which another server has an empty page."""

    class Empty(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><link rel=icon href=data:,><h1>elsewhere</h1>")

        def log_message(self, format: str, *args: Any) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Empty)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.server_port
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture(params=[ELSEWHERE, "127.0.0.1"])
def foreign(request: pytest.FixtureRequest, empty_page: int, tab_of: Callable[..., Tab], robot: Service) -> Tab:
    """Return a tab with a page of another origin: another site, or another port of this machine."""
    tab = tab_of(robot)
    tab.forgive("")
    tab.leave()
    tab.page.goto(f"http://{request.param}:{empty_page}")
    return tab


REQUESTS = {
    "POST /v1/stop": "",
    "POST /v1/abort": "",
    "POST /v1/tasks": '{"command": "home"}',
    "POST /v1/jog": '{"axis": "a", "direction": 1, "distance": 0.1}',
    "POST /v1/queue/pause": '{"when": "now"}',
}


KINDS = ("text/plain", "application/x-www-form-urlencoded", "application/json")
"""Kinds of contents; a browser asks first whether it may send the last one."""


def test_a_page_of_another_origin_can_neither_stop_nor_move(robot: Service, foreign: Tab) -> None:
    robot.begin_motion()
    since = robot.newest
    for kind, (request, body) in product(KINDS, REQUESTS.items()):
        method, path = request.split()
        sent = foreign.page.evaluate(
            """async ([url, method, body, kind]) => {
                const mode = kind.includes('json') ? 'cors' : 'no-cors';
                const request = { method, body, mode, headers: { 'Content-Type': kind } };
                return await fetch(url, request).then((answer) => answer.type, () => 'failed');
            }""",
            [robot.url + path, method, body, kind],
        )
        assert sent == ("failed" if "json" in kind else "opaque"), request
    assert robot.state["moving"]
    events = robot.ask(f"GET /v1/events?since={since}")
    assert [event for event in events if event["kind"] in {"stopped", "job", "queue", "aborted"}] == []


def test_a_page_of_another_origin_gets_no_stream(robot: Service, foreign: Tab) -> None:
    heard = foreign.page.evaluate(
        """(url) => new Promise((done) => {
            const socket = new WebSocket(url.replace('http', 'ws') + '/v1/stream');
            socket.onmessage = () => done('heard');
            socket.onclose = () => done('closed');
        })""",
        robot.url,
    )
    assert heard == "closed"


def test_a_page_of_another_origin_can_neither_read_nor_frame(robot: Service, foreign: Tab) -> None:
    read = "(url) => fetch(url + '/v1/status').then((got) => got.text(), () => 'failed')"
    assert foreign.page.evaluate(read, robot.url) == "failed"
    frame = "(url) => { document.body.append(Object.assign(document.createElement('iframe'), { src: url })) }"
    foreign.page.evaluate(frame, f"{robot.url}/")
    framed = "chrome-error:"
    eventually(lambda: foreign.get("true") and foreign.page.frames[-1].url.startswith(framed), "an empty frame", 30.0)


@pytest.mark.parametrize("foreign", [ELSEWHERE], indirect=True)
def test_a_name_that_is_bent_to_this_machine_gets_no_page(robot: Service, foreign: Tab) -> None:
    answer = foreign.page.goto(f"http://{ELSEWHERE}:{robot.port}/")
    assert answer is not None
    assert answer.status == 403


def test_the_token_is_in_no_address_and_in_no_file(guarded: Service, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(guarded, worker=True)
    tab.page.goto(guarded.url)
    tab.sign_in("root", PASSWORD)
    token = tab.get("sessionStorage['maya.token']")
    assert token.startswith("maya_")
    for path in PAGES:
        tab.open(path)
    tab.page.click("button.stop >> visible=true")
    tab.until("document.querySelector('[data-stopped]').innerText.includes('at rest')")
    assert tab.get("Object.values(localStorage).join() + document.cookie").find(token) < 0
    assert [url for url in tab.addresses if token in url or PASSWORD in url] == []
    audit = str(guarded.ask("GET /v1/audit"))
    assert "root" in audit
    assert token not in audit
    files = [file for file in guarded.folder.rglob("*") if file.is_file()]
    assert [file.name for file in files if file.suffix in {".log", ".db"}], files
    assert [file for file in files if token.encode() in file.read_bytes()] == []


def test_signing_in_with_a_wrong_password_says_why(guarded: Service, tab_of: Callable[..., Tab]) -> None:
    tab = tab_of(guarded)
    tab.forgive("status of 401", "status of 403", "status of 429")
    tab.page.goto(guarded.url)
    tab.page.fill("dialog input[autocomplete=username]", "root")
    tab.page.fill("dialog input[type=password]", "wrong")
    tab.page.click("dialog button[type=submit]")
    tab.until("document.querySelector('dialog [role=alert]')")
    assert tab.get("sessionStorage.length") == 0
