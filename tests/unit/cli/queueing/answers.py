"""A service with a queue, scripted: its queue, and its requests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from maya_un import runtime
from maya_un.cli.main import main
from maya_un.runtime import Running
from maya_un.schema.choices import OnFailure
from maya_un.schema.encoding import to_data
from maya_un.schema.jobs import JobLine, TaskState
from tests.unit.cli.servers import http_service

LINE: dict[str, Any] = to_data(
    JobLine(
        7,
        "two cubes",
        TaskState.QUEUED,
        0,
        "",
        "ana",
        "10.0.0.7",
        0,
        1,
        "",
        (),
        0,
        5,
        61.0,
        None,
        None,
        "2026-03-01T10:00:00+00:00",
        "",
        "",
        False,
        "",
        OnFailure.CONTINUE,
        0,
        False,
    )
)
"""A line of the queue."""

VIEW: dict[str, Any] = {
    "mode": "running", "reason": "", "by": "", "since": "", "running": None, "waiting": [], "counts": {},
    "finish_at": None, "recovery": None,
}  # fmt: skip
"""An empty queue that runs."""

STATUS: dict[str, Any] = {"speed": 1.0, "progress": None, "last_event": 40}

LEASE: dict[str, Any] = {"holder": "", "implicit": False, "yours": False, "since": 0.0}

OFFER: dict[str, Any] = {
    "job": 7, "name": "two cubes", "index": 3, "step": "pick left", "phase": "close",
    "since": "2026-03-01T10:00:00+00:00", "holding": None, "state": {"point": [0.5, 1.1, 0.4]},
    "choices": [
        {"name": "redo", "meaning": "do it again", "needs_answer": True},
        {"name": "abort", "meaning": "end it", "needs_answer": False},
        {"name": "wave", "meaning": "wave a hand", "needs_answer": False},
    ],
}  # fmt: skip
"""Choices for an interrupted job."""


class Service:
    """Answers by path; `asked` are the requests in order. An answer that is an int is the status of a refusal."""

    def __init__(self, **answers: Any) -> None:
        empty = {"/v1/queue": VIEW, "/v1/status": STATUS, "/v1/lease": LEASE, "/v1/jobs": []}
        self.answers: dict[str, Any] = {**empty, **answers}
        self.asked: list[tuple[str, str, Any]] = []

    def says(self, method: str, path: str, body: Any) -> tuple[int, object]:
        self.asked.append((method, path, body))
        plain = path.partition("?")[0]
        answer = self.answers.get(f"{method} {plain}", self.answers.get(plain))
        if isinstance(answer, list) and answer and isinstance(answer[0], Several):
            answer = answer.pop(0) if len(answer) > 1 else answer[0]
            answer = answer.value
        return 200, answer

    @property
    def said(self) -> list[tuple[str, str, Any]]:
        """Requests that change something."""
        return [asked for asked in self.asked if asked[0] != "GET"]


class Several:
    """One of several answers, given one after the other."""

    def __init__(self, value: object) -> None:
        self.value = value


@contextmanager
def running(service: Service, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    """Have commands find the service."""
    with http_service(service.says) as url:
        monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, None))
        monkeypatch.setattr(runtime, "claimant", lambda: 1)
        yield service


def printed(line: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    """Return what a command line prints, on either stream."""
    assert main(line) == code
    out, err = capsys.readouterr()
    return out + err
