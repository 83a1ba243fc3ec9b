"""`maya queue`: show, pause, resume, step, clear and reorder the queue."""

from __future__ import annotations

import sys
from typing import Any, get_args

from dmc41x3.i18n import PHRASE, phrase, translate
from maya_un.cli import output
from maya_un.cli.client import ServiceClient
from maya_un.cli.queueing import text
from maya_un.cli.queueing.recovery import typed
from maya_un.cli.settings import OutputSettings
from maya_un.cli.units import units_of
from maya_un.client import requests
from maya_un.client.request import Request
from maya_un.errors import InvalidCommandLine
from maya_un.schema.choices import QueueEnd
from maya_un.schema.jobs import TaskState

AT_REST = 120.0
"""Longest wait for a change of the queue, which may have to stop the robot first [s]."""


LAST = 3
"""Number of ended jobs, and of failed ones, that are shown below the queue."""

_PAGE = 50
"""Number of jobs, newest first, among which the last ends are searched."""

_FAILED = (TaskState.FAILED,)
_ENDED = (TaskState.DONE, TaskState.FAILED, TaskState.CANCELLED)


def show(settings: OutputSettings) -> int:
    """Print the queue: its mode, the driver, its jobs, the choices after a restart, and the jobs that ended last."""
    client = ServiceClient.find()
    view = client.ask(requests.queue())
    if settings.json:
        output.emit(view)
        return output.DONE
    blocks = [
        text.queue(
            view, client.ask(requests.status()), client.ask(requests.lease()), settings.language, units_of(settings)
        ),
        text.ended(_ended_last(client), settings.language),
    ]
    output.say("\n\n".join(block for block in blocks if block))
    return output.DONE


def _ended_last(client: ServiceClient) -> list[dict[str, Any]]:
    """Return the jobs that ended last and the jobs that failed last, by the date of their ends; no direct commands."""
    found: dict[int, dict[str, Any]] = {}
    for states in (_ENDED, _FAILED):
        page = [job for job in client.ask(requests.jobs(state=states, limit=_PAGE)) if not job["direct"]]
        newest = sorted(page, key=_by_end)[-LAST:]
        found |= {job["id"]: job for job in newest}
    return sorted(found.values(), key=_by_end)


def _by_end(job: dict[str, Any]) -> tuple[str, int]:
    return job["ended"], job["id"]


def pause(settings: OutputSettings, *, now: bool) -> int:
    """Pause the queue; with `now`, also hold the running step on its path."""
    return _told(requests.pause_queue("now" if now else "after step"), settings)


def resume(settings: OutputSettings) -> int:
    """Resume the queue; raises `AnswerNeeded` while an interrupted job waits for a decision."""
    return _told(requests.resume_queue(), settings)


def step(settings: OutputSettings) -> int:
    """Do one step, then pause."""
    return _told(requests.step_queue(), settings)


def answer(choice: str | None, settings: OutputSettings) -> int:
    """Answer the question of the running job; on a terminal, prompt for a missing choice.

    Raises `InvalidCommandLine` if the choice is missing without a terminal.
    """
    client = ServiceClient.find()
    question = client.ask(requests.queue())["question"]
    if question is None or not question["open"]:
        if choice is not None:
            return _told(requests.answer_question(choice), settings)  # the service refuses it
        return output.answer({"question": None}, translate("No job asks a question.", settings.language), settings)
    if choice is None:
        if settings.json or not sys.stdin.isatty():
            raise InvalidCommandLine(
                reason=phrase("{name} is missing: {choices}", name="CHOICE", choices=_one_of(question, settings)),
                command="maya queue answer",
            )
        prompt = f"{question['question']} ({', '.join(question['choices'])}): "
        choice = typed(prompt, question["choices"], settings.language)
    request = requests.answer_question(choice, job=question["job"], index=question["index"])
    view = client.ask(request, timeout=AT_REST)
    return output.answer(view, translate("Answered: {choice}.", settings.language, choice=choice), settings)


def _one_of(question: dict[str, Any], settings: OutputSettings) -> str:
    """Return the choices of a question, as "left, middle or right"."""
    *others, last = question["choices"]
    return translate(" or ", settings.language, PHRASE).join([", ".join(others), last] if others else [last])


def clear(settings: OutputSettings) -> int:
    """Cancel all waiting jobs and print their number."""
    client = ServiceClient.find()
    before = sum(client.ask(requests.queue())["counts"].values())
    view = client.ask(requests.clear_queue())
    count = before - sum(view["counts"].values())
    return output.answer(view, translate("Jobs cancelled: {count}.", settings.language, count=max(0, count)), settings)


def move(job: int, where: str, other: int | None, settings: OutputSettings) -> int:
    """Move a job to "first" or "last", or "before" or "after" the `other`; raises `InvalidCommandLine`."""
    if where in get_args(QueueEnd) and other is None:
        place: dict[str, Any] = {"to": where}
    elif where in {"before", "after"} and other is not None:
        place = {where: other}
    else:
        reason = phrase("give first, last, before JOB or after JOB")
        raise InvalidCommandLine(reason=reason, command="maya queue move")
    line = ServiceClient.find().ask(requests.move_job(job, **place))
    return output.answer(
        line, translate("Job {id}, {name}: number {position} of the waiting jobs.", settings.language, **line), settings
    )


def _told(request: Request[Any], settings: OutputSettings) -> int:
    view = ServiceClient.find().ask(request, timeout=AT_REST)
    return output.answer(view, text.mode(view, settings.language), settings)
