"""Why a job does not begin, said to whoever waits for it."""

from __future__ import annotations

import warnings

from maya_un.client import requests
from maya_un.client.steps import Plan
from maya_un.schema.jobs import JobReport, QueueMode
from maya_un.schema.states import TaskState


class StillWaiting(UserWarning):
    """The request waits until a person acts."""


def remark(report: JobReport, said: str) -> Plan[str]:
    """Warn where a job that is waited for cannot go on by itself, unless that was `said`; return what was said last."""
    reason = yield from _reason(report)
    if reason and reason != said:
        warnings.warn(f"Job {report.id} waits: {reason}", StillWaiting, stacklevel=2)
    return reason


def _reason(report: JobReport) -> Plan[str]:
    match report.state:
        case TaskState.HELD:
            return "it is held, for somebody to release it."
        case TaskState.INTERRUPTED:
            return "it was interrupted, and somebody has to say what becomes of it (queue.recovery, queue.recover)."
        case TaskState.QUEUED | TaskState.PAUSED:
            return (yield from _before_it())
        case _:
            return ""


def _before_it() -> Plan[str]:
    queue = yield from requests.queue()
    if queue.mode is QueueMode.PAUSED:
        return f"the queue is paused ({queue.reason}); queue.resume() lets it go on."
    lease = yield from requests.lease()
    if lease.holder and not lease.yours and not lease.implicit:
        return f"{lease.holder} drives the robot."
    return ""
