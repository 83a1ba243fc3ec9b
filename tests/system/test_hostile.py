"""Hostile requests while the robot moves: stop comes at once, and the guard has no reason to stop the axes."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

import pytest

from maya_un.assembly.controller import Twin
from tests.campaign import Campaign
from tests.costly_requests import (
    ANSWERS,
    HARMLESS,
    KINDS,
    CostlyClients,
    CostlyRequest,
    costly_clients,
    prepared,
    send_request,
)
from tests.system.processes import Process, Wire, running
from tests.system.test_watchdog import mark, served
from tests.waiting import eventually

pytestmark = [pytest.mark.system, pytest.mark.timeout(900)]

JOB = {"steps": [{"approach": [0.5, 0.9, 0.5]}, {"approach": [0.9, 0.3, 0.5]}] * 5}
STOP = CostlyRequest("POST", "/v1/stop")


def port_of(up: Process) -> int:
    """Return the port of a Maya that prints its URL."""
    return int(up.until("Service:").rpartition(":")[2])


def status(port: int) -> dict[str, Any]:
    """Return how the robot stands."""
    return json.loads(send_request(port, CostlyRequest("GET", "/v1/status"))[1])


def wait_until(port: int, holds: Callable[[dict[str, Any]], bool]) -> None:
    """Wait until a status is as it should be."""
    eventually(lambda: holds(status(port)), "a status as it should be", 60.0, lambda: str(status(port)))


def set_moving(port: int) -> None:
    """Have a slow job begin, once the robot is at rest, and return when it moves."""
    wait_until(
        port, lambda now: now["state"]["mode"] == "idle" and all(job["state"] != "running" for job in now["jobs"])
    )
    for path in ("/v1/queue/clear", "/v1/queue/resume"):
        assert send_request(port, CostlyRequest("POST", path))[0] == 200
    assert send_request(port, CostlyRequest("POST", "/v1/jobs", json.dumps(JOB).encode()))[0] == 202
    wait_until(port, lambda now: now["state"]["moving"])


@contextmanager
def stops_received(twin: Twin) -> Iterator[list[float]]:
    """Yield the instants of every ST that comes to the twin, as they come [s, monotonic]."""
    heard: list[float] = []

    def tap(_letter: str, way: str, data: bytes) -> None:
        if way == "rx" and b"ST" in data:
            heard.append(time.monotonic())

    twin.controller.tap = tap
    try:
        yield heard
    finally:
        twin.controller.tap = None


def time_to_stop(port: int, twin: Twin) -> float:
    """Say stop; return when it was on the wire [s from then on]."""
    with stops_received(twin) as heard:
        asked = time.monotonic()
        assert send_request(port, STOP)[0] == 200
        return min((at for at in heard if at >= asked), default=inf) - asked


def usually(port: int, twin: Twin) -> float:
    """Return the time to stop on this machine now, during requests that are long but harmless [s]."""
    times: list[float] = []
    for _ in range(3):
        set_moving(port)
        with costly_clients(port, HARMLESS, 12) as crowd:
            while crowd.left > 6:
                status(port)
            times.append(time_to_stop(port, twin))
    return max(times)


def require_answered(port: int, name: str, request: CostlyRequest, crowd: CostlyClients) -> None:
    """Check that hostile requests were answered, each as it should be, or given up by their senders."""
    assert not crowd.dropped, name
    assert set(crowd.statuses) <= ANSWERS, (name, crowd.statuses)
    assert send_request(port, request)[0] in ANSWERS, name


def test_costly_requests_in_motion_delay_no_stop_and_trip_no_watchdog(campaign: Campaign) -> None:
    """The time that a stop may take is measured first, for other tests run on this machine."""
    count = campaign.size(ci=6, long=100)
    found: dict[str, float] = {}
    answers: dict[str, CostlyClients] = {}
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        with running(f"up --port 0 --journal memory --skip-home --address {address}") as up:
            port = port_of(up)
            send_request(port, CostlyRequest("POST", "/v1/speed", b'{"ratio": 0.05}'))
            allowed = 0.25 + 4.0 * usually(port, twin)
            for name in KINDS:
                set_moving(port)
                request = prepared(port, name)
                with costly_clients(port, request, count) as crowd:
                    while crowd.left > count // 2:
                        assert status(port)["state"]["fault"] is None, name
                    assert status(port)["state"]["moving"], name
                    found[name] = time_to_stop(port, twin)
                assert status(port)["state"]["fault"] is None, name
                require_answered(port, name, request, crowd)
                answers[name] = crowd
    for name, late in found.items():
        crowd = answers[name]
        print(f"{name}: stop {late * 1e3:.1f} ms, answers {dict(crowd.statuses)}, given up {crowd.given_up}")
    late = {name: time for name, time in found.items() if time > allowed}
    assert not late, f"allowed {allowed:.3f} s, {late}"


def test_heavy_jobs_that_wait_delay_no_stop_after_a_restart(tmp_path: Path) -> None:
    journal = tmp_path / "maya.db"
    line = f"up --port 0 --journal {journal} --skip-home --address"
    body = KINDS["preview of lines"].body
    with served(seed=5) as (twin, address), Wire(address) as wire:
        mark(twin, wire)
        with running(f"{line} {address}") as up:
            port = port_of(up)
            send_request(port, CostlyRequest("POST", "/v1/queue/pause"))
            for _ in range(10):
                assert send_request(port, CostlyRequest("POST", "/v1/jobs", body))[0] == 202
            up.send(signal.SIGKILL)
            up.end()
        with running(f"{line} {address}") as up:
            port = port_of(up)
            times = [time_to_stop(port, twin) for _ in range(10)]
            assert status(port)["state"]["fault"] is None
    assert max(times) <= 1.0 and median(times) <= 0.25, times
