"""The paths of jobs: submitted, listed, told of, cancelled, and worked out beforehand."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import Query, Response

from maya_un.api.access.operations import Operation
from maya_un.api.previews import MOST_SAMPLES
from maya_un.errors import (
    Faulted,
    InvalidJob,
    KeyReused,
    NotConnected,
    NotFound,
    TakesTooLong,
    TooLarge,
    TooMuchAsked,
    UnknownName,
    WorkerFailed,
)
from maya_un.schema.jobs import JobAccepted, JobLine, JobReport
from maya_un.schema.previews import JobInspection, JobPreview
from maya_un.server.asking import Ask
from maya_un.server.exchange import answer, as_json, sent_as_written, sent_long
from maya_un.server.numbers import JobNumber
from maya_un.server.options import IdempotencyKey, SubmitOptions, Which
from maya_un.server.routes import AT_REST, LONGEST_MOTION, Routes
from maya_un.server.schemas import JOB, TASK

_TAG = "jobs"

JobBody = Annotated[dict[str, Any] | bytes, sent_long(JOB)]
TaskBody = Annotated[dict[str, Any], sent_as_written(TASK)]

_JOBS = {
    "one cube": {
        "name": "one cube",
        "parts": {"cube": [0.5, 1.1]},
        "places": {"tray": [1.1, 0.5]},
        "steps": ["home", {"pick": "cube"}, {"place": "tray"}],
    }
}
_TASKS = {
    "home": {"command": "home"},
    "pick": {"command": "pick", "target": [0.5, 1.1]},
    "a cell": {"command": "place", "target": "tray[1,2]"},
    "joints": {"command": "move", "joints": [0.5, 1.5, 1.6]},
    "gripper": {"command": "gripper", "open": True},
}
_REFUSED = (InvalidJob, UnknownName)
_WORKED_OUT = (TooMuchAsked, TakesTooLong, TooLarge, WorkerFailed)
_BOUNDED = (*_REFUSED, *_WORKED_OUT)
_NOT_TAKEN = (*_REFUSED, KeyReused, NotConnected, Faulted)
_SUBMITTING = (Operation.SUBMIT, Operation.PROPOSE)


def add_jobs(routes: Routes) -> None:
    """Add the paths."""

    @routes.add(
        "POST",
        "/v1/jobs",
        *_SUBMITTING,
        tag=_TAG,
        gives=JobAccepted,
        status=202,
        refuses=(*_NOT_TAKEN, *_WORKED_OUT),
        examples=_JOBS,
    )
    async def submit(ask: Ask, job: JobBody, options: SubmitOptions, key: IdempotencyKey = "") -> Response:
        """Append a job to the queue; it is stored when the answer comes."""
        accepted = ask(lambda service: service.submit(job, by=ask.caller, options=options, key=key))
        return answer(await accepted, 202)

    @routes.add("GET", "/v1/jobs", Operation.READ, tag=_TAG, gives=list[JobLine], client="history.page")
    async def jobs(ask: Ask, which: Which) -> Response:
        """Return a page of jobs, including those that ended long ago: newest first by default.

        Filter by states, owner, words in the name or notes, and numbers `below` and `above`.
        """
        return answer(await ask(lambda service: service.history.page(which)))

    @routes.add(
        "GET",
        "/v1/jobs/{job}",
        Operation.READ,
        tag=_TAG,
        gives=JobReport,
        refuses=(NotFound, *_WORKED_OUT),
        client="report",
    )
    async def report(ask: Ask, job: JobNumber) -> Response:
        """Return the report of a job, step by step."""
        return answer(await ask(lambda service: service.job(job)))

    @routes.add(
        "GET",
        "/v1/jobs/{job}/body",
        Operation.READ,
        tag=_TAG,
        gives=dict[str, Any],
        refuses=(NotFound,),
        client="history.body",
    )
    async def job_body(ask: Ask, job: JobNumber) -> Response:
        """Return a job as it was submitted, or the primitive that it is."""
        return answer(await ask(lambda service: service.history.body(job)))

    @routes.add(
        "DELETE",
        "/v1/jobs/{job}",
        Operation.CANCEL,
        Operation.PROPOSE,
        tag=_TAG,
        gives=JobReport,
        refuses=(NotFound,),
        client="cancel",
        patience=AT_REST,
    )
    async def cancel(ask: Ask, job: JobNumber) -> Response:
        """Cancel a job; a running job stops on its path. The answer comes when it is at rest."""
        return answer(await ask(lambda service: service.cancel(job, by=ask.caller)))


def add_previews(routes: Routes) -> None:
    """Add the paths that tell what a job would be."""

    @routes.add(
        "POST",
        "/v1/preview",
        Operation.PREVIEW,
        tag=_TAG,
        gives=JobPreview,
        refuses=_BOUNDED,
        examples=_JOBS,
        patience=AT_REST,
    )
    async def preview(ask: Ask, job: JobBody) -> Response:
        """Return what a job would do, step by step: times, heights, and the first refusal; nothing moves."""
        return as_json(await ask.unless_left(lambda service: service.previews.preview(job, by=ask.caller)))

    @routes.add(
        "POST",
        "/v1/inspect",
        Operation.PREVIEW,
        tag=_TAG,
        gives=JobInspection,
        refuses=_BOUNDED,
        examples=_JOBS,
        patience=AT_REST,
    )
    async def inspect(ask: Ask, job: JobBody, samples: Annotated[int, Query(ge=2, le=MOST_SAMPLES)] = 200) -> Response:
        """Return what a job would do in detail: profiles of the axes, least margins, the longest stop; nothing moves.

        Each motion has so many `samples`.
        """
        told = ask.unless_left(lambda service: service.previews.inspect(job, samples=samples, by=ask.caller))
        return as_json(await told)


def add_tasks(routes: Routes) -> None:
    """Add the path of single primitives."""

    @routes.add(
        "POST",
        "/v1/tasks",
        Operation.WISH,
        *_SUBMITTING,
        tag=_TAG,
        gives=JobReport,
        status=202,
        also=(200,),
        refuses=_NOT_TAKEN,
        examples=_TASKS,
        patience=LONGEST_MOTION,
    )
    async def task(
        ask: Ask, primitive: TaskBody, options: SubmitOptions, wait: bool = False, key: IdempotencyKey = ""
    ) -> Response:
        """Append a primitive to the queue as a job of one step.

        With `wait`, which needs the control lease, the answer comes when it has ended.
        """
        operations = (Operation.WISH,) if wait else _SUBMITTING
        told = ask(
            lambda service: service.wish(primitive, wait=wait, by=ask.caller, options=options, key=key), *operations
        )
        if not wait:
            return answer(await told, 202)
        return answer(await ask.while_allowed(told, Operation.WISH))
