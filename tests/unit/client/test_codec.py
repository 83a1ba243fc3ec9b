"""Requests as bytes and answers as values."""

from __future__ import annotations

import json
from typing import Any

import httpx
import pytest

from maya_un.client import transport
from maya_un.client.request import Request, get
from maya_un.client.transport import ServiceAddress
from maya_un.errors import (
    Busy,
    InternalError,
    InvalidRequest,
    ServiceNotAnswering,
    StreamLagging,
    UnknownName,
)
from maya_un.schema.jobs import JobAccepted
from maya_un.values import Point

OURS = {"Maya": "0.1.0"}
SERVICE = ServiceAddress("http://127.0.0.1:4133")


def test_request_goes_to_its_path_with_its_credentials() -> None:
    request = Request("POST", "/v1/jobs", JobAccepted, {"held": True, "notes": "a b"}, {"steps": ["home"]}, key="k1")
    url, headers, content = transport.encoded(request, ServiceAddress(SERVICE.url, "maya_t"), "lease 1")
    assert url == "http://127.0.0.1:4133/v1/jobs?held=true&notes=a+b"
    assert headers["Authorization"] == "Bearer maya_t"
    assert headers["Maya-Lease"] == "lease 1"
    assert headers["Idempotency-Key"] == "k1"
    assert json.loads(content) == {"steps": ["home"]}


@pytest.mark.parametrize("token", ["maya_é", "maya_t\n", "maya_t\r\nMaya-Lease: 1"])
def test_token_that_a_header_cannot_carry_is_refused_and_not_repeated(token: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        transport.encoded(get("/v1/status", int), ServiceAddress(SERVICE.url, token), "")
    assert refused.value.details["key"] == "token"
    assert "maya_" not in str(refused.value)


def test_own_lease_takes_precedence_over_that_of_the_shell() -> None:
    service = ServiceAddress("http://robot:1", "", "shell")
    assert transport.encoded(get("/", int), service, "own").headers["Maya-Lease"] == "own"
    assert transport.encoded(get("/", int), service, "").headers["Maya-Lease"] == "shell"


def test_missing_parameter_is_omitted_and_several_values_repeat_the_key() -> None:
    url, headers, content = transport.encoded(
        get("/v1/jobs", int, owner=None, state=("done", "failed"), below=7), SERVICE, ""
    )
    assert url.endswith("/v1/jobs?state=done&state=failed&below=7")
    assert not {"Authorization", "Maya-Lease", "Idempotency-Key", "Content-Type"} & headers.keys()
    assert content == b""


def test_an_answer_is_read_as_the_message_that_it_is() -> None:
    found = transport.decoded(get("/", JobAccepted), 202, OURS, b'{"id": 7, "name": "x", "steps": 2, "newer": true}')
    assert found == JobAccepted(7, "x", 2)
    assert transport.decoded(get("/", Point), 200, OURS, b"[1.0, 2, 3.5]") == Point(1.0, 2.0, 3.5)
    assert transport.decoded(get("/", type(None)), 200, OURS, b'{"aborted": true}') is None


def test_a_refusal_comes_back_as_the_error_it_is_with_its_details() -> None:
    problem = {"code": 4003, "details": {"name": "cub", "known": "cube"}, "detail": "…"}
    with pytest.raises(UnknownName, match=r"There is no 'cub'\. Known: cube") as caught:
        transport.decoded(get("/", int), 422, OURS, json.dumps(problem).encode())
    assert caught.value.details == {"name": "cub", "known": "cube"}
    assert "'cub'" in caught.value.text("es")


@pytest.mark.parametrize(
    "content",
    [
        b"<html>",
        b"[]",
        b'{"code": 1}',
        b'{"code": 999999, "details": {}}',
        b"\xff",
        b'{"code": 1e400, "details": {}}',
        b"[" * 100_000,
    ],
)
def test_unintelligible_refusal_is_no_answer(content: bytes) -> None:
    with pytest.raises(ServiceNotAnswering, match="not understood"):
        transport.decoded(get("/", int), 500, OURS, content)


def test_other_program_at_an_old_port_is_detected() -> None:
    with pytest.raises(ServiceNotAnswering, match="another program"):
        transport.decoded(get("/", int), 200, {"server": "nginx"}, b"1")


@pytest.mark.parametrize("text", ['{"type": "error", "code": 1e400, "details": {}}', "[" * 100_000])
def test_unintelligible_message_is_no_answer(text: str) -> None:
    with pytest.raises(ServiceNotAnswering, match="not understood"):
        transport.decoded_message(text)


def test_content_that_cannot_be_unpacked_is_no_answer() -> None:
    with pytest.raises(ServiceNotAnswering, match="incorrect header"), transport.translated():
        raise httpx.DecodingError("incorrect header check")


def test_answer_of_another_kind_is_no_answer() -> None:
    with pytest.raises(ServiceNotAnswering, match="not understood"):
        transport.decoded(get("/", JobAccepted), 200, OURS, b'{"id": "seven"}')


def test_the_error_of_a_report_has_its_sentence() -> None:
    error = transport.as_error(2104, "The robot is busy (job 3). Wait until it is done.")
    assert isinstance(error, Busy)
    assert str(error) == "The robot is busy (job 3). Wait until it is done."
    assert isinstance(transport.as_error(5999, "It broke."), InternalError)
    assert "new words" in str(transport.as_error(4999, "new words"))


def test_messages_of_the_websocket() -> None:
    assert transport.decoded_message('{"type": "pong"}') == {"type": "pong"}
    lagging: dict[str, Any] = {"type": "error", "code": 4016, "message": "…", "details": {"behind": 9, "since": 3}}
    with pytest.raises(StreamLagging):
        transport.decoded_message(json.dumps(lagging))
    with pytest.raises(ServiceNotAnswering):
        transport.decoded_message("[]")
    assert transport.stream_url(ServiceAddress("https://robot:4133"), "/v1/stream") == "wss://robot:4133/v1/stream"
