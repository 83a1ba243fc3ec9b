"""Routes of jobs: submit, list, show, cancel and preview them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Depends, Header, Query, Response

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
from maya_un.http.exchange import JobNumber, answer, as_json, sent_as_written, sent_long
from maya_un.http.openapi import job_schema, task_schema, text_schema
from maya_un.http.request_context import Ask
from maya_un.http.routing import AT_REST, LONGEST_MOTION, Routes
from maya_un.process.journal.protocol import (
    Dependencies,
    FailureAction,
    Filter,
    JobOptions,
    Notes,
    Priority,
    Retries,
)
from maya_un.schema.choices import OnFailure
from maya_un.schema.encoding import MOST
from maya_un.schema.jobs import JobAccepted, JobLine, JobReport, TaskState
from maya_un.schema.previews import ExampleJob, JobInspection, JobPreview, JobText, ParsedJob
from maya_un.service.access.operations import Operation
from maya_un.service.previews import MOST_SAMPLES


async def _options(
    priority: Annotated[Priority, Query(description="a job of higher priority starts first")] = 0,
    held: Annotated[bool, Query(description="the job waits until it is released")] = False,
    depends_on: Annotated[
        Dependencies, Query(description="number of a job that must be done first; may be repeated")
    ] = (),
    notes: Annotated[Notes, Query()] = "",
    on_failure: Annotated[
        FailureAction, Query(description="action of the queue if the job fails")
    ] = OnFailure.CONTINUE,
    retries: Annotated[Retries, Query(description="number of retries of a step that is safe to repeat")] = 0,
    stepwise: Annotated[bool, Query(description="pause the queue after each step")] = False,
) -> JobOptions:
    return JobOptions(priority, held, depends_on, notes, on_failure, retries, stepwise)


SubmitOptions = Annotated[JobOptions, Depends(_options)]
"""The options in a request's query."""

IdempotencyKey = Annotated[
    str,
    Header(
        alias="Idempotency-Key",
        max_length=200,
        description="a repeated request with the same key returns the existing job",
    ),
]
"""The idempotency key of a request, "" without one."""


async def _filter(
    state: Annotated[list[TaskState], Query(max_length=20, description="state of the jobs; may be repeated")] = [],  # noqa: B006
    owner: Annotated[str | None, Query(max_length=200, description="name of the owner")] = None,
    text: Annotated[str, Query(max_length=200, description="text in the name or the notes")] = "",
    below: Annotated[int | None, Query(ge=0, le=MOST, description="only entries with a lower number")] = None,
    above: Annotated[int | None, Query(ge=0, le=MOST, description="only events with a higher number")] = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="greatest number of entries")] = 100,
    order: Literal["newest", "oldest"] = "newest",
) -> Filter:
    return Filter(tuple(state), owner, text, below, above, order == "oldest", limit)


Which = Annotated[Filter, Depends(_filter)]
"""The filter in a request's query."""


_TAG = "jobs"

JobBody = Annotated[dict[str, Any] | bytes, sent_long(job_schema)]
TextBody = Annotated[dict[str, Any] | bytes, sent_long(text_schema)]
TaskBody = Annotated[dict[str, Any], sent_as_written(task_schema)]

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
    """Add the routes that submit, list, show and cancel jobs."""

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
        """Append a job to the queue. The job is on the disk before the response."""
        accepted = ask(lambda service: service.submit(job, by=ask.caller, options=options, key=key))
        return answer(await accepted, 202)

    @routes.add("GET", "/v1/jobs", Operation.READ, tag=_TAG, gives=list[JobLine], client="history.page")
    async def jobs(ask: Ask, which: Which) -> Response:
        """Return a page of jobs, newest first by default, ended jobs included.

        Filter by `state`, `owner`, `text` in the name or notes, and job number (`below`, `above`).
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
        """Return the body with which a job was submitted: a job or a single primitive."""
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
        """Cancel a job.

        If it runs, the robot stops on its path, and the response comes when the robot is at rest.
        """
        return answer(await ask(lambda service: service.cancel(job, by=ask.caller)))


def add_previews(routes: Routes) -> None:
    """Add the routes that preview and inspect a job."""

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
        """Preview a job without motion.

        Return the duration and the heights of each step, and the error of the first step that cannot be done.
        """
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
        """Preview a job in detail without motion.

        Return the profiles of the axes, the least margins and the longest stopping time. `samples` is the number of
        samples per motion (default 200).
        """
        told = ask.unless_left(lambda service: service.previews.inspect(job, samples=samples, by=ask.caller))
        return as_json(await told)


def add_texts(routes: Routes) -> None:
    """Add the routes that translate a job between YAML and JSON, and that of the examples."""

    @routes.add(
        "GET",
        "/v1/examples",
        Operation.READ,
        tag=_TAG,
        gives=list[ExampleJob],
        refuses=_WORKED_OUT,
        client="examples",
    )
    async def examples(ask: Ask) -> Response:
        """Return the example jobs, with their title and description in every language and their text (YAML)."""
        return answer(await ask.unless_left(lambda service: service.previews.examples(ask.caller)))

    @routes.add(
        "POST",
        "/v1/jobs/parse",
        Operation.PREVIEW,
        tag=_TAG,
        gives=ParsedJob,
        refuses=_WORKED_OUT,
        examples={"a job in YAML": {"text": "steps:\n  - pick: [0.5, 1.1]\n"}},
        client="parse",
    )
    async def parse(ask: Ask, text: TextBody) -> Response:
        """Parse the text of a job (YAML).

        Return the job as JSON, or the first mistake with its line and column.
        """
        return answer(await ask.unless_left(lambda service: service.previews.parse(text, ask.caller)))

    @routes.add(
        "POST",
        "/v1/jobs/format",
        Operation.PREVIEW,
        tag=_TAG,
        gives=JobText,
        refuses=(InvalidJob, *_WORKED_OUT),
        examples=_JOBS,
        client="format",
    )
    async def format_job(ask: Ask, job: JobBody) -> Response:
        """Return a job as YAML text."""
        return answer(await ask.unless_left(lambda service: service.previews.format(job, ask.caller)))


def add_tasks(routes: Routes) -> None:
    """Add the route of single primitives."""

    @routes.add(
        "POST",
        "/v1/tasks",
        Operation.COMMAND,
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

        With `wait`, the response comes when the job has ended; this needs the control lease.
        """
        operations = (Operation.COMMAND,) if wait else _SUBMITTING
        told = ask(
            lambda service: service.command(primitive, wait=wait, by=ask.caller, options=options, key=key), *operations
        )
        if not wait:
            return answer(await told, 202)
        return answer(await ask.while_allowed(told, Operation.COMMAND))
