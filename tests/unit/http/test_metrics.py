from __future__ import annotations

import asyncio
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families

from maya_un.events import FaultEntered, JobAdvanced, MotionBegun, MotionStopped, StepAdvanced
from maya_un.http.metrics import LOOK, JournalHealth, Metrics
from maya_un.schema.jobs import PauseReason, QueueMode, QueueView
from maya_un.schema.robot import Status
from maya_un.values import Joints, Mode, State
from tests.unit.http.service_stand_in import ServiceStandIn, app_client
from tests.virtual_time import elapse

STATE = State(
    time=1.0,
    mode=Mode.MOVING,
    homed=True,
    counts=(0, 0, 0),
    joints=Joints(0.5, 1.5, 1.6),
    point=None,
    velocity=(0.0, 0.0, 0.0),
    moving=True,
    motors_on=(True, True, True),
    forward_limit=(False, False, False),
    reverse_limit=(False, False, False),
    stop_code=(0, 0, 0),
    gripper_closed=False,
    progress=None,
    fault=None,
    override=0.5,
)
STATUS = Status("0", "sim", 1.0, STATE, None, False, None, (), 7, run=3)
WELL = JournalHealth()
QUEUE = QueueView(QueueMode.PAUSED, PauseReason.STOP, "ana", "", None, (), {"queued": 2, "held": 1}, None, None)


def metric_values(metrics: Metrics, storage: JournalHealth = WELL) -> dict[tuple[str, ...], float]:
    """Return what Prometheus reads: values by name and labels."""
    text = metrics.text(STATUS, QUEUE, storage).decode()
    samples = [sample for family in text_string_to_metric_families(text) for sample in family.samples]
    return {
        (sample.name, *(f"{key}={value}" for key, value in sample.labels.items())): sample.value for sample in samples
    }


def test_state_metrics() -> None:
    found = metric_values(Metrics())
    assert found["maya_mode", "mode=moving"] == 1.0
    assert sum(value for key, value in found.items() if key[0] == "maya_mode") == 1.0
    assert (found["maya_homed",], found["maya_moving",], found["maya_speed_ratio",], found["maya_run",]) == (
        1,
        1,
        0.5,
        3,
    )
    assert [found["maya_joint", f"axis={axis}"] for axis in "abc"] == [0.5, 1.5, 1.6]
    assert found["maya_queue_mode", "mode=paused"] == 1.0
    assert [found["maya_jobs", f"state={state}"] for state in ("queued", "held", "running")] == [2, 1, 0]
    assert found["maya_storage_failing",] == 0.0
    storage = metric_values(Metrics(), JournalHealth("no room", 12))
    assert (storage["maya_storage_failing",], storage["maya_storage_commits",]) == (1.0, 12.0)


def test_events_are_counted() -> None:
    metrics = Metrics()
    events = [
        *(JobAdvanced(1, "sort", state, "ana") for state in ("running", "done")),
        StepAdvanced(1, 1, "home", "done"),
        StepAdvanced(1, 2, "pick cube", "cancelled", code=2201),
        MotionBegun("x"),
        MotionBegun("y"),
        MotionStopped(),
        FaultEntered("stuck", code=2302),
    ]
    for event in events:
        metrics.happened(event)
    found = metric_values(metrics)
    assert found["maya_jobs_ended_total", "state=done"] == 1.0
    assert ("maya_jobs_ended_total", "state=running") not in found
    assert found["maya_steps_ended_total", "state=done"] == found["maya_steps_ended_total", "state=cancelled"] == 1.0
    assert (found["maya_events_total", "kind=moving"], found["maya_events_total", "kind=stopped"]) == (2.0, 1.0)
    assert found["maya_faults_total", "code=2302"] == 1.0


async def test_requests_are_counted_by_the_path_as_declared() -> None:
    service, metrics = ServiceStandIn(), Metrics()
    async with app_client(service, metrics=metrics) as client:
        for number in range(3):
            await client.get(f"/v1/jobs/{number + 1}")
        await client.get("/v1/jobs/seven")
        for number in range(50):
            await client.get(f"/v1/{number}")
        await client.request("BREW", "/v1/status")
    found = metric_values(metrics)
    paths = {key for key in found if key[0] == "maya_http_requests_total"}
    assert paths == {
        ("maya_http_requests_total", "method=GET", "path=/v1/jobs/{job}", "status=200"),
        ("maya_http_requests_total", "method=GET", "path=/v1/jobs/{job}", "status=400"),
        ("maya_http_requests_total", "method=GET", "path=-", "status=404"),
        ("maya_http_requests_total", "method=-", "path=/v1/status", "status=405"),
    }
    assert found["maya_http_requests_total", "method=GET", "path=-", "status=404"] == 50.0
    assert found["maya_http_request_seconds_count", "path=/v1/jobs/{job}"] == 4.0


async def test_a_loop_that_is_late_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    metrics, loop = Metrics(), asyncio.get_running_loop()
    watching = asyncio.create_task(metrics.watch_loop(speed=10.0))
    await elapse(10.0 * LOOK + 1.0)
    clock: Any = loop.time
    monkeypatch.setattr(loop, "time", lambda: clock() + 3.0)  # 0.3 s of a clock ten times as fast
    await elapse(10.0 * LOOK)
    monkeypatch.undo()
    watching.cancel()
    await asyncio.wait({watching})
    found = metric_values(metrics)
    assert found["maya_loop_lag_seconds_bucket", "le=0.0005"] == 1.0
    assert found["maya_loop_lag_seconds_count",] == 2.0
    assert found["maya_loop_lag_seconds_bucket", "le=0.2"] == 1.0
    assert found["maya_loop_lag_seconds_bucket", "le=0.5"] == 2.0


async def test_replies_of_the_controller_are_timed() -> None:
    metrics = Metrics()
    tap = metrics.timer(speed=10.0)
    tap("rx", b"unasked")
    tap("tx", b"TP\r")
    await elapse(0.1)  # 10 ms for a client of a clock ten times as fast
    tap("tx", b"QR\r")
    await elapse(0.05)
    tap("rx", b"1,2,3\r\n:")
    tap("rx", b"the rest")
    found = metric_values(metrics)
    assert found["maya_link_seconds_count",] == 1.0
    assert found["maya_link_seconds_sum",] == pytest.approx(0.015)
