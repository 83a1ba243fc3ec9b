"""The HTTP interface, asked by a client in the same loop; the service behind it is a stand-in."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from maya_un.errors import Busy, CannotPause, InvalidJob, LinkLost, MayaError, NotFound, NotPaused, Unreachable
from maya_un.events import FaultEntered, HomingBegun, HomingDone
from maya_un.http.bridge import Bridge
from maya_un.http.middleware import BODY_LIMIT
from maya_un.process.journal.protocol import Filter
from maya_un.service.access.operations import LOCAL, Caller
from maya_un.values import Point
from tests.unit.http.service_stand_in import ServiceStandIn, app_client, problem
from tests.virtual_time import elapse


@pytest.mark.parametrize(
    ("method", "path", "body", "asked", "status"),
    [
        ("GET", "/v1/status", None, ("status",), 200),
        ("POST", "/v1/jobs", {"steps": ["home"]}, ("submit", {"steps": ["home"]}), 202),
        ("GET", "/v1/jobs", None, ("page", Filter()), 200),
        ("GET", "/v1/jobs/7", None, ("job", 7), 200),
        ("DELETE", "/v1/jobs/7", None, ("cancel", 7), 200),
        ("POST", "/v1/preview", {"steps": []}, ("preview", {"steps": []}), 200),
        ("POST", "/v1/tasks", {"command": "home"}, ("command", {"command": "home"}, False), 202),
        ("POST", "/v1/jog", {"axis": "b", "distance": 1}, ("jog", "b", 1.0, 1.0, True), 200),
        (
            "POST",
            "/v1/jog",
            {"axis": "x", "distance": -0.5, "speed": 0.2, "clip": False},
            ("jog", "x", -0.5, 0.2, False),
            200,
        ),
        ("POST", "/v1/jog", {"axis": "z", "direction": -1, "hold": True}, ("jog_hold", "z", -1, 1.0, None), 200),
        (
            "POST",
            "/v1/jog",
            {"axis": "r", "direction": 1, "hold": True, "press": "7"},
            ("jog_hold", "r", 1, 1.0, "7"),
            200,
        ),
        (
            "POST",
            "/v1/jog",
            {"vector": [0.3, 0, -0.4], "hold": True, "press": "7"},
            ("jog_vector", (0.3, 0.0, -0.4), "7"),
            200,
        ),
        ("POST", "/v1/jog", {"vector": [1, 0, 0], "hold": False}, ("jog_release", None), 200),
        ("POST", "/v1/jog", {"hold": False}, ("jog_release", None), 200),
        ("POST", "/v1/jog", {"hold": False, "press": "7"}, ("jog_release", "7"), 200),
        ("POST", "/v1/jog", {"axis": "z", "direction": -1, "hold": False}, ("jog_release", None), 200),
        (
            "POST",
            "/v1/jog",
            {"axis": "nowhere", "direction": None, "hold": False, "speed": 7},
            ("jog_release", None),
            200,
        ),
        ("POST", "/v1/pause", None, ("pause",), 200),
        ("POST", "/v1/resume", None, ("resume",), 200),
        ("POST", "/v1/speed", {"ratio": 0.5}, ("speed", 0.5), 200),
        ("POST", "/v1/stop", None, ("stop",), 200),
        ("POST", "/v1/abort", None, ("abort",), 200),
        ("POST", "/v1/recover", None, ("recover",), 200),
        ("POST", "/v1/recover?take_over=true", None, ("recover", "take over"), 200),
    ],
)
async def test_each_path_asks_the_service_one_thing(
    method: str, path: str, body: object, asked: tuple[object, ...], status: int
) -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        response = await client.request(method, path, json=body)
    assert (response.status_code, service.asked) == (status, [asked])


@pytest.mark.parametrize(("method", "path"), [("DELETE", "/v1/users/"), ("PATCH", "/v1/users/"), ("POST", "/v1/jobs/")])
async def test_the_path_of_an_empty_name_is_refused(method: str, path: str) -> None:
    async with app_client(ServiceStandIn()) as client:
        response = await client.request(method, path)
    assert (response.status_code, response.json()["code"]) == (404, 4005)


async def test_an_option_of_a_submission_is_refused_by_name() -> None:
    async with app_client(ServiceStandIn()) as client:
        response = await client.post("/v1/jobs?notes=a%07", json={"steps": ["home"]})
    assert response.status_code == 400
    assert response.json()["details"] == {"key": "query.notes", "reason": "it must be printable"}


async def test_stop_answers_how_long_and_how_far() -> None:
    async with app_client(ServiceStandIn()) as client:
        answer = (await client.post("/v1/stop")).json()
    assert answer == {"was_moving": True, "duration": 0.5, "distance": [0.0, 0.01, 0.02], "job": None}


async def test_stop_is_served_while_a_command_waits() -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        waiting = asyncio.create_task(client.post("/v1/tasks?wait=true", json={"command": "home"}))
        response = await client.post("/v1/stop")
        assert response.status_code == 200 and not waiting.done()
        service.released.set()
        assert (await waiting).json() == {"waited": True}


async def test_events_are_given_by_number() -> None:
    service = ServiceStandIn()
    service.log.emit(HomingBegun())
    service.log.emit(FaultEntered("stuck", code=2302, more={"axis": "b"}))
    async with app_client(service) as client:
        events = (await client.get("/v1/events?since=1")).json()
    assert events == [
        {"seq": 2, "time": 0.0, "kind": "fault", "code": 2302, "detail": {"message": "stuck", "axis": "b"}}
    ]


@pytest.mark.parametrize(("run", "numbers"), [(3, [1, 2]), (2, [])])
async def test_events_are_those_of_a_run(run: int, numbers: list[int]) -> None:
    service = ServiceStandIn()
    service.log.emit(HomingBegun())
    service.log.emit(HomingDone())
    async with app_client(service) as client:
        events = (await client.get(f"/v1/events?run={run}&wait=1")).json()
        first = (await client.get("/v1/events?limit=1")).json()
    assert [event["seq"] for event in events] == numbers
    assert [event["seq"] for event in first] == [1]


async def test_a_patient_client_gets_the_next_event() -> None:
    service = ServiceStandIn()
    asyncio.get_running_loop().call_later(3.0, service.log.emit, HomingDone())
    async with app_client(service) as client:
        events = (await client.get("/v1/events?since=0&wait=10")).json()
    assert [event["kind"] for event in events] == ["homed"]


async def test_patience_ends() -> None:
    async with app_client(ServiceStandIn()) as client:
        assert (await client.get("/v1/events?wait=10")).json() == []
    await elapse(0.0)  # the word that nobody waits any more travels from one loop to the other


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (NotFound(what="job", number=7), 404),
        (Busy(doing="job 1"), 409),
        (CannotPause(reason="nothing is under way"), 409),
        (NotPaused(), 409),
        (InvalidJob(key="steps", reason="it is empty"), 422),
        (Unreachable(target="x", reason="y", nearest="z", nearest_point=Point(1.0, 2.0, float("nan"))), 422),
        (LinkLost(address="there", reason="cut"), 503),
    ],
)
async def test_an_error_keeps_its_code_words_and_details(error: MayaError, status: int) -> None:
    service = ServiceStandIn()
    service.error = error
    async with app_client(service) as client:
        body = problem(await client.get("/v1/jobs/7"))
    assert (body["status"], body["code"], body["detail"]) == (status, error.code, str(error))
    assert body["details"].keys() == error.details.keys()


async def test_an_error_speaks_the_clients_language() -> None:
    service = ServiceStandIn()
    service.error = Busy(doing="x")
    async with app_client(service) as client:
        body = problem(await client.get("/v1/status", headers={"Accept-Language": "es-CO"}))
    assert body["detail"] == service.error.text("es")


async def test_unexpected_error_is_one_sentence(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    service = ServiceStandIn()
    service.error = ZeroDivisionError("surprise")
    async with app_client(service) as client:
        body = problem(await client.get("/v1/status"))
    assert (body["status"], body["code"]) == (500, 5999)
    assert "surprise" in (tmp_path / "maya" / "maya.log").read_text()


@pytest.mark.parametrize(
    ("path", "content"),
    [
        ("/v1/jobs", b"{"),
        ("/v1/jobs", b""),
        ("/v1/jobs", b"[1, 2]"),
        ("/v1/jobs", b'"home"'),
        ("/v1/jobs", b'{"repeat": NaN}'),
        ("/v1/jobs", b'{"repeat": -Infinity}'),
        ("/v1/tasks", b'{"a": ' * 100_000),
        ("/v1/tasks", b"\xff\xfe\x00"),
        ("/v1/tasks", b'{"command": "\\ud800"}'),
        ("/v1/tasks", b'{"command": "home", "\\udfff": 1}'),
        ("/v1/tasks", b'{"command": "gripper", "command": "home"}'),
        ("/v1/jog", b"{}"),
        ("/v1/jog", b'{"axis": "a", "distance": 1, "speed": 2}'),
        ("/v1/jog", b'{"axis": 3, "distance": 1}'),
        ("/v1/jog", b'{"axis": "a", "distance": true}'),
        ("/v1/jog", b'{"vector": [1, 0], "hold": true}'),
        ("/v1/jog", b'{"vector": [1, 0, "far"], "hold": true}'),
        ("/v1/jog", b'{"vector": [2, 0, 0], "hold": true}'),
        ("/v1/jog", b'{"vector": [NaN, 0, 0], "hold": true}'),
        ("/v1/jog", b'{"vector": [1, 0, 0]}'),
        ("/v1/jog", b'{"vector": [1, 0, 0], "axis": "x", "hold": true}'),
        ("/v1/jog", b'{"axis": "a", "distance": "far"}'),
        ("/v1/jog", b'{"axis": "a", "distance": 1, "speed": 0}'),
        ("/v1/jog", b'{"axis": "a", "distance": 1, "speed": 1e-99}'),
        ("/v1/jog", b'{"axis": "a", "distance": 1, "clip": 1}'),
        ("/v1/jog", b'{"axis": "a", "distance": 1e999}'),
        ("/v1/jog", b'{"axis": "a", "hold": true}'),
        ("/v1/jog", b'{"axis": "a", "direction": 2, "hold": true}'),
        ("/v1/jog", b'{"axis": "a", "direction": true, "hold": true}'),
        ("/v1/jog", b'{"axis": "a", "direction": 1, "hold": 1}'),
        ("/v1/jog", b'{"axis": "a", "direction": 1, "distance": 1, "hold": true}'),
        ("/v1/speed", b"{}"),
        ("/v1/speed", b'{"ratio": "50%"}'),
        ("/v1/speed", b'{"ratio": 0.5, "speed": 1}'),
    ],
)
async def test_a_bad_body_is_refused_and_never_reaches_the_service(path: str, content: bytes) -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        body = problem(await client.post(path, content=content))
    assert body["code"] in {4001, 4005}
    assert service.asked == []


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/", 404),
        ("GET", "/v2/status", 404),
        ("GET", "/v1/jobs/seven", 400),
        ("PUT", "/v1/status", 405),
        ("GET", "/v1/events?since=-1", 400),
        ("GET", "/v1/events?since=x", 400),
        ("GET", "/v1/events?wait=nan", 400),
        ("GET", "/v1/events?wait=1e9", 400),
        ("POST", "/v1/tasks?wait=perhaps", 400),
    ],
)
async def test_unknown_paths_and_values_are_refused(method: str, path: str, status: int) -> None:
    async with app_client(ServiceStandIn()) as client:
        content = b'{"command": "home"}' if method == "POST" else None
        body = problem(await client.request(method, path, content=content))
    assert (body["status"], body["code"]) == (status, 4005)


async def test_a_body_too_long_is_refused() -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        body = problem(await client.post("/v1/jobs", content=json.dumps({"name": "x" * BODY_LIMIT})))
    assert body["status"] == 413
    assert service.asked == []


_BRACKETS = [{"Host": "[::1"}, {"Origin": "http://[::1"}]


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "maya.example.org"},
        {"Host": "127.0.0.1.example.org"},
        {"Origin": "https://example.org"},
        {"Origin": "http://127.0.0.1:8000"},
        *_BRACKETS,
    ],
)
async def test_only_this_machine_may_command(headers: dict[str, str]) -> None:
    service = ServiceStandIn()
    async with app_client(service) as client:
        assert problem(await client.post("/v1/stop", headers=headers))["status"] == 403
    assert service.asked == []


@pytest.mark.parametrize("name", ["localhost", "127.0.0.1:80", "[::1]:4133"])
async def test_every_name_of_loopback_is_accepted(name: str) -> None:
    async with app_client(ServiceStandIn()) as client:
        response = await client.get("/v1/health", headers={"Host": name, "Origin": f"http://{name}"})
    assert response.status_code == 200


async def test_addresses_for_other_computers_are_those_of_the_listener() -> None:
    async with app_client(ServiceStandIn(), addresses=("https://lab:4134", "https://192.0.2.7:4134")) as client:
        assert (await client.get("/v1/addresses")).json() == {"remote": ["https://lab:4134", "https://192.0.2.7:4134"]}
    async with app_client(ServiceStandIn()) as client:
        assert (await client.get("/v1/addresses")).json() == {"remote": []}


@pytest.mark.parametrize(
    ("method", "path", "body", "code"),
    [
        ("POST", "/v1/tasks", {"command": "home"}, 2201),
        ("POST", "/v1/jobs", {"steps": ["home"]}, 2201),
        ("POST", "/v1/jog", {"axis": "b", "distance": 1}, 2201),
        ("GET", "/v1/status", None, 0),
        ("POST", "/v1/stop", None, 0),
        ("DELETE", "/v1/jobs/7", None, 0),
    ],
)
async def test_request_whose_caller_was_identified_during_a_stop_moves_nothing(
    method: str, path: str, body: object, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = ServiceStandIn()

    async def identified(*_: object, **__: object) -> Caller:
        service.stops += 1
        return LOCAL

    monkeypatch.setattr(Bridge, "caller", identified)
    async with app_client(service) as client:
        response = await client.request(method, path, json=body)
    if code:
        assert problem(response)["code"] == code
    assert bool(service.asked) == (code == 0)
