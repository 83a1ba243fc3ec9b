"""Following a job of the running robot to its end, over HTTP, and the reasons why it waits or the queue is paused."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from dmc41x3.i18n import PHRASE, marked, translate
from maya_un.cli.client import ServiceClient
from maya_un.cli.progress import Display, tell
from maya_un.cli.settings import OutputSettings
from maya_un.client import requests
from maya_un.events import QuestionAsked, event_of
from maya_un.schema.jobs import PauseReason

_REASONS: dict[str, str] = {
    PauseReason.ASKED: marked("{by} paused it"),
    PauseReason.STEP: marked("step mode"),
    PauseReason.STOP: marked("{by} stopped the robot"),
    PauseReason.FAULT: marked("a fault"),
    PauseReason.RESTART: marked("the program was restarted"),
    PauseReason.DRIVER: marked("the driver no longer responds"),
    PauseReason.STORAGE: marked("the disk cannot be written"),
    PauseReason.FAILURE: marked("a job failed"),
}
"""Reasons why a queue is paused."""

_BY_UNKNOWN: dict[str, str] = {PauseReason.ASKED: marked("a pause command"), PauseReason.STOP: marked("a stop command")}
"""The same for an unknown user."""


def because(view: Mapping[str, Any], language: str) -> str:
    """Return why the queue is paused; `view` is a QueueView as JSON data."""
    why = str(view["reason"])
    if not view["by"] and why in _BY_UNKNOWN:
        return translate(_BY_UNKNOWN[why], language)
    return translate(_REASONS[why], language, by=view["by"]) if why in _REASONS else why


def reason(client: ServiceClient, report: Mapping[str, Any], language: str) -> str:
    """Return why a job does not continue, "" if it does; `report` is a JobReport as JSON data."""
    if report["state"] not in {"queued", "paused", "interrupted", "held"}:
        return ""
    view = client.ask(requests.queue())
    begun = report["state"] == "queued" and all(line["id"] != report["id"] for line in view["waiting"])
    return "" if begun else _reason(client, view, report, language)


def _reason(client: ServiceClient, view: Mapping[str, Any], report: Mapping[str, Any], language: str) -> str:
    number = report["id"]
    line = next((line for line in view["waiting"] if line["id"] == number), None)
    direct = line is not None and line["direct"]
    if report["state"] == "held":
        proposed = line is not None and line["proposal"]
        text = (
            marked("Job {id} is a proposal. An operator approves it with `maya job release {id}`.")
            if proposed
            else marked("Job {id} is held. `maya job release {id}` lets it wait for its turn.")
        )
        return translate(text, language, id=number)
    if view["recovery"] is not None and not direct:
        return translate(
            "Job {id} waits, because job {other} was interrupted. Decide about job {other} with `maya queue recover`.",
            language,
            id=number,
            other=view["recovery"]["job"],
        )
    if view["mode"] == "paused" and not direct:
        return translate(
            "Job {id} waits: the queue is paused ({reason}). `maya queue resume` continues it.",
            language,
            id=number,
            reason=because(view, language),
        )
    lease = client.ask(requests.lease())
    if lease["holder"] and not lease["implicit"] and not lease["yours"]:
        return translate("Job {id} waits: {holder} drives the robot.", language, id=number, **lease)
    under_way = view["running"]
    if line is not None and line["position"] and under_way is not None and under_way["id"] != number:
        return translate(
            "Job {id} waits for its turn, number {position}.", language, id=number, position=line["position"]
        )
    return ""


PATIENCE = 0.2
"""Longest wait for events in one request [s]."""

_ENDED = {"done", "failed", "cancelled"}

INTERRUPTION = marked("Interrupted: the robot decelerates along the path.")
"""Message after a stop by Ctrl-C."""


def follow(
    client: ServiceClient, job: int, since: int, display: Display, settings: OutputSettings
) -> tuple[dict[str, Any], bool]:
    """Show events numbered above `since` and the running motion until `job` has ended.

    Shows why the job waits. Returns its report, and whether Ctrl-C ended it: then the job is cancelled, which stops the
    robot on its path.
    """
    try:
        return _to_the_end(client, job, since, display, settings.language), False
    except KeyboardInterrupt:
        display.note(translate(INTERRUPTION, settings.language))
        return client.ask(requests.cancel(job), timeout=60.0), True


def _to_the_end(client: ServiceClient, job: int, since: int, display: Display, language: str) -> dict[str, Any]:
    report: dict[str, Any] = client.ask(requests.report(job))
    said = ""
    while report["state"] not in _ENDED:
        why = reason(client, report, language)
        if why and why != said:
            display.wait(why)
        said = why
        events = client.ask(requests.events(since=since, wait=PATIENCE))
        for event in events:
            since = event["seq"]
            happened = event_of(event["kind"], event["detail"], event["code"])
            if isinstance(happened, QuestionAsked):
                display.wait(_asked(happened, language))
            else:
                tell(happened, display, language)
        if events:
            report = client.ask(requests.report(job))
        animate(client, display)
    return report


def answers(choices: Sequence[str], language: str) -> str:
    """Return the commands that answer a question, one for each of its choices."""
    commands = [f"`maya queue answer {shlex.quote(choice)}`" for choice in choices]
    return translate(" or ", language, PHRASE).join(commands)


def _asked(event: QuestionAsked, language: str) -> str:
    """Return a question with the ways to answer it: this terminal takes no answer."""
    return translate(
        "question: {question} Answer with {answers}.",
        language,
        question=event.question,
        answers=answers(event.choices.split(" / "), language),
    )


def animate(client: ServiceClient, display: Display) -> None:
    """Show the progress of the running motion."""
    progress = client.ask(requests.status())["progress"]
    if progress is None:
        display.rest()
    else:
        display.motion(progress["phase"], progress["elapsed"], progress["duration"])
