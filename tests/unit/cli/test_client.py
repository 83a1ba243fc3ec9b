from __future__ import annotations

import pytest

from maya_un import runtime
from maya_un.cli.client import Client
from maya_un.errors import CannotPause, NotFound, ServiceNotAnswering, ServiceNotRunning
from tests.ports import free_port
from tests.unit.cli.servers import hanging_service, http_service


def test_bodies_go_and_answers_come() -> None:
    with http_service(lambda method, path, body: (200, [method, path, body])) as url:
        client = Client(url)
        assert client.get("/a?b=1") == ["GET", "/a?b=1", None]
        assert client.post("/c", {"d": 1}) == ["POST", "/c", {"d": 1}]


def test_a_refusal_comes_back_as_the_error_it_is() -> None:
    error = NotFound(what="job", number=7)
    problem = {"code": error.code, "details": error.details}
    with http_service(lambda *_: (404, problem)) as url, pytest.raises(NotFound) as caught:
        Client(url).get("/")
    assert str(caught.value) == str(error)


def test_a_refusal_that_came_over_a_graph_keeps_its_words() -> None:
    problem = {"code": CannotPause.code, "details": {}, "detail": "This cannot be paused: nothing is under way."}
    with http_service(lambda *_: (409, problem)) as url, pytest.raises(CannotPause, match="nothing is under way"):
        Client(url).post("/v1/pause")


@pytest.mark.parametrize("answer", [b"<html>", {"code": 9999, "details": {}}, {"oops": 1}, [1]])
def test_an_answer_nobody_understands_is_none(answer: object) -> None:
    with http_service(lambda *_: (500, answer)) as url, pytest.raises(ServiceNotAnswering):
        Client(url).get("/")


def test_what_somebody_else_says_is_no_answer() -> None:
    with (
        http_service(lambda *_: (200, {"status": "ok"}), ours=False) as url,
        pytest.raises(ServiceNotAnswering, match="somebody else"),
    ):
        Client(url).get("/v1/health")


@pytest.mark.parametrize("url", ["http://[::1", "http://127.0.0.1:99999"])
def test_nobody_listens_at_what_is_no_address(url: str) -> None:
    with pytest.raises(ServiceNotRunning):
        Client(url)


def test_silence_ends() -> None:
    with hanging_service() as url, pytest.raises(ServiceNotAnswering):
        Client(url, timeout=0.01).get("/")


def test_nobody_there_is_not_running() -> None:
    with pytest.raises(ServiceNotRunning):
        Client(f"http://127.0.0.1:{free_port()}").get("/")


def test_without_a_runtime_file_nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runtime, "find", lambda: None)
    with pytest.raises(ServiceNotRunning):
        Client.find()
