"""Operations on the queue that take more than one request, or a job."""

from __future__ import annotations

from typing import TYPE_CHECKING

from maya_un.client import requests
from maya_un.client.jobs import JobLike, body_of
from maya_un.client.request import Request
from maya_un.client.steps import Plan

if TYPE_CHECKING:
    from maya_un.schema.jobs import JobLine, Recovery


def recovery() -> Plan[Recovery | None]:
    """Return the interrupted job that waits for a person, None where there is none."""
    return (yield from requests.queue()).recovery


def change(number: int, *, job: JobLike | None = None, **changes: object) -> Request[JobLine]:
    """Change a job that has not begun: its priority, notes, depends_on, on_failure, retries, stepwise, or all of it."""
    return requests.change_job(number, changes if job is None else {**changes, "job": body_of(job)})
