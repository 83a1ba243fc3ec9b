"""Routes of the queue: show, pause and reorder it, and decide about interrupted jobs."""

from __future__ import annotations

from collections.abc import Awaitable
from typing import Annotated, Any

from fastapi import Query, Response

from maya_un.errors import (
    AnswerNeeded,
    CannotPause,
    Faulted,
    InvalidJob,
    JobChanged,
    KeyReused,
    NotConnected,
    NotFound,
    NotHomed,
    PathRefused,
    UnknownName,
    Unreachable,
    WrongState,
)
from maya_un.http.exchange import JobNumber, answer, sent, sent_as_written
from maya_un.http.openapi import changes_schema
from maya_un.http.request_context import Ask
from maya_un.http.routes.jobs import IdempotencyKey
from maya_un.http.routing import AT_REST, Routes
from maya_un.schema.bodies import Again, Answering, Moving, Pausing, Recovering
from maya_un.schema.jobs import JobLine, QueueView, Recovery
from maya_un.service.access.operations import Operation
from maya_un.service.service import Service

_QUEUE = "queue"
_JOBS = "jobs"
_CHANGING = (Operation.CHANGE_JOB, Operation.PROPOSE)
_NO_SUCH = (NotFound, WrongState)

PausingBody = Annotated[Pausing, sent(Pausing, optional=True)]
RecoveringBody = Annotated[Recovering, sent(Recovering)]
AnsweringBody = Annotated[Answering, sent(Answering)]
MovingBody = Annotated[Moving, sent(Moving)]
AgainBody = Annotated[Again, sent(Again, optional=True)]
Version = Annotated[
    str, Query(max_length=64, description="version in the report of the job; another version is left as it is")
]
ChangesBody = Annotated[dict[str, Any], sent_as_written(changes_schema)]


def add_queue(routes: Routes) -> None:
    """Add the routes that show, pause, resume, step and clear the queue."""

    @routes.add("GET", "/v1/queue", Operation.READ, tag=_QUEUE, gives=QueueView, client="queue.view")
    async def queue(ask: Ask) -> Response:
        """Return the queue now, with the first 50 waiting jobs."""
        return answer(await ask(_view))

    waits = {"after the running step": {"when": "after step"}, "now": {"when": "now"}}

    @routes.add(
        "POST",
        "/v1/queue/pause",
        Operation.PAUSE,
        tag=_QUEUE,
        gives=QueueView,
        refuses=(CannotPause,),
        examples=waits,
        client="queue.pause",
        patience=AT_REST,
    )
    async def pause_queue(ask: Ask, body: PausingBody) -> Response:
        """Pause the queue after the running step.

        With `when` "now", brake on the path and pause the running step too.
        """
        return answer(await ask(lambda service: service.queue.pause(ask.caller, when=body.when)))

    @routes.add(
        "POST",
        "/v1/queue/resume",
        Operation.RESUME,
        tag=_QUEUE,
        gives=QueueView,
        refuses=(AnswerNeeded,),
        client="queue.resume",
    )
    async def resume_queue(ask: Ask) -> Response:
        """Resume the queue and the paused step.

        Refused (4015 AnswerNeeded) while an interrupted job waits for a decision.
        """
        return answer(await ask(lambda service: service.queue.resume(ask.caller)))

    @routes.add(
        "POST",
        "/v1/queue/step",
        Operation.STEP,
        tag=_QUEUE,
        gives=QueueView,
        refuses=(AnswerNeeded,),
        client="queue.step",
    )
    async def step_queue(ask: Ask) -> Response:
        """Carry out one step, then pause.

        Refused (4015 AnswerNeeded) while an interrupted job waits for a decision.
        """
        return answer(await ask(lambda service: service.queue.step(ask.caller)))

    @routes.add(
        "POST",
        "/v1/queue/answer",
        Operation.RESUME,
        tag=_QUEUE,
        gives=QueueView,
        refuses=(NotFound,),
        examples={"go on": {"answer": "continue", "job": 12, "index": 3}, "end the job": {"answer": "cancel"}},
        client="queue.answer",
    )
    async def answer_question(ask: Ask, body: AnsweringBody) -> Response:
        """Answer the question of the running job with one of its choices; the choice `cancel` ends the job.

        Send `job` and `index` of the question that was read: if another one is open now, or none, the error is 4004
        NotFound.
        """

        async def answered(service: Service) -> QueueView:
            return await service.queue.answer(body.answer, body.job, body.index, by=ask.caller)

        return answer(await ask(answered))

    @routes.add(
        "POST", "/v1/queue/clear", Operation.CLEAR, tag=_QUEUE, gives=QueueView, client="queue.clear", patience=AT_REST
    )
    async def clear_queue(ask: Ask) -> Response:
        """Cancel all waiting jobs, held ones included. The running job continues."""
        return answer(await ask(lambda service: service.queue.clear(ask.caller)))


def add_recovery(routes: Routes) -> None:
    """Add the routes for a job that was running when this program last ended."""

    @routes.add("GET", "/v1/queue/recovery", Operation.READ, tag=_QUEUE, gives=Recovery, refuses=(NotFound,))
    async def recovery(ask: Ask) -> Response:
        """Return the interrupted job and the possible decisions about it."""

        async def found(service: Service) -> Recovery:
            waiting = service.queue.view().recovery
            if waiting is None:
                raise NotFound(what="interrupted job", number="now")
            return waiting

        return answer(await ask(found))

    choices = {"again": {"choice": "redo", "holding": False}, "give it up": {"choice": "abort"}}

    @routes.add(
        "POST",
        "/v1/queue/recovery",
        Operation.RESTART,
        tag=_QUEUE,
        gives=QueueView,
        refuses=(NotFound, AnswerNeeded, Faulted, NotConnected, NotHomed, PathRefused, Unreachable),
        examples=choices,
        client="queue.recover",
        patience=AT_REST,
    )
    async def choose_recovery(ask: Ask, body: RecoveringBody) -> Response:
        """Decide about the interrupted job: resume, redo, skip or abort.

        `holding` says whether the gripper holds a part. Without it the request is refused (4015 AnswerNeeded) if the
        decision depends on it. If no job was interrupted, or another one than `job`, the error is 4004 NotFound. If the
        rest of the job cannot be done, the error is that of the motion.
        """
        chosen = ask(
            lambda service: service.queue.recover(
                body.choice, holding=body.holding, resume_queue=body.resume_queue, job=body.job, by=ask.caller
            )
        )
        return answer(await chosen)


def add_ordering(routes: Routes) -> None:
    """Add the routes that change one job of the queue."""

    @routes.add(
        "PATCH",
        "/v1/jobs/{job}",
        *_CHANGING,
        tag=_JOBS,
        gives=JobLine,
        refuses=(*_NO_SUCH, InvalidJob, JobChanged, UnknownName),
        examples={"sooner": {"priority": 10, "notes": "before the visit"}},
    )
    async def change_job(ask: Ask, job: JobNumber, changes: ChangesBody, version: Version = "") -> Response:
        """Change the options of a job in the queue, or its steps that have not begun.

        `version` is the version in the job's report. If the job has changed since, the request is refused (4022
        JobChanged).
        """
        return answer(await ask(lambda service: service.queue.change(job, changes, ask.caller, version=version)))

    @routes.add(
        "POST", "/v1/jobs/{job}/hold", *_CHANGING, tag=_JOBS, gives=JobLine, refuses=_NO_SUCH, client="queue.hold"
    )
    async def hold_job(ask: Ask, job: JobNumber) -> Response:
        """Hold a waiting job."""
        return answer(await ask(lambda service: service.queue.hold(job, ask.caller)))

    @routes.add(
        "POST",
        "/v1/jobs/{job}/release",
        Operation.APPROVE,
        tag=_JOBS,
        gives=JobLine,
        refuses=(*_NO_SUCH, JobChanged),
        client="queue.release",
    )
    async def release_job(ask: Ask, job: JobNumber, version: Version = "") -> Response:
        """Release a held job. For a proposal, this is the approval.

        `version` is the version in the job's report. If the job has changed since, the request is refused (4022
        JobChanged).
        """
        return answer(await ask(lambda service: service.queue.release(job, ask.caller, version=version)))

    places = {"first of all": {"to": "first"}, "before another": {"before": 7}}

    @routes.add(
        "POST",
        "/v1/jobs/{job}/move",
        Operation.CHANGE_JOB,
        tag=_JOBS,
        gives=JobLine,
        refuses=_NO_SUCH,
        examples=places,
        client="queue.move",
    )
    async def move_job(ask: Ask, job: JobNumber, body: MovingBody) -> Response:
        """Move a waiting job within the queue.

        Give exactly one of `before` (a job number), `after` (a job number) or `to` ("first" or "last").
        """

        def moved(service: Service) -> Awaitable[JobLine]:
            return service.queue.move(job, before=body.before, after=body.after, to=body.to, by=ask.caller)

        return answer(await ask(moved))

    @routes.add(
        "POST",
        "/v1/jobs/{job}/again",
        Operation.SUBMIT,
        Operation.PROPOSE,
        tag=_JOBS,
        gives=JobLine,
        status=202,
        refuses=(*_NO_SUCH, KeyReused, NotConnected, Faulted),
        examples={"from the third step": {"from_step": 3}},
        client="queue.again",
    )
    async def repeat_job(ask: Ask, job: JobNumber, body: AgainBody, key: IdempotencyKey = "") -> Response:
        """Queue an ended job again as a new job.

        It begins at the step `from_step` (counted from 1), by default at the first step that was not done.
        """

        def queued(service: Service) -> Awaitable[JobLine]:
            return service.queue.again(job, from_step=body.from_step, by=ask.caller, key=key)

        return answer(await ask(queued), 202)


async def _view(service: Service) -> QueueView:
    return service.queue.view()
