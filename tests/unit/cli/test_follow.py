"""A job is followed to its end; the cause of waiting is printed, also with JSON, but not for a short wait."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from maya_un.cli.client import ServiceClient
from maya_un.cli.progress import Display, FactLines
from maya_un.cli.settings import OutputSettings
from maya_un.cli.waiting import because, follow
from maya_un.schema.jobs import PauseReason
from tests.unit.cli.queueing.answers import LINE, OFFER, VIEW, Service, Several, running

PAUSED: dict[str, object] = {**VIEW, "mode": "paused", "reason": "asked", "by": "ana", "waiting": [LINE]}
REPORT = {"id": 7, "name": "two cubes", "code": 0, "message": "", "steps": []}
WAITS = "Job 7 waits: the queue is paused (ana paused it). `maya queue resume` continues it."


IDLE: dict[str, object] = {"seq": 41, "time": 0.0, "kind": "idle", "code": 0, "detail": {}}


def followed(
    states: Sequence[str], display: Display, monkeypatch: pytest.MonkeyPatch, told: dict[str, object] = IDLE
) -> str:
    """Follow a job that is seen in these states, in a queue that is paused, with an event; return the last state."""
    reports = [Several({**REPORT, "state": state}) for state in states]
    answers = {"/v1/queue": PAUSED, "/v1/jobs/7": reports, "/v1/events": [told]}
    with running(Service(**answers), monkeypatch):
        report, interrupted = follow(ServiceClient.find(), 7, 40, display, OutputSettings())
    assert not interrupted
    state: str = report["state"]
    return state


@pytest.mark.parametrize("json", [False, True])
def test_cause_of_waiting_is_printed_once_and_never_among_the_results(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, json: bool
) -> None:
    states = ["queued"] * 6 + ["running", "done"]
    assert followed(states, Display() if json else FactLines(), monkeypatch) == "done"
    out, err = capsys.readouterr()
    assert (err if json else out).count(WAITS) == 1
    assert not (out if json else err)


@pytest.mark.parametrize("recovery", [None, OFFER])
def test_job_that_begins_at_once_prints_no_waiting(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], recovery: object
) -> None:
    monkeypatch.setitem(PAUSED, "recovery", recovery)
    monkeypatch.setitem(PAUSED, "waiting", [{**LINE, "direct": True}])
    assert followed(["queued", "queued", "running", "done"], FactLines(), monkeypatch) == "done"
    assert "waits" not in "".join(capsys.readouterr())


def test_job_that_began_meanwhile_prints_no_waiting(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(PAUSED, "recovery", OFFER)
    monkeypatch.setitem(PAUSED, "waiting", [])
    assert followed(["queued", "queued", "running", "done"], FactLines(), monkeypatch) == "done"
    assert "waits" not in "".join(capsys.readouterr())


@pytest.mark.parametrize("json", [False, True])
def test_a_question_is_shown_with_the_commands_that_answer_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *, json: bool
) -> None:
    detail = {"job": 7, "index": 1, "question": "Which part?", "choices": "cube / a box"}
    asked: dict[str, object] = {**IDLE, "kind": "question", "detail": detail}
    assert followed(["running", "done"], Display() if json else FactLines(), monkeypatch, asked) == "done"
    out, err = capsys.readouterr()
    assert "question: Which part? Answer with `maya queue answer cube` or `maya queue answer 'a box'`.\n" in (
        err if json else out
    )


@pytest.mark.parametrize("by", ["", "ana"])
@pytest.mark.parametrize("reason", PauseReason)
def test_every_reason_of_a_paused_queue_has_words(reason: PauseReason, by: str) -> None:
    english, spanish = (because({"reason": reason, "by": by}, language) for language in ("en", "es"))
    assert english != reason
    assert english != spanish
