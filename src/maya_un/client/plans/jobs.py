"""Jobs from their submission to their end."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, TypedDict, Unpack, cast

from maya_un.api.messages import EventMessage, JobAccepted
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.plans.asking import status
from maya_un.client.plans.patience import AT_REST, persistently
from maya_un.client.plans.waiting import remark
from maya_un.client.steps import TIMEOUT, Clock, Item, Plan, Request, Source, get
from maya_un.errors import EventsForgotten
from maya_un.process.report import JobReport

LOOK = 2.0
"""A question for news is answered after so long that there are none [s, real time]."""


class Submitted(NamedTuple):
    """A job that the service took, and the number of the newest event before that."""

    job: JobAccepted
    since: int


class SubmitOptions(TypedDict, total=False):
    """How a job is to be queued.

    The greater `priority` (-100 to 100) goes first. With `held` it waits for somebody to release it. It begins after
    all jobs of `depends_on` are done. `on_failure` is what the queue does if it fails, `retries` how often a step that
    failed is tried again where that is harmless; `stepwise` pauses the queue after every step.
    """

    priority: int
    held: bool
    depends_on: Sequence[int]
    notes: str
    on_failure: Literal["continue", "pause"]
    retries: int
    stepwise: bool


def submit(job: JobLike, *, key: str = "", **options: Unpack[SubmitOptions]) -> Plan[Submitted]:
    """Append a job to the queue, once, however often the connection breaks meanwhile."""
    said = cast("dict[str, Any]", options)
    query = {name: tuple(value) if name == "depends_on" else value for name, value in said.items()}
    since = (yield from persistently(status())).last_event
    wish = Request("POST", "/v1/jobs", JobAccepted, query, body_of(job), key=key or new_key())
    return Submitted((yield from persistently(wish)), since)


def new_key() -> str:
    """Return an idempotency key that nobody has used."""
    return secrets.token_urlsafe(18)


def report(number: int) -> Request[JobReport]:
    """Return what is known of a job now; raises `NotFound`."""
    return get(f"/v1/jobs/{number}", JobReport)


def known(number: int) -> Plan[JobAccepted]:
    """Return what is needed of a job to ask about it; raises `NotFound`."""
    found = yield from report(number)
    return JobAccepted(found.id, found.name, len(found.steps))


def cancel(number: int) -> Request[JobReport]:
    """End a job early; one that runs stops on its path. Returns when it is at rest; raises `NotFound`."""
    return Request("DELETE", f"/v1/jobs/{number}", JobReport, timeout=AT_REST)


def wait(number: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait until a job has ended, and return its report.

    Ctrl-C ends the waiting and leaves the job alone. Raises `TimeoutError` after `timeout` [s, real time], `NotFound`.
    """
    since = (yield from persistently(status())).last_event
    return (yield from ended(number, since, timeout))


def ended(number: int, since: int, timeout: float | None = None) -> Plan[JobReport]:
    """Wait for the end of a job of which nothing before the event `since` is news."""
    begun = yield from Clock()
    said = ""
    while True:
        found = yield from persistently(report(number))
        if found.state.ended:
            return found
        said = yield from remark(found, said)
        news = False
        while not news:
            left = LOOK if timeout is None else begun + timeout - (yield from Clock())
            if left <= 0.0:
                raise TimeoutError(f"job {number} is {found.state} after {timeout} s")
            since, news = yield from _news(number, since, min(left, LOOK))


def progress(number: int) -> Source[JobReport]:
    """Yield the report of a job now, and again whenever one of its steps or the job itself goes on, to its end."""
    since = (yield from persistently(status())).last_event
    shown: object = None
    while True:
        found = yield from persistently(report(number))
        stage = (found.state, *(step.state for step in found.steps))
        if stage != shown:
            yield Item(found)
        if found.state.ended:
            return
        shown = stage
        news = False
        while not news:
            since, news = yield from _news(number, since, LOOK)


def _news(number: int, since: int, patience: float) -> Plan[tuple[int, bool]]:
    """Return the number of the newest event, and whether any since the last is about a job.

    Without any event at all that is taken for news, since the service may have been started anew meanwhile.
    """
    look = get("/v1/events", list[EventMessage], patience + TIMEOUT, since=since, wait=patience)
    try:
        events = yield from persistently(look)
    except EventsForgotten:
        return (yield from persistently(status())).last_event, True
    if not events:
        return since, True
    return events[-1].seq, any(event.kind in {"job", "step"} and event.detail.get("job") == number for event in events)
