"""Requests to the service and their order, against scripts."""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from maya_un.client import requests, targets
from maya_un.client.plans import jobs, primitives, resources, robot
from maya_un.client.plans.jobs import StillWaiting
from maya_un.client.request import Request, get
from maya_un.client.steps import RETRY_TIMEOUT, Plan, persistently
from maya_un.client.transport import HeldLease
from maya_un.errors import (
    Busy,
    EventsForgotten,
    GripperEmpty,
    InvalidValue,
    LeaseHeld,
    LeaseLost,
    ServiceNotAnswering,
    ServiceNotRunning,
    TooManyRequests,
)
from maya_un.schema.choices import OnFailure
from maya_un.schema.jobs import JobAccepted, JobLine, JobReport, QueueMode, QueueView, TaskState
from maya_un.schema.people import LeaseTaken, LeaseView
from maya_un.schema.robot import EventMessage
from tests.unit.client.plan_player import Player

LINE = JobLine(
    7, "x", TaskState.QUEUED, 0, "", "ana", "", 0, 1, "", (), 0, 1, None, None, None, "", "", "", False, "",
    OnFailure.CONTINUE, 0, False,
)  # fmt: skip
REPORT = JobReport(7, "x", TaskState.RUNNING, 0, "", None, None, None, None, (), {}, (), LINE)
RUNNING = QueueView(QueueMode.RUNNING, "", "", "", None, (), {}, None, None)
NOBODY = LeaseView("", "", 0.0, "", False, None, None, None, False)


class Service:
    """Answers like a service with one job, which has the `reports` one after the other; notes what it was asked."""

    def __init__(self, *reports: JobReport, queue: QueueView = RUNNING, lease: LeaseView = NOBODY) -> None:
        self.reports = list(reports)
        self.queue = queue
        self.lease = lease
        self.events: list[list[EventMessage]] = []

    def __call__(self, request: Request[Any]) -> Any:  # noqa: PLR0911 - one answer a path
        match request.method, request.path:
            case "GET", "/v1/status":
                return _Status(last_event=40)
            case "POST", "/v1/jobs":
                return JobAccepted(7, "x", 1)
            case "POST", "/v1/tasks":
                return replace(REPORT, state=TaskState.QUEUED)
            case "GET", "/v1/jobs/7":
                return self.reports.pop(0) if len(self.reports) > 1 else self.reports[0]
            case "GET", "/v1/events":
                return self.events.pop(0) if self.events else []
            case "GET", "/v1/queue":
                return self.queue
            case "GET", "/v1/lease":
                return self.lease
            case _:
                return None


class _Status:
    """As much of a status as the plans look at."""

    def __init__(self, last_event: int) -> None:
        self.last_event = last_event


def news(*numbers: int, job: int = 7) -> list[EventMessage]:
    return [EventMessage(number, 0.0, "job", 0, {"job": job}) for number in numbers]


def ended(state: TaskState = TaskState.DONE, code: int = 0, message: str = "") -> JobReport:
    return replace(REPORT, state=state, code=code, message=message)


def test_repeatable_request_is_retried_with_growing_pauses() -> None:
    trouble = [ServiceNotRunning(), ServiceNotAnswering(reason="cut"), ServiceNotAnswering(reason="cut")]
    player = Player(lambda _: trouble.pop(0) if trouble else 5)
    assert player.perform(persistently(get("/x", int))) == 5
    assert player.now == pytest.approx(0.05 + 0.1 + 0.2)


def test_patience_ends_with_the_last_error() -> None:
    player = Player(lambda _: ServiceNotRunning())
    with pytest.raises(ServiceNotRunning):
        player.perform(persistently(get("/x", int)))
    assert RETRY_TIMEOUT <= player.now < RETRY_TIMEOUT + 2.0


def test_retry_waits_as_long_as_the_server_asks() -> None:
    trouble: list[Exception] = [TooManyRequests(limit=5, seconds=1, wait=0.7)]
    player = Player(lambda _: trouble.pop(0) if trouble else 5)
    assert player.perform(persistently(get("/x", int))) == 5
    assert player.now == pytest.approx(0.7)


def test_refused_request_is_not_retried() -> None:
    player = Player(lambda _: Busy(doing="homing"))
    with pytest.raises(Busy):
        player.perform(persistently(get("/x", int)))
    assert len(player.asked) == 1


def test_a_submission_keeps_its_key_however_often_the_connection_breaks() -> None:
    service = Service()
    broken = [ServiceNotAnswering(reason="cut")] * 3

    def script(request: Request[Any]) -> Any:
        return broken.pop() if request.method == "POST" and broken else service(request)

    player = Player(script)
    submitted = player.perform(jobs.submit({"steps": ["home"]}, priority=3, notes="a", depends_on=[5, 6]))
    posts = [request for request in player.asked if request.method == "POST"]
    assert submitted.job.id == 7
    assert len(posts) == 4
    assert len({post.key for post in posts}) == 1
    assert posts[0].key
    assert posts[0].query == {"priority": 3, "notes": "a", "depends_on": [5, 6]}


def test_two_submissions_have_two_keys() -> None:
    player = Player(Service())
    for _ in range(2):
        player.perform(jobs.submit({"steps": ["home"]}))
    assert len({request.key for request in player.asked if request.method == "POST"}) == 2


def test_command_is_awaited_by_its_events() -> None:
    service = Service(REPORT, ended())
    service.events = [news(41, job=6), news(42, 43)]
    player = Player(service)
    assert player.perform(primitives.home()).state is TaskState.DONE
    asked = [request.query["since"] for request in player.asked if request.path == "/v1/events"]
    assert asked == [40, 41]
    assert player.paths.count("GET /v1/jobs/7") == 2


def test_failed_command_raises_its_error() -> None:
    player = Player(Service(ended(TaskState.FAILED, 3002, "The gripper is open, so there is nothing to place.")))
    with pytest.raises(GripperEmpty, match="nothing to place"):
        player.perform(primitives.place(0.5, 1.1))


@pytest.mark.parametrize("interrupt", [KeyboardInterrupt, asyncio.CancelledError])
def test_interrupted_command_is_cancelled(interrupt: type[BaseException]) -> None:
    service = Service(REPORT)

    def script(request: Request[Any]) -> Any:
        return interrupt() if request.path == "/v1/events" else service(request)

    player = Player(script)
    with pytest.raises(interrupt):
        player.perform(primitives.pick(0.5, 1.1))
    assert player.paths[-1] == "DELETE /v1/jobs/7"
    assert player.asked[-1].urgent  # the interruption may have left the other connection locked


def test_command_interrupted_before_its_answer_is_found_by_key_and_cancelled() -> None:
    service = Service(REPORT)
    answers: list[Any] = [KeyboardInterrupt()]

    def script(request: Request[Any]) -> Any:
        return answers.pop() if request.method == "POST" and answers else service(request)

    player = Player(script)
    with pytest.raises(KeyboardInterrupt):
        player.perform(primitives.pick(0.5, 1.1))
    assert player.paths[-3:] == ["POST /v1/tasks", "POST /v1/tasks", "DELETE /v1/jobs/7"]
    assert [request.urgent for request in player.asked[-3:]] == [False, True, True]
    assert len({request.key for request in player.asked if request.method == "POST"}) == 1


def test_interrupted_jog_stops_the_robot() -> None:
    player = Player(lambda request: KeyboardInterrupt() if request.path == "/v1/jog" else None)
    with pytest.raises(KeyboardInterrupt):
        player.perform(robot.jog("z", 0.02))
    assert player.paths == ["POST /v1/jog", "POST /v1/stop"]


def test_interrupted_waiting_leaves_the_job_alone() -> None:
    service = Service(REPORT)

    def script(request: Request[Any]) -> Any:
        return KeyboardInterrupt() if request.path == "/v1/events" else service(request)

    player = Player(script)
    with pytest.raises(KeyboardInterrupt):
        player.perform(jobs.wait(7))
    assert not [path for path in player.paths if path.startswith("DELETE")]


def test_a_wait_with_a_limit_ends_there() -> None:
    service = Service(REPORT)
    player = Player(service)

    def slow(request: Request[Any]) -> Any:
        if request.path == "/v1/events":
            player.now += float(str(request.query["wait"]))
        return service(request)

    player = Player(slow)
    with pytest.raises(TimeoutError, match="job 7 is running after 5"):
        player.perform(jobs.wait(7, timeout=5.0))
    assert player.now == pytest.approx(5.0)


def test_forgotten_events_lead_to_a_new_request_of_the_state() -> None:
    service = Service(REPORT, ended())

    def script(request: Request[Any]) -> Any:
        return EventsForgotten(since=40, oldest=90) if request.path == "/v1/events" else service(request)

    assert Player(script).perform(jobs.wait(7)).state is TaskState.DONE


def test_progress_yields_a_report_on_every_change_of_the_job() -> None:
    service = Service(replace(REPORT, state=TaskState.QUEUED), REPORT, REPORT, ended())
    service.events = [news(41), news(42, job=9), news(43), news(44)]
    found = Player(service).items(jobs.progress(7), 9)
    assert [report.state for report in found] == [TaskState.QUEUED, TaskState.RUNNING, TaskState.DONE]


@pytest.mark.parametrize(
    ("queue", "lease", "words"),
    [
        (replace(RUNNING, mode=QueueMode.PAUSED, reason="stop"), NOBODY, r"the queue is paused \(stop\)"),
        (RUNNING, replace(NOBODY, holder="berta", expires_in=5.0), "berta drives"),
    ],
)
def test_cause_of_waiting_is_reported_once(queue: QueueView, lease: LeaseView, words: str) -> None:
    waits = replace(REPORT, state=TaskState.QUEUED)
    service = Service(waits, waits, ended(), queue=queue, lease=lease)
    with pytest.warns(StillWaiting, match=words) as said:
        Player(service).perform(jobs.wait(7))
    assert len(said) == 1


def test_automatic_continuation_reports_nothing() -> None:
    own = replace(NOBODY, holder="ana", yours=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Player(Service(replace(REPORT, state=TaskState.QUEUED), ended(), lease=own)).perform(jobs.wait(7))
        Player(Service(REPORT, ended())).perform(jobs.wait(7))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        (("shelf", None, None), "shelf"),
        ((0.5, 1.1, None), [0.5, 1.1]),
        ((0.5, 1.1, 0.4), [0.5, 1.1, 0.4]),
        (((0.5, 1.1, 0.4), None, None), [0.5, 1.1, 0.4]),
    ],
)
def test_place_is_given_by_name_by_numbers_or_as_a_point(said: tuple[Any, Any, Any], meant: object) -> None:
    assert targets.spot(*said) == meant


def test_a_name_with_numbers_is_no_place() -> None:
    with pytest.raises(InvalidValue, match="a name, or numbers"):
        targets.spot("shelf", 0.4, None)


@pytest.mark.parametrize(
    ("command", "body"),
    [
        (primitives.home, {"command": "home"}),
        (lambda: primitives.pick("tray[1,2]"), {"command": "pick", "target": "tray[1,2]"}),
        (lambda: primitives.approach(0.5, 1.1, 0.6), {"command": "approach", "target": [0.5, 1.1, 0.6]}),
        (lambda: primitives.line([0.5, 1.1, 0.6]), {"command": "line", "target": [0.5, 1.1, 0.6]}),
        (lambda: primitives.move(0.5, 1.7, 1.6), {"command": "move", "joints": [0.5, 1.7, 1.6]}),
        (lambda: primitives.move("shelf"), {"command": "move", "joints": "shelf"}),
        (lambda: primitives.gripper("close"), {"command": "gripper", "open": False}),
    ],
)
def test_primitives_are_sent_in_the_form_of_the_service(command: Callable[[], Plan[JobReport]], body: object) -> None:
    player = Player(Service(ended()))
    player.perform(command())
    (post,) = [request for request in player.asked if request.method == "POST"]
    assert (post.path, post.body) == ("/v1/tasks", body)


def test_the_gripper_is_opened_or_closed_and_nothing_else() -> None:
    with pytest.raises(InvalidValue, match="'open' or 'close'"):
        Player(Service()).perform(primitives.gripper("ajar"))  # type: ignore[arg-type]


def test_stop_waits_for_nothing_and_is_repeated_after_a_broken_connection() -> None:
    answers: list[Any] = [ServiceNotAnswering(reason="stale"), "stopping"]
    player = Player(lambda _: answers.pop(0))
    assert player.perform(robot.stop()) == "stopping"
    assert player.paths == ["POST /v1/stop"] * 2
    assert all(request.urgent for request in player.asked)
    assert player.now == 0.0


def test_stop_without_a_service_is_reported_at_once() -> None:
    player = Player(lambda _: ServiceNotRunning())
    with pytest.raises(ServiceNotRunning):
        player.perform(robot.stop())
    assert len(player.asked) == 1


def test_a_lease_is_renewed_well_before_it_ends_until_it_is_lost() -> None:
    answers: list[Any] = [NOBODY, NOBODY, LeaseLost(reason="broken")]
    times: list[float] = []
    held = HeldLease()
    held.begin("id 1")
    player = Player(lambda _: (times.append(player.now), answers.pop(0))[1])
    player.perform(resources.kept(held, LeaseTaken("id 1", "ana", "", 9.0)))
    assert times == pytest.approx([3.0, 6.0, 9.0])
    with pytest.raises(LeaseLost, match="broken"):
        held.require()
    held.require()


def test_a_service_that_does_not_answer_has_ended_the_lease_when_its_time_is_over() -> None:
    held = HeldLease()
    held.begin("id 1")
    player = Player(lambda _: ServiceNotAnswering(reason="cut"))
    player.perform(resources.kept(held, LeaseTaken("id 1", "ana", "", 9.0)))
    assert player.now == pytest.approx(9.0, abs=0.1)
    with pytest.raises(LeaseLost, match="could not be renewed"):
        held.require()


def test_lease_taken_by_another_is_lost() -> None:
    held = HeldLease()
    held.begin("id 1")
    player = Player(lambda _: LeaseHeld(holder="berta", since="3 s"))
    player.perform(resources.kept(held, LeaseTaken("id 1", "ana", "", 9.0)))
    with pytest.raises(LeaseLost, match="berta"):
        held.require()


def test_the_history_is_read_page_after_page() -> None:
    pages = [[replace(LINE, id=number) for number in range(300, 200, -1)], [replace(LINE, id=9)]]
    player = Player(lambda _: pages.pop(0))
    found = player.items(jobs.every(owner="ana"), 1000)
    assert [line.id for line in found] == [*range(300, 200, -1), 9]
    assert [request.query.get("below") for request in player.asked] == [None, 201]
    assert {request.query["owner"] for request in player.asked} == {"ana"}


def test_queue_requests() -> None:
    player = Player(lambda _: RUNNING)
    player.perform(requests.pause_queue("now"))
    player.perform(requests.choose_recovery("redo", holding=False, resume_queue=False))
    player.perform(requests.choose_recovery("abort"))
    player.perform(requests.move_job(3, before=5))
    player.perform(resources.change(3, priority=7, job={"steps": ["home"]}))
    player.perform(requests.repeat_job(3, from_step=2))
    assert [(request.path, request.body) for request in player.asked] == [
        ("/v1/queue/pause", {"when": "now"}),
        ("/v1/queue/recovery", {"choice": "redo", "resume_queue": False, "holding": False}),
        ("/v1/queue/recovery", {"choice": "abort"}),
        ("/v1/jobs/3/move", {"before": 5}),
        ("/v1/jobs/3", {"priority": 7, "job": {"steps": ["home"]}}),
        ("/v1/jobs/3/again", {"from_step": 2}),
    ]
    assert player.perform(resources.recovery()) is None
