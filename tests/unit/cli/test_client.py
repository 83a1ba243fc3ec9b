from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from maya_un import runtime
from maya_un.cli.client import ServiceClient
from maya_un.client import requests
from maya_un.errors import CannotPause, NotFound, ServiceNotAnswering, ServiceNotRunning
from tests.ports import free_port
from tests.unit.cli.servers import hanging_service, http_service
from tests.unit.client.service_stub import service


def test_bodies_are_sent_and_answers_received() -> None:
    with http_service(lambda method, path, body: (200, [method, path, body])) as url:
        client = ServiceClient(url)
        assert client.ask(requests.jobs(state=["done"], text="a b")) == ["GET", "/v1/jobs?state=done&text=a+b", None]
        assert client.ask(requests.speed(0.5)) == ["POST", "/v1/speed", {"ratio": 0.5}]


def test_an_idempotency_key_goes_along_and_no_empty_one() -> None:
    with service(lambda _: {"id": 7}) as stand:
        ServiceClient(stand.url).ask(requests.submit({"steps": ["home"]}, key="k1"))
        ServiceClient(stand.url).ask(requests.submit({"steps": ["home"]}))
    assert [asked.headers.get("idempotency-key") for asked in stand.asked] == ["k1", None]


def test_refusal_is_raised_as_its_error() -> None:
    error = NotFound(what="job", number=7)
    problem = {"code": error.code, "details": error.details}
    with http_service(lambda *_: (404, problem)) as url, pytest.raises(NotFound) as caught:
        ServiceClient(url).ask(requests.report(7))
    assert str(caught.value) == str(error)


def test_a_refusal_that_came_over_a_graph_keeps_its_words() -> None:
    problem = {
        "code": CannotPause.code,
        "details": {},
        "detail": "Maya cannot pause now: nothing moves. To stop the robot, run `maya stop`.",
    }
    with http_service(lambda *_: (409, problem)) as url, pytest.raises(CannotPause, match="nothing moves"):
        ServiceClient(url).ask(requests.pause())


@pytest.mark.parametrize("answer", [b"<html>", {"code": 9999, "details": {}}, {"oops": 1}, [1]])
def test_unintelligible_answer_is_no_answer(answer: object) -> None:
    with http_service(lambda *_: (500, answer)) as url, pytest.raises(ServiceNotAnswering):
        ServiceClient(url).ask(requests.report(7))


def test_answer_of_another_program_is_no_answer() -> None:
    with (
        http_service(lambda *_: (200, {"status": "ok"}), ours=False) as url,
        pytest.raises(ServiceNotAnswering, match="another program"),
    ):
        ServiceClient(url).ask(requests.health())


@pytest.mark.parametrize("url", ["http://[::1", "http://127.0.0.1:99999"])
def test_invalid_address_has_no_listener(url: str) -> None:
    with pytest.raises(ServiceNotRunning):
        ServiceClient(url)


def test_an_ordinary_answer_is_waited_for_as_long_as_the_client_says() -> None:
    with hanging_service() as url, pytest.raises(ServiceNotAnswering):
        ServiceClient(url, timeout=0.05).ask(requests.status())


def test_a_wait_that_is_given_counts_more_than_that_of_the_client() -> None:
    with hanging_service() as url, pytest.raises(ServiceNotAnswering):
        ServiceClient(url, timeout=60.0).ask(requests.clear_queue(), timeout=0.01)


def test_an_operation_that_takes_long_is_waited_for_longer_than_others() -> None:
    asked, over = threading.Event(), threading.Event()

    def late(*_: object) -> tuple[int, object]:
        asked.set()
        over.wait(60.0)
        return 200, {"mode": "running"}

    with http_service(late) as url, ThreadPoolExecutor(1) as pool:
        client = ServiceClient(url, timeout=0.05)
        answer = pool.submit(client.ask, requests.clear_queue())
        try:
            assert asked.wait(60.0)
            with pytest.raises(ServiceNotAnswering):
                client.ask(requests.status())  # it begins later and gives up earlier
        finally:
            over.set()
        assert answer.result(60.0) == {"mode": "running"}


def test_missing_service_is_not_running() -> None:
    with pytest.raises(ServiceNotRunning):
        ServiceClient(f"http://127.0.0.1:{free_port()}").ask(requests.status())


def test_without_a_runtime_file_nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runtime, "find", lambda: None)
    with pytest.raises(ServiceNotRunning):
        ServiceClient.find()
