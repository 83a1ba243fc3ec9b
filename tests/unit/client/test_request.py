"""Requests as values: their paths, their queries, and the values that they leave out."""

from __future__ import annotations

import subprocess
import sys

import httpx
import pytest

import maya_un.client
from maya_un.client import requests
from maya_un.client.request import Request, changed, get
from maya_un.errors import InvalidValue


def test_a_request_without_options_has_no_query() -> None:
    assert requests.submit({"steps": ["home"]}).target == "/v1/jobs"
    assert requests.jobs().target == "/v1/jobs"
    assert requests.take_lease().body == {}


def test_options_that_differ_from_their_defaults_are_sent() -> None:
    request = requests.submit({}, priority=-1, held=True, depends_on=[3, 4], notes="a&b")
    assert request.target == "/v1/jobs?priority=-1&held=true&depends_on=3&depends_on=4&notes=a%26b"
    assert requests.jog_by("x", 0.1, clip=False).body == {"axis": "x", "distance": 0.1, "clip": False}


def test_an_empty_text_is_sent_unless_it_is_the_default() -> None:
    assert requests.jobs(owner="").target == "/v1/jobs?owner="
    assert requests.jobs(text="").target == "/v1/jobs"
    assert requests.change_user("ana", password="").body == {"password": ""}


def test_a_value_of_another_type_than_its_default_is_sent_for_the_service_to_judge() -> None:
    assert changed({"retries": (False, 0), "wait": (0, 0.0), "held": (0, False)}) == {
        "retries": False,
        "wait": 0,
        "held": 0,
    }


def test_an_empty_list_is_left_out() -> None:
    assert changed({"state": ([], ()), "depends_on": ((), ())}) == {}
    assert changed({"state": (["done"], ())}) == {"state": ["done"]}


def test_a_name_is_one_part_of_the_path() -> None:
    assert requests.pose("a/b c?ñ\udc80").path == "/v1/poses/a%2Fb%20c%3F%C3%B1%ED%B2%80"


@pytest.mark.parametrize(
    ("name", "path"), [(".", "/v1/users/%2E"), ("..", "/v1/users/%2E%2E"), ("...", "/v1/users/...")]
)
def test_a_name_of_dots_is_no_step_of_the_path(name: str, path: str) -> None:
    request = requests.remove_user(name)
    assert request.path == path
    assert httpx.URL("http://localhost" + request.target).raw_path == path.encode()


@pytest.mark.parametrize("key", ["é", "🤖", "a\r\nMaya-Lease: b", "a\x00", " ", "a ", "\ud800"])
def test_a_key_that_no_header_can_carry_is_refused(key: str) -> None:
    with pytest.raises(InvalidValue, match=r"key = .* printable ASCII"):
        requests.submit({"steps": ["home"]}, key=key)


def test_a_changed_wait_leaves_the_rest_as_it_was() -> None:
    request = Request("POST", "/v1/x", int, {"a": 1}, {"b": 2}, key="k")
    other = request.within(0.5).urgently()
    assert (other.timeout, other.urgent) == (0.5, True)
    assert (request.timeout, request.urgent) == (10.0, False)
    assert (other.method, other.target, other.answer, other.body, other.key) == (
        "POST",
        "/v1/x?a=1",
        int,
        {"b": 2},
        "k",
    )
    assert repr(get("/v1/x", int, wait=0.5)) == "<GET /v1/x?wait=0.5 None>"


def test_requests_load_neither_messages_nor_slow_modules() -> None:
    look = "import sys; from maya_un.client import requests; requests.status(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=True).stdout.split()
    ours = {name for name in loaded if name.startswith("maya_un")}
    assert ours == {"maya_un", "maya_un.client", "maya_un.client.request", "maya_un.client.requests"}
    assert not {"dataclasses", "inspect", "pydantic", "httpx", "numpy"} & set(loaded)


def test_every_public_name_is_found_and_others_are_not() -> None:
    for name in maya_un.client.__all__:
        assert getattr(maya_un.client, name).__name__ == name
        assert name in dir(maya_un.client)
    assert not hasattr(maya_un.client, "Cliente")
