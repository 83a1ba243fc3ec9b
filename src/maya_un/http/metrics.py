"""Metrics for Prometheus: counts of events, durations, states. No label is unbounded."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import NamedTuple

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, disable_created_metrics
from prometheus_client.exposition import CONTENT_TYPE_LATEST, generate_latest

from maya_un.axes import AXES
from maya_un.errors import by_code
from maya_un.events import Event, FaultEntered, JobAdvanced, StepAdvanced
from maya_un.schema.jobs import QueueMode, QueueView, TaskState
from maya_un.schema.robot import Status
from maya_un.values import Mode

CONTENT_TYPE = CONTENT_TYPE_LATEST
"""The content type of `Metrics.text`."""

LOOK = 0.1
"""Period of the measurement of the loop's lag [s, real time]."""

_FAST = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)
_SLOW = (*_FAST, 20.0, 60.0)
_ENDED = frozenset(state.value for state in TaskState if state.ended)


class JournalHealth(NamedTuple):
    """State of the journal: the reason why it cannot be written, "" if it can, and the number of commits."""

    failing: str = ""
    commits: int = 0


class Metrics:
    """Metrics of one server; any thread may count."""

    def __init__(self) -> None:
        disable_created_metrics()  # a date for every count, which no one needs
        self._registry = registry = CollectorRegistry()
        requests = ("method", "path", "status")
        self._requests = Counter("maya_http_requests", "Requests answered", requests, registry=registry)
        self._times = Histogram(
            "maya_http_request_seconds", "Time to answer", ("path",), buckets=_SLOW, registry=registry
        )
        self._jobs = Counter("maya_jobs_ended", "Jobs that ended, by how", ("state",), registry=registry)
        self._steps = Counter("maya_steps_ended", "Steps that ended, by how", ("state",), registry=registry)
        self._events = Counter(
            "maya_events", "Events, by kind (moving: motions; stopped: stops)", ("kind",), registry=registry
        )
        self._faults = Counter("maya_faults", "Faults, by code", ("code",), registry=registry)
        self._lag = Histogram(
            "maya_loop_lag_seconds", "How late the robot's loop does what is due", buckets=_FAST, registry=registry
        )
        self._link = Histogram(
            "maya_link_seconds", "Time from a command to the controller's reply", buckets=_FAST, registry=registry
        )
        self.streams = Gauge("maya_stream_clients", "Websockets that read the stream", registry=registry)
        self._prepare_state(registry)

    def _prepare_state(self, registry: CollectorRegistry) -> None:
        self._mode = Gauge("maya_mode", "1 for the mode that the controller is in", ("mode",), registry=registry)
        self._homed = Gauge("maya_homed", "1 where the position is known", registry=registry)
        self._moving = Gauge("maya_moving", "1 while an axis moves", registry=registry)
        self._override = Gauge("maya_speed_ratio", "Factor on the speed of all motion", registry=registry)
        self._joints = Gauge("maya_joint", "Joints: a in rad, b and c in m", ("axis",), registry=registry)
        self._queue = Gauge("maya_queue_mode", "1 for the mode that the queue is in", ("mode",), registry=registry)
        self._waiting = Gauge("maya_jobs", "Jobs that have not ended, by state", ("state",), registry=registry)
        self._commits = Gauge("maya_storage_commits", "Commits of the journal in this run", registry=registry)
        self._storage = Gauge("maya_storage_failing", "1 while the journal cannot be written", registry=registry)
        self._run = Gauge("maya_run", "How often this program was started on its journal", registry=registry)

    def answered(self, method: str, path: str, status: int, seconds: float) -> None:
        """Count an answered request; `path` is the declared path of its route."""
        self._requests.labels(method, path, str(status)).inc()
        self._times.labels(path).observe(seconds)

    def happened(self, event: Event) -> None:
        """Count an event."""
        self._events.labels(event.kind).inc()
        match event:
            case JobAdvanced(state=state) if state in _ENDED:
                self._jobs.labels(state).inc()
            case StepAdvanced(state=state) if state in _ENDED:
                self._steps.labels(state).inc()
            case FaultEntered(code=code):
                self._faults.labels(str(code if code in by_code() else 0)).inc()
            case _:
                pass

    def timer(self, speed: float) -> Callable[[str, bytes], None]:
        """Return a tap of the link that measures reply times; the clock of the running loop is `speed` times real time.

        Of several commands without a reply, the first is timed.
        """
        clock = asyncio.get_running_loop().time
        sent: float | None = None

        def tap(way: str, _: bytes) -> None:
            nonlocal sent
            if way == "tx":
                sent = clock() if sent is None else sent
            elif sent is not None:
                self._link.observe((clock() - sent) / speed)
                sent = None

        return tap

    async def watch_loop(self, speed: float) -> None:
        """Measure the lag of the running loop, whose clock is `speed` times real time, until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            due = loop.time() + LOOK * speed
            await asyncio.sleep(LOOK * speed)
            self._lag.observe(max(0.0, loop.time() - due) / speed)

    def text(self, status: Status, queue: QueueView, storage: JournalHealth) -> bytes:
        """Return all metrics in the text format of Prometheus."""
        state = status.state
        _one_of(self._mode, tuple(Mode), state.mode)
        self._homed.set(state.homed)
        self._moving.set(state.moving)
        self._override.set(state.override)
        for number, axis in enumerate(AXES):
            self._joints.labels(axis).set(float("nan") if state.joints is None else state.joints[number])
        _one_of(self._queue, tuple(QueueMode), queue.mode)
        self._set_jobs(queue.counts)
        self._commits.set(storage.commits)
        self._storage.set(bool(storage.failing))
        self._run.set(status.run)
        return generate_latest(self._registry)

    def _set_jobs(self, counts: Mapping[str, int]) -> None:
        for state in TaskState:
            if not state.ended:
                self._waiting.labels(state.value).set(counts.get(state.value, 0))


def _one_of(gauge: Gauge, names: tuple[str, ...], now: str) -> None:
    for name in names:
        gauge.labels(str(name)).set(name == now)
