"""The queue: looked at, paused, reordered, and what becomes of an interrupted job."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal
from urllib.parse import urlencode

from maya_un.client.jobs import JobLike, body_of
from maya_un.client.plans.patience import AT_REST
from maya_un.client.steps import Plan, Request, get, post
from maya_un.process.view import JobLine, QueueView, Recovery


def view() -> Request[QueueView]:
    """Return the queue now, with the first 50 that wait."""
    return get("/v1/queue", QueueView)


def pause(when: Literal["after step", "now"] = "after step") -> Request[QueueView]:
    """Begin nothing more; "now" brakes on the path and holds the step under way too."""
    return Request("POST", "/v1/queue/pause", QueueView, body={"when": when}, timeout=AT_REST)


def resume() -> Request[QueueView]:
    """Go on; raises `AnswerNeeded` while an interrupted job waits for a choice."""
    return post("/v1/queue/resume", QueueView)


def step() -> Request[QueueView]:
    """Do one step and pause."""
    return post("/v1/queue/step", QueueView)


def clear() -> Request[QueueView]:
    """Cancel all jobs that wait, held ones too; what is under way goes on."""
    return post("/v1/queue/clear", QueueView)


def recovery() -> Plan[Recovery | None]:
    """Return the interrupted job that waits for a person, None where there is none."""
    return (yield from view()).recovery


def recover(
    choice: Literal["resume", "redo", "skip", "abort"], *, holding: bool | None = None, resume_queue: bool = True
) -> Request[QueueView]:
    """Say what becomes of the interrupted job, and whether the gripper holds a part, where that matters.

    Raises `AnswerNeeded`, `NotFound` where nothing was interrupted, and what motion raises.
    """
    body: dict[str, Any] = {"choice": choice, "resume_queue": resume_queue}
    if holding is not None:
        body["holding"] = holding
    return Request("POST", "/v1/queue/recovery", QueueView, body=body, timeout=AT_REST)


def hold(job: int) -> Request[JobLine]:
    """Put a job aside that waits; raises `NotFound`, `WrongState`."""
    return post(f"/v1/jobs/{job}/hold", JobLine)


def release(job: int, *, version: str = "") -> Request[JobLine]:
    """Let a job wait for its turn that was held; for a proposal that is the approval.

    `version` is that of the report that was looked at: where the job is another by now it is refused (`JobChanged`).
    """
    path = f"/v1/jobs/{job}/release"
    return post(f"{path}?{urlencode({'version': version})}" if version else path, JobLine)


def move(
    job: int, *, before: int | None = None, after: int | None = None, to: Literal["first", "last"] | None = None
) -> Request[JobLine]:
    """Put a job `before` or `after` another that waits, or `to` "first" or "last"; say one of the three."""
    places: Mapping[str, object] = {"before": before, "after": after, "to": to}
    said = {key: value for key, value in places.items() if value is not None}
    return post(f"/v1/jobs/{job}/move", JobLine, said)


def change(number: int, *, job: JobLike | None = None, **changes: object) -> Request[JobLine]:
    """Change a job that has not begun: its priority, notes, depends_on, on_failure, retries, stepwise, or all of it."""
    body = dict(changes)
    if job is not None:
        body["job"] = body_of(job)
    return Request("PATCH", f"/v1/jobs/{number}", JobLine, body=body)


def again(job: int, *, from_step: int | None = None) -> Request[JobLine]:
    """Queue a job that has ended once more, as a new one, from a step (from 1) on: the first that was not done."""
    body = {} if from_step is None else {"from_step": from_step}
    return post(f"/v1/jobs/{job}/again", JobLine, body)
