"""`maya queue`: shown, paused, resumed, cleared, put in order."""

from __future__ import annotations

from typing import Any

from maya_un.cli import output
from maya_un.cli.client import Client
from maya_un.cli.queueing import text
from maya_un.cli.queueing.words import word
from maya_un.cli.settings import Settings
from maya_un.errors import InvalidCommandLine

AT_REST = 120.0
"""Longest wait for what brakes before it answers [s]."""


def show(settings: Settings) -> int:
    """Print the queue: its mode, who drives, what is under way, what waits, what is offered after a restart."""
    client = Client.find()
    view = client.get("/v1/queue")
    if settings.json:
        output.emit(view)
    else:
        output.say(text.queue(view, client.get("/v1/status"), client.get("/v1/lease"), settings.language))
    return output.DONE


def pause(settings: Settings, *, now: bool) -> int:
    """Begin nothing more; with `now` hold the step under way on its path too."""
    return _told("/v1/queue/pause", settings, {"when": "now" if now else "after step"})


def resume(settings: Settings) -> int:
    """Let the queue go on; raises `AnswerNeeded` while an interrupted job waits for a choice."""
    return _told("/v1/queue/resume", settings)


def step(settings: Settings) -> int:
    """Do one step, then pause."""
    return _told("/v1/queue/step", settings)


def clear(settings: Settings) -> int:
    """Cancel everything that waits and tell how many jobs that were."""
    client = Client.find()
    before = sum(client.get("/v1/queue")["counts"].values())
    view = client.post("/v1/queue/clear", timeout=AT_REST)
    count = before - sum(view["counts"].values())
    return output.answer(view, word("cleared", settings.language, count=max(0, count)), settings)


def move(job: int, where: str, other: int | None, settings: Settings) -> int:
    """Put a job "first" or "last", or "before" or "after" the `other`; raises `InvalidCommandLine`."""
    if where in {"first", "last"} and other is None:
        body: dict[str, object] = {"to": where}
    elif where in {"before", "after"} and other is not None:
        body = {where: other}
    else:
        reason = "say first or last, or before JOB or after JOB"
        raise InvalidCommandLine(reason=reason, command="maya queue move")
    line = Client.find().post(f"/v1/jobs/{job}/move", body)
    return output.answer(line, word("placed", settings.language, **line), settings)


def _told(path: str, settings: Settings, body: dict[str, Any] | None = None) -> int:
    view = Client.find().post(path, body, timeout=AT_REST)
    return output.answer(view, text.mode(view, settings.language), settings)
