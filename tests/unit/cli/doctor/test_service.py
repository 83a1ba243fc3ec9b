"""Requests to the running service, and reports about one that cannot answer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest

from maya_un import __version__, runtime
from maya_un.cli.doctor import service
from maya_un.schema.diagnosis import FindingOutcome
from tests.ports import free_port
from tests.unit.cli.servers import hanging_service, http_service

STATE: dict[str, Any] = {
    "mode": "idle",
    "homed": True,
    "fault": None,
    "forward_limit": [False] * 3,
    "reverse_limit": [False] * 3,
}
ANSWERS: dict[str, Any] = {
    "/v1/health": {"status": "ok"},
    "/v1/ready": {"ready": True, "reasons": []},
    "/v1/status": {"version": __version__, "address": "sim", "state": STATE},
    "/v1/datum": {"needed": False},
    "/v1/lease": {"holder": "", "since": 0.0},
    "/v1/queue": {"mode": "running", "reason": "", "counts": {}, "recovery": None},
}


@pytest.fixture(autouse=True)
def claim() -> Iterator[None]:
    with runtime.claimed():
        yield


def published(url: str) -> None:
    runtime.publish(runtime.Running(url, os.getpid(), None))


def keys(changes: dict[str, Any], *, ours: bool = True) -> dict[str, FindingOutcome]:
    """Return what is found of a service that answers otherwise than a healthy one in this."""

    def says(_: str, path: str, __: object) -> tuple[int, object]:
        answer = (ANSWERS | changes)[path]
        return answer if isinstance(answer, tuple) else (200, answer)

    with http_service(says, ours=ours) as url:
        published(url)
        running, trouble = service.found("en")
        findings = trouble if running is None else [*running.findings()]
        return {finding.key: finding.outcome for finding in findings}


def state(**changes: object) -> dict[str, Any]:
    return {"/v1/status": {"version": __version__, "address": "sim", "state": STATE | changes}}


def test_missing_service_is_no_problem() -> None:
    running, (finding,) = service.found("en")
    assert (running, finding.key, finding.outcome) == (None, "service_none", FindingOutcome.SKIPPED)


def test_one_that_is_well_is_well_in_everything() -> None:
    found = keys({})
    assert set(found.values()) == {FindingOutcome.OK}
    assert {"service_runs", "service_ready", "version_same", "robot_well", "limits_quiet", "lease_free"} <= found.keys()
    assert "queue_runs" in found


@pytest.mark.parametrize(
    ("changes", "key", "outcome"),
    [
        (
            {"/v1/ready": (503, {"reasons": [{"code": 5007, "message": "disk"}]})},
            "service_not_ready",
            FindingOutcome.FAIL,
        ),
        (
            {"/v1/status": {"version": "0.0.1", "address": "sim", "state": STATE}},
            "version_differs",
            FindingOutcome.WARN,
        ),
        (state(mode="disconnected"), "robot_disconnected", FindingOutcome.FAIL),
        (state(fault={"code": 2306, "message": "off"}), "robot_fault", FindingOutcome.FAIL),
        (state(homed=False), "robot_not_homed", FindingOutcome.WARN),
        ({**state(homed=False), "/v1/datum": {"needed": True}}, "robot_without_datum", FindingOutcome.WARN),
        (state(forward_limit=[False, True, False]), "limits_active", FindingOutcome.WARN),
        (state(forward_limit=[True] * 3, reverse_limit=[False, False, True]), "limits_both", FindingOutcome.FAIL),
        ({"/v1/lease": {"holder": "ada", "since": 5.0}}, "lease_held", FindingOutcome.OK),
        (
            {"/v1/queue": {"mode": "paused", "reason": "stop", "counts": {"queued": 3}, "recovery": None}},
            "queue_paused",
            FindingOutcome.WARN,
        ),
        ({"/v1/queue": {"mode": "paused", "recovery": {"job": 7}}}, "queue_asks", FindingOutcome.WARN),
        ({"/v1/status": (401, {"code": 4101, "details": {"reason": "none"}})}, "service_refuses", FindingOutcome.WARN),
    ],
)
def test_problems_are_reported(changes: dict[str, Any], key: str, outcome: FindingOutcome) -> None:
    assert keys(changes)[key] is outcome


@pytest.mark.parametrize("changes", [state(fault={"code": 2306, "message": "off"}), state(homed=False)])
def test_a_service_whose_robot_cannot_move_only_answers(changes: dict[str, Any]) -> None:
    found = keys(changes)
    assert found["service_answers"] is FindingOutcome.OK
    assert "service_ready" not in found


def test_one_that_is_gone_hangs_or_was_replaced_by_a_stranger(monkeypatch: pytest.MonkeyPatch) -> None:
    assert keys({}, ours=False) == {"service_stranger": FindingOutcome.FAIL}
    published(f"http://127.0.0.1:{free_port()}")
    assert service.found("en")[1][0].key == "service_gone"
    monkeypatch.setattr(service, "PATIENCE", 0.1)
    with hanging_service() as url:
        published(url)
        assert service.found("en")[1][0].key == "service_hangs"
