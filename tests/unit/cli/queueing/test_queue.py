"""`maya queue`: shown, changed, and what becomes of an interrupted job."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from maya_un.errors import NotHomed
from tests.unit.cli.queueing.answers import LINE, OFFER, STATUS, VIEW, Service, printed, running

Serve = Callable[..., Service]


@pytest.fixture
def serve(monkeypatch: pytest.MonkeyPatch) -> Iterator[Serve]:
    """Return what serves answers by path until the test ends."""
    with ExitStack() as stack:
        yield lambda **answers: stack.enter_context(running(Service(**answers), monkeypatch))


def words(text: str) -> list[list[str]]:
    """Return the words of each line."""
    return [line.split() for line in text.splitlines() if line]


def test_empty_queue_is_reported(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve()
    assert printed(["queue"], capsys) == "The queue is running.\n\nNo job is waiting.\n"


def test_running_job_comes_first_with_its_end_by_the_clock(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    under_way = {**LINE, "id": 6, "name": "one", "state": "running", "done": 2, "eta": 130.0, "position": None}
    waiting = {**LINE, "eta": 4000.0, "priority": 5, "notes": "please", "depends_on": [6]}
    view = {**VIEW, "running": under_way, "waiting": [waiting], "counts": {"running": 1, "queued": 3}}
    progress = {"phase": "down", "elapsed": 2.0, "duration": 8.0}
    serve(**{"/v1/queue": view, "/v1/status": {**STATUS, "speed": 10.0, "progress": progress}})
    shown = words(printed(["queue"], capsys))
    assert shown[2][:7] == ["6", "one", "running", "2/5", "13.0", "s", shown[2][6]]
    assert shown[3][:7] == ["7", "two", "cubes", "queued", "0/5", "6:40", "min"]
    assert shown[3][-5:] == ["5", "ana", "please", "after", "6"]
    assert shown[4:] == [["under", "way:", "go", "down,", "25", "%"], ["2", "more", "are", "waiting."]]


def test_paused_queue_shows_the_reason_and_the_way_to_resume(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    view = {**VIEW, "mode": "paused", "reason": "stop", "by": "berta", "since": "2026-03-01T10:00:00+00:00"}
    serve(**{"/v1/queue": view})
    said = printed(["queue"], capsys)
    assert "(berta stopped the robot). `maya queue resume` continues it." in said
    assert "en pausa" in printed(["queue", "--lang", "es"], capsys)


def test_queue_paused_by_an_unknown_caller_shows_no_name(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    view = {**VIEW, "mode": "paused", "reason": "stop", "by": "", "since": "2026-03-01T10:00:00+00:00"}
    serve(**{"/v1/queue": view})
    assert "(a stop command)" in printed(["queue"], capsys)
    assert "(una orden de parada)" in printed(["queue", "--lang", "es"], capsys)


@pytest.mark.parametrize(
    ("job", "said"),
    [
        ("paused", "The queue is paused, and the motion is held on its path (ana paused it)."),
        ("running", "The queue pauses after the current step (ana paused it)."),
    ],
)
def test_a_motion_that_is_held_differs_from_a_step_that_goes_on(
    serve: Serve, capsys: pytest.CaptureFixture[str], job: str, said: str
) -> None:
    view = {**VIEW, "mode": "pausing", "reason": "asked", "by": "ana", "running": {**LINE, "state": job}}
    serve(**{"/v1/queue": view, "/v1/queue/pause": view})
    assert said in printed(["queue"], capsys).splitlines()
    assert printed(["queue", "pause", "--now"], capsys) == f"{said}\n"


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ({"queued": 1}, "Estimated end of all jobs: "),
        ({"queued": 1, "held": 1}, "Estimated end of all jobs that are not held: "),
    ],
)
def test_held_job_shows_no_predicted_end(
    serve: Serve, capsys: pytest.CaptureFixture[str], counts: dict[str, int], said: str
) -> None:
    serve(**{"/v1/queue": {**VIEW, "counts": counts, "finish_at": "2026-03-01T10:00:00+00:00"}})
    assert said in printed(["queue"], capsys)


def test_jobs_that_ended_last_are_shown_with_the_errors_of_those_that_failed(
    serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    done = {**LINE, "id": 5, "state": "done", "done": 5, "duration": 61.0}
    failed = {
        **LINE,
        "id": 4,
        "state": "failed",
        "code": 2103,
        "message": str(NotHomed(command="maya home")),
        "duration": 0.0,
    }
    serve(**{"/v1/jobs": [done, failed]})
    shown = printed(["queue"], capsys)
    assert words(shown.partition("Ended last:\n")[2])[1:3] == [
        ["4", "two", "cubes", "failed", "(2103)", "0/5", "0.0", "s"],
        ["5", "two", "cubes", "done", "5/5", "1:01", "min"],
    ]
    assert shown.splitlines()[-1] == f"Job 4 failed: {NotHomed(command='maya home')}"
    assert f"El trabajo 4 ha fallado: {NotHomed(command='maya home').text('es')}" in printed(
        ["queue", "--lang", "es"], capsys
    )


def test_a_job_that_is_done_has_no_steps_left_but_those_of_the_other_branch(
    serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    done = {**LINE, "id": 5, "state": "done", "done": 11, "steps": 13, "duration": 61.0}
    failed = {**done, "id": 4, "state": "failed", "code": 4024}
    serve(**{"/v1/jobs": [done, failed]})
    shown = printed(["queue"], capsys)
    assert " 13/13, 2 skipped " in shown
    assert " 11/13 " in shown


def test_json_output_is_the_answer_of_the_service(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve()
    assert json.loads(printed(["queue", "--json"], capsys)) == VIEW


def test_interrupted_job_shows_the_machine_state_and_the_choices(
    serve: Serve, capsys: pytest.CaptureFixture[str]
) -> None:
    serve(**{"/v1/queue": {**VIEW, "mode": "paused", "reason": "restart", "recovery": OFFER}})
    said = printed(["queue"], capsys)
    assert "Job 7, two cubes, was interrupted in step 3, pick left (close the gripper)" in said
    assert "x 500.0 mm  y 1100.0 mm  z 400.0 mm" in said
    assert "Only a person can see whether it holds a part" in said
    assert "redo    do the interrupted step again, then the rest (with --holding yes|no)" in said
    assert "wave    wave a hand" in said
    assert "maya queue resume" not in said


def test_one_interrupted_between_two_steps(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    offer = {**OFFER, "index": 0, "step": "", "phase": "", "holding": False, "state": {"point": None}}
    serve(**{"/v1/queue": {**VIEW, "mode": "paused", "reason": "restart", "recovery": offer}})
    said = printed(["queue"], capsys)
    assert "was interrupted between two steps" in said
    assert "The robot is not homed: run `maya home` first.\nThe gripper is open." in said


@pytest.mark.parametrize(
    ("line", "asked"),
    [
        ("pause", ("POST", "/v1/queue/pause", {})),
        ("pause --now", ("POST", "/v1/queue/pause", {"when": "now"})),
        ("resume", ("POST", "/v1/queue/resume", None)),
        ("step", ("POST", "/v1/queue/step", None)),
    ],
)
def test_queue_is_printed(
    serve: Serve, capsys: pytest.CaptureFixture[str], line: str, asked: tuple[str, str, Any]
) -> None:
    service = serve(**{asked[1]: VIEW})
    assert printed(["queue", *line.split()], capsys) == "The queue is running.\n"
    assert service.said == [asked]


def test_clearing_shows_the_number_of_jobs(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    serve(
        **{
            "/v1/queue": {**VIEW, "counts": {"queued": 3, "running": 1}},
            "/v1/queue/clear": {**VIEW, "counts": {"running": 1}},
        }
    )
    assert printed(["queue", "clear"], capsys) == "Jobs cancelled: 3.\n"


@pytest.mark.parametrize(
    ("line", "body"),
    [
        ("7 first", {"to": "first"}),
        ("7 last", {"to": "last"}),
        ("7 before 9", {"before": 9}),
        ("7 after 9", {"after": 9}),
    ],
)
def test_a_job_is_put_somewhere_else(
    serve: Serve, capsys: pytest.CaptureFixture[str], line: str, body: dict[str, Any]
) -> None:
    service = serve(**{"/v1/jobs/7/move": {**LINE, "position": 2}})
    assert printed(["queue", "move", *line.split()], capsys) == "Job 7, two cubes: number 2 of the waiting jobs.\n"
    assert service.said == [("POST", "/v1/jobs/7/move", body)]


@pytest.mark.parametrize("line", ["7 first 9", "7 before", "7 sideways", "x first", "0 first"])
def test_invalid_place_is_refused_before_any_question(
    serve: Serve, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    service = serve()
    assert printed(["queue", "move", *line.split()], capsys, 2).startswith("maya: error 4008:")
    assert service.asked == []


def at_terminal(monkeypatch: pytest.MonkeyPatch, said: str) -> None:
    """Have somebody sit at the terminal and type this."""
    keyboard = io.StringIO(said)
    monkeypatch.setattr(keyboard, "isatty", lambda: True)
    monkeypatch.setattr(sys, "stdin", keyboard)


OFFERED = {"/v1/queue": {**VIEW, "recovery": OFFER}, "/v1/queue/recovery": VIEW}


def test_recover_mentions_the_next_interrupted_job(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    left = {**VIEW, "mode": "paused", "reason": "restart", "recovery": {**OFFER, "job": 8, "name": "the other"}}
    serve(**{**OFFERED, "/v1/queue/recovery": left})
    said = printed(["queue", "recover", "abort"], capsys)
    assert "Job 8, the other, was interrupted" in said
    assert "redo    do the interrupted step again" in said


def test_recovery_can_be_given_completely_on_the_command_line(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve(**OFFERED)
    printed(["queue", "recover", "redo", "--holding", "no", "--pause"], capsys)
    body = {"choice": "redo", "holding": False, "resume_queue": False, "job": OFFER["job"]}
    assert service.said == [("POST", "/v1/queue/recovery", body)]


def test_on_a_terminal_it_asks_until_it_is_answered(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    service = serve(**OFFERED)
    at_terminal(monkeypatch, "what\n\nre\nmaybe\nYES\n")
    said = printed(["queue", "recover"], capsys)
    assert "Job 7, two cubes, was interrupted" in said
    assert said.count("One of: redo, abort, wave") == 2
    assert said.count("One of: yes, no") == 1
    assert service.said == [("POST", "/v1/queue/recovery", {"choice": "redo", "holding": True, "job": OFFER["job"]})]


def test_question_without_alternatives_is_not_asked(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    service = serve(**OFFERED)
    at_terminal(monkeypatch, "abort\n")
    printed(["queue", "recover"], capsys)
    assert service.said == [("POST", "/v1/queue/recovery", {"choice": "abort", "job": OFFER["job"]})]


def test_leaving_without_an_answer_chooses_nothing(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    service = serve(**OFFERED)
    at_terminal(monkeypatch, "")
    assert "no choice was given" in printed(["queue", "recover"], capsys, 2)
    assert service.said == []


def test_without_a_terminal_the_choice_must_be_an_option(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve(**OFFERED)
    assert "CHOICE is missing" in printed(["queue", "recover"], capsys, 2)
    assert service.said == []


def test_without_an_interrupted_job_nothing_is_asked(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve()
    assert printed(["queue", "recover"], capsys) == "Nothing was interrupted.\n"
    assert service.said == []


def test_missing_service_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(["queue"], capsys, 1).startswith("maya: error 1020")


def test_end_after_a_homing_is_shown_as_an_estimate(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    view = {**VIEW, "counts": {"queued": 1}, "finish_at": "2026-03-01T10:00:00+00:00", "estimated": True}
    serve(**{"/v1/queue": view})
    assert "Estimated end of all jobs: about 2026-03-01 10:00 (with an estimated homing)." in printed(["queue"], capsys)


@pytest.mark.parametrize(
    ("lease", "said"),
    [
        ({"holder": "eva", "implicit": False, "yours": False}, "eva drives: jobs of others wait."),
        ({"holder": "eva", "implicit": False, "yours": True}, "You drive: jobs of others wait."),
        ({"holder": "eva", "implicit": True, "yours": False}, ""),
    ],
)
def test_driver_is_shown(serve: Serve, capsys: pytest.CaptureFixture[str], lease: dict[str, object], said: str) -> None:
    serve(**{"/v1/lease": lease})
    shown = printed(["queue"], capsys)
    assert said in shown
    assert bool(said) == ("drive" in shown)


@pytest.mark.parametrize("said", ["sí", "si", "S"])
def test_in_spanish_it_is_answered_in_spanish(
    serve: Serve, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, said: str
) -> None:
    service = serve(**OFFERED)
    at_terminal(monkeypatch, f"redo\nyes\n{said}\n")
    shown = printed(["--lang", "es", "queue", "recover"], capsys)
    assert "(sí, no)" in shown
    assert service.said == [("POST", "/v1/queue/recovery", {"choice": "redo", "holding": True, "job": OFFER["job"]})]


QUESTION: dict[str, Any] = {
    "job": 7, "index": 0, "question": "Which tray?", "choices": ["left", "middle", "right"], "open": True,
}  # fmt: skip


@pytest.mark.parametrize(
    ("language", "missing"),
    [("en", "CHOICE is missing: left, middle or right. See"), ("es", ": left, middle o right. ")],
)
def test_an_answer_without_a_terminal_must_be_one_of_the_choices_that_it_names(
    serve: Serve, capsys: pytest.CaptureFixture[str], language: str, missing: str
) -> None:
    service = serve(**{"/v1/queue": {**VIEW, "question": QUESTION}})
    assert missing in printed(["--lang", language, "queue", "answer"], capsys, 2)
    assert service.said == []


def test_an_answer_is_confirmed(serve: Serve, capsys: pytest.CaptureFixture[str]) -> None:
    service = serve(**{"/v1/queue": {**VIEW, "question": QUESTION}, "/v1/queue/answer": VIEW})
    assert printed(["queue", "answer", "left"], capsys) == "Answered: left.\n"
    (asked,) = service.said
    assert asked[2]["answer"] == "left"
