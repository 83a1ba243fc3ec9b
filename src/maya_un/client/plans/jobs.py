"""Jobs from their submission to their end, and the reasons why a job waits."""

from __future__ import annotations

import secrets
import warnings
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypedDict, Unpack

from maya_un.client import requests
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.request import TIMEOUT
from maya_un.client.steps import Emit, Plan, ReadClock, StreamPlan, persistently
from maya_un.errors import EventsForgotten
from maya_un.schema.jobs import JobAccepted, JobLine, JobReport, QueueMode, TaskState


class StillWaiting(UserWarning):
    """The request waits until a person acts."""


def remark(report: JobReport, said: str) -> Plan[str]:
    """Warn if a job cannot continue without a person, unless the reason is `said`; return the current reason or ""."""
    reason = yield from _reason(report)
    if reason and reason != said:
        warnings.warn(f"Job {report.id} waits: {reason}", StillWaiting, stacklevel=2)
    return reason


def _reason(report: JobReport) -> Plan[str]:
    match report.state:
        case TaskState.HELD:
            return "it is held until a user releases it."
        case TaskState.INTERRUPTED:
            return "it was interrupted; decide how it continues (queue.recovery, queue.recover)."
        case TaskState.QUEUED | TaskState.PAUSED:
            return (yield from _before_it())
        case _:
            return ""


def _before_it() -> Plan[str]:
    queue = yield from requests.queue()
    if queue.mode is QueueMode.PAUSED:
        return f"the queue is paused ({queue.reason}); queue.resume() continues it."
    lease = yield from requests.lease()
    if lease.holder and not lease.yours and not lease.implicit:
        return f"{lease.holder} drives the robot."
    return ""


PAGE = 100
"""Jobs per page."""

LOOK = 2.0
"""Longest wait for events in one request [s, real time]."""


class Submitted(NamedTuple):
    """An accepted job, and the number of the newest event before its submission."""

    job: JobAccepted
    since: int


class SubmitOptions(TypedDict, total=False):
    """Options of a job in the queue.

    Jobs with greater `priority` run first. A `held` job waits until it is released. A job starts after
    all jobs of `depends_on` are done. `on_failure` is the reaction of the queue to a failure. `retries` is the number
    of repetitions of a failed step, where repeating is safe. `stepwise` pauses the queue after every step.
    """

    priority: int
    held: bool
    depends_on: Sequence[int]
    notes: str
    on_failure: Literal["continue", "pause"]
    retries: int
    stepwise: bool


def every(*, state: Sequence[str] = (), owner: str | None = None, text: str | None = None) -> StreamPlan[JobLine]:
    """Yield all jobs, newest first; they are read page by page."""
    below = None
    while True:
        lines = yield from requests.jobs(state=state, owner=owner, text=text or "", below=below, limit=PAGE)
        for line in lines:
            yield Emit(line)
        if len(lines) < PAGE:
            return
        below = lines[-1].id


def submit(job: JobLike, *, key: str = "", **options: Unpack[SubmitOptions]) -> Plan[Submitted]:
    """Append a job to the queue exactly once, even if the connection breaks meanwhile."""
    since = (yield from persistently(requests.status())).last_event
    request = requests.submit(body_of(job), key=key or new_key(), **options)
    return Submitted((yield from persistently(request)), since)


def new_key() -> str:
    """Return a new idempotency key."""
    return secrets.token_urlsafe(18)


def known(number: int) -> Plan[JobAccepted]:
    """Return the number, name and steps of a job; raises `NotFound`."""
    found = yield from requests.report(number)
    return JobAccepted(found.id, found.name, len(found.steps))


def wait(number: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait until a job has ended, and return its report.

    Ctrl-C ends the waiting, but not the job. Raises `TimeoutError` after `timeout` [s, real time], and
    `NotFound` if there is no such job.
    """
    since = (yield from persistently(requests.status())).last_event
    return (yield from ended(number, since, timeout))


def ended(number: int, since: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait for the end of a job and return its report; `since` is the number of an event before its next change."""
    begun = yield from ReadClock()
    said = ""
    while True:
        found = yield from persistently(requests.report(number))
        if found.state.ended:
            return found
        said = yield from remark(found, said)
        news = False
        while not news:
            left = LOOK if timeout is None else begun + timeout - (yield from ReadClock())
            if left <= 0.0:
                raise TimeoutError(f"job {number} is {found.state} after {timeout} s")
            since, news = yield from _news(number, since, min(left, LOOK))


def progress(number: int) -> StreamPlan[JobReport]:
    """Yield the report of a job now, and after each change of its state or of a step's state, until its end."""
    since = (yield from persistently(requests.status())).last_event
    shown: object = None
    while True:
        found = yield from persistently(requests.report(number))
        stage = (found.state, *(step.state for step in found.steps))
        if stage != shown:
            yield Emit(found)
        if found.state.ended:
            return
        shown = stage
        news = False
        while not news:
            since, news = yield from _news(number, since, LOOK)


def _news(number: int, since: int, patience: float) -> Plan[tuple[int, bool]]:
    """Return the number of the newest event, and whether an event after `since` concerns a job.

    An empty answer also counts as news, since the service may have been restarted meanwhile.
    """
    look = requests.events(since=since, wait=patience).within(patience + TIMEOUT)
    try:
        events = yield from persistently(look)
    except EventsForgotten:
        return (yield from persistently(requests.status())).last_event, True
    if not events:
        return since, True
    return events[-1].seq, any(event.kind in {"job", "step"} and event.detail.get("job") == number for event in events)
