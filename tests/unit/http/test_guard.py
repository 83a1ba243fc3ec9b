"""Middleware for every request, HTTP and websockets alike."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.types import Message

from maya_un import __version__
from maya_un.cli.service.listeners import RemoteAccess
from maya_un.errors import Busy, MayaError, TooMuchAsked, WorkerFailed
from maya_un.http import log, middleware
from maya_un.http.origins import OriginPolicy, Rate
from tests.unit.http.service_stand_in import ServiceStandIn, app_client, problem
from tests.virtual_time import elapse

FEW = OriginPolicy(near=Rate(1.0, 3.0), far=Rate(0.5, 1.0), remote=True)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [("GET", "/v1/health", 200), ("GET", "/nowhere", 404), ("PUT", "/v1/stop", 405), ("OPTIONS", "/v1/stop", 204)],
)
async def test_every_answer_has_the_version_and_a_request_id(method: str, path: str, status: int) -> None:
    async with app_client(ServiceStandIn()) as client:
        first, second = [await client.request(method, path) for _ in range(2)]
    assert (first.status_code, first.headers["maya"]) == (status, __version__)
    assert first.headers["maya-request"] != second.headers["maya-request"]


async def test_refusal_by_the_middleware_has_an_id_too() -> None:
    async with app_client(ServiceStandIn()) as client:
        refused = await client.get("/v1/health", headers={"Host": "elsewhere", "Accept-Language": "es"})
    assert (refused.status_code, refused.headers["maya"]) == (403, __version__)
    assert refused.headers["content-language"] == "es"


async def test_throttled_client_waits_and_stop_does_not() -> None:
    service = ServiceStandIn()
    async with app_client(service, edge=FEW) as client:
        answers = [(await client.get("/v1/status")).status_code for _ in range(5)]
        refused = await client.get("/v1/status")
        stops = [(await client.post("/v1/stop")).status_code for _ in range(20)]
        await elapse(float(refused.headers["retry-after"]))
        later = (await client.get("/v1/status")).status_code
    assert answers == [200, 200, 200, 429, 429]
    assert problem(refused)["code"] == 4106
    assert (refused.headers["retry-after"], stops, later) == ("1", [200] * 20, 200)


async def test_other_machines_have_a_measure_of_their_own() -> None:
    service = ServiceStandIn()
    async with app_client(service, edge=FEW, source="192.168.1.7") as client:
        assert [(await client.get("/v1/status")).status_code for _ in range(2)] == [200, 429]
    async with app_client(service, edge=FEW) as client:
        forwarded = {"X-Forwarded-For": "10.0.0.9"}
        assert [(await client.get("/v1/status", headers=forwarded)).status_code for _ in range(2)] == [200, 429]


async def test_files_of_pages_do_not_count_as_requests_and_have_a_limit_of_their_own() -> None:
    edge = OriginPolicy(far=Rate(0.5, 1.0), files=Rate(1.0, 4.0), remote=True)
    async with app_client(ServiceStandIn(), edge=edge, source="192.168.1.7") as client:
        files = ["/", "/assets/app.js", "/queue", "/v2"]
        assert [(await client.get(path)).status_code for path in files] == [404] * 4
        assert [(await client.get("/v1/status")).status_code for _ in range(2)] == [200, 429]
        assert (await client.head("/assets/app.js")).status_code == 429
        assert (await client.post("/assets/app.js")).status_code == 429
        assert (await client.get("/metrics")).status_code == 429


@pytest.mark.parametrize(("clients", "all_served"), [(16, False), (30, True)])
async def test_class_behind_one_address_loads_its_pages_if_it_is_expected(clients: int, all_served: bool) -> None:
    """30 pages ask 15 times each within a second, and load 9 files each."""
    edge = RemoteAccess(listen="0.0.0.0", plain=True, clients=clients).edge()
    async with app_client(ServiceStandIn(), edge=edge, source="192.168.1.7") as client:
        files = {(await client.get("/assets/app.js")).status_code for _ in range(30 * 9)}
        answers: list[int] = []
        for _ in range(15):
            answers += [(await client.get("/v1/status")).status_code for _ in range(30)]
            await elapse(1.0 / 15.0)
    assert files == {404}
    assert (set(answers) == {200}) is all_served


async def test_head_is_get_without_a_body() -> None:
    async with app_client(ServiceStandIn()) as client:
        whole, head = await client.get("/v1/health"), await client.head("/v1/health")
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == str(len(whole.content))


async def test_options_and_a_wrong_method_list_the_allowed_ones() -> None:
    async with app_client(ServiceStandIn()) as client:
        options, wrong = await client.options("/v1/jobs/7"), await client.put("/v1/jobs/7")
        nowhere = await client.options("/v1/nowhere")
    assert options.headers["allow"] == wrong.headers["allow"] == "DELETE, GET, HEAD, OPTIONS, PATCH"
    assert (options.status_code, wrong.status_code, nowhere.status_code) == (204, 405, 404)


PAGE = {"Origin": "http://localhost:3000"}


async def test_a_page_that_may_command_may_read_the_answer() -> None:
    async with app_client(ServiceStandIn(), edge=OriginPolicy(origins=frozenset(PAGE.values()))) as client:
        asked = await client.options("/v1/jobs", headers=PAGE | {"Access-Control-Request-Method": "POST"})
        answer = await client.get("/v1/health", headers=PAGE)
        plain = await client.get("/v1/health")
        stranger = await client.get("/v1/health", headers={"Origin": "https://elsewhere"})
    assert asked.status_code == 204
    assert "Authorization" in asked.headers["access-control-allow-headers"]
    assert answer.headers["access-control-allow-origin"] == PAGE["Origin"]
    assert "Maya" in answer.headers["access-control-expose-headers"]
    assert "access-control-allow-origin" not in plain.headers
    assert (stranger.status_code, "access-control-allow-origin" in stranger.headers) == (403, False)


async def asked_of(app: Any, messages: list[Message], scope: dict[str, Any]) -> list[Message]:
    """Return what an application sends; when its messages are used up, nothing more comes."""
    sent: list[Message] = []

    async def receive() -> Message:
        return messages.pop(0) if messages else await asyncio.Future()

    async def send(message: Message) -> None:
        sent.append(message)

    await app(scope, receive, send)
    return sent


def scope_of(kind: str, path: str, **more: Any) -> dict[str, Any]:
    """Return the scope of a request from this machine."""
    headers = [(b"host", b"localhost"), *more.pop("headers", ())]
    scope = {"type": kind, "path": path, "query_string": b"", "headers": headers, "client": ("127.0.0.1", 1)}
    return {**scope, "method": "POST", "scheme": "http", "server": ("127.0.0.1", 4133), **more}


def application(client: httpx.AsyncClient) -> Any:
    """Return the application behind a client."""
    transport = client._transport
    assert isinstance(transport, httpx.ASGITransport)
    return transport.app


async def test_missing_body_is_not_awaited() -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        beginning: Message = {"type": "http.request", "body": b"{", "more_body": True}
        began = asyncio.get_running_loop().time()
        sent = await asked_of(application(client), [beginning], scope_of("http", "/v1/jobs"))
    assert sent[0]["status"] == 408
    assert asyncio.get_running_loop().time() - began == pytest.approx(middleware.BODY_PATIENCE)
    assert service.asked == []


async def test_incomplete_request_of_a_closed_connection_does_nothing() -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        said: list[Message] = [
            {"type": "http.request", "body": b'{"command": "home"}', "more_body": True},
            {"type": "http.disconnect"},
        ]
        assert await asked_of(application(client), said, scope_of("http", "/v1/tasks")) == []
    assert service.asked == []


@pytest.mark.parametrize("headers", [[(b"origin", b"https://elsewhere")], [(b"host", b"elsewhere")]])
async def test_a_websocket_of_a_stranger_is_refused_before_it_is_one(headers: list[tuple[bytes, bytes]]) -> None:
    async with app_client(ServiceStandIn()) as client:
        scope = scope_of("websocket", "/v1/stream", headers=headers, extensions={"websocket.http.response": {}})
        scope["headers"] = [*headers, *scope["headers"]]
        sent = await asked_of(application(client), [{"type": "websocket.connect"}], scope)
    assert (sent[0]["type"], sent[0]["status"]) == ("websocket.http.response.start", 403)
    assert (b"maya", __version__.encode()) in sent[0]["headers"]


async def test_changes_and_refusals_are_logged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path))
    service = ServiceStandIn()
    with log.kept(people=False):
        async with app_client(service) as client:
            await client.get("/v1/status")
            stop = await client.post("/v1/stop")
            service.error = Busy(doing="x")
            await client.get("/v1/jobs/7")
            await client.post(f"/v1/maya_0123abcd_{'f' * 48}")
    lines = [json.loads(line) for line in log.log_path().read_text().splitlines()]
    assert [(line["method"], line["path"], line["status"], line["code"]) for line in lines] == [
        ("POST", "/v1/stop", 200, 0),
        ("GET", "/v1/jobs/7", 409, 2104),
        ("POST", "/v1/maya_0123abcd_…", 404, 0),
    ]
    assert (lines[0]["request"], lines[0]["who"]) == (stop.headers["maya-request"], "local")
    assert lines[0]["source"] == "127.0.0.1"


@pytest.mark.parametrize(("error", "status"), [(TooMuchAsked(most=4), 429), (WorkerFailed(reason="it ended"), 503)])
async def test_refusal_by_the_worker_has_a_retry_time(error: MayaError, status: int) -> None:
    service = ServiceStandIn()
    service.error = error
    async with app_client(service) as client:
        refused = await client.get("/v1/status")
    assert (refused.status_code, refused.headers["retry-after"]) == (status, "1")
