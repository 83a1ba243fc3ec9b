"""What `maya up` says once it runs: where, what waits from before, what to say next."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from dmc41x3.i18n import marked, translate
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.cli.waiting import because
from maya_un.errors import MayaError
from maya_un.schema.jobs import QueueMode, QueueView


@dataclass(frozen=True, slots=True)
class StartupBanner:
    """What there is to say: `far` is the URL for other machines, `rosbridge` that of its endpoint.

    `refusal` tells why a homing was not taken over.
    """

    url: str
    far: str | None
    address: str
    speed: float
    journal: Path | None
    queue: QueueView
    refusal: MayaError | None
    rosbridge: str | None = None


def greet(greeting: StartupBanner, settings: OutputSettings) -> None:
    """Say it."""
    if settings.json:
        output.emit(_data(greeting, settings.language))
        return
    if greeting.refusal is not None:
        output.complain(greeting.refusal, settings)
    for line in _lines(greeting, settings.language):
        output.say(line)


def _data(greeting: StartupBanner, language: str) -> dict[str, object]:
    refusal, queue = greeting.refusal, greeting.queue
    return {
        "url": greeting.url,
        "remote": greeting.far,
        "rosbridge": greeting.rosbridge,
        "pid": os.getpid(),
        "address": greeting.address,
        "speed": greeting.speed,
        "journal": None if greeting.journal is None else str(greeting.journal),
        "queue": queue.mode.value,
        "reason": queue.reason,
        "jobs": queue.counts,
        "interrupted": None if queue.recovery is None else queue.recovery.job,
        "code": 0 if refusal is None else refusal.code,
        "message": "" if refusal is None else refusal.text(language),
    }


def _lines(greeting: StartupBanner, language: str) -> Iterator[str]:
    yield translate(
        "Maya is up on {address}, clock × {speed:g}. Service: {url}",
        language,
        address=greeting.address,
        speed=greeting.speed,
        url=greeting.url,
    )
    if greeting.far is not None:
        yield translate("For other machines, with a token: {url}", language, url=greeting.far)
    if greeting.rosbridge is not None:
        yield translate("rosbridge: {url}", language, url=greeting.rosbridge)
    queue = greeting.queue
    if queue.recovery is not None:
        found = queue.recovery
        text = _INTERRUPTED if found.index else _INTERRUPTED_BETWEEN
        yield translate(text, language, job=found.job, name=found.name, index=found.index, step=found.step)
    waiting = sum(queue.counts.values()) - (queue.recovery is not None)
    if waiting:
        reason = because({"reason": queue.reason, "by": queue.by}, language)
        yield translate(_waiting(queue), language, count=waiting, reason=reason)
    yield translate(
        "Next, in another terminal: maya home · maya status · maya run JOB · maya stop.\nCtrl-C ends it.", language
    )


def _waiting(queue: QueueView) -> str:
    if queue.recovery is not None:
        return marked("Jobs waiting behind it: {count}.")
    if queue.mode is QueueMode.RUNNING:
        return marked("Waiting jobs from before: {count}.")
    return marked("Waiting jobs from before: {count}; the queue is paused ({reason}). `maya queue resume` continues.")


_INTERRUPTED = marked(
    "Job {job} ({name}) was interrupted at step {index}, {step}. Nothing moves by itself: `maya queue` shows the job, "
    "`maya queue recover` decides about it."
)
_INTERRUPTED_BETWEEN = marked(
    "Job {job} ({name}) was interrupted between two steps. Nothing moves by itself: `maya queue` shows the job, "
    "`maya queue recover` decides about it."
)
