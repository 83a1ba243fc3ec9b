from __future__ import annotations

import pytest
from starlette.datastructures import Headers

from maya_un.errors import InvalidValue
from maya_un.http.origins import OriginPolicy, host_of, origin_of

PANEL = "https://panel.example.org"
REMOTE = OriginPolicy(remote=True, hosts=frozenset({"maya", "panel.example.org"}), origins=frozenset({PANEL}))


def refused(edge: OriginPolicy, host: str, origin: str | None = None) -> str | None:
    """Return which header keeps a request out, None where none does."""
    headers = {"host": host} | ({} if origin is None else {"origin": origin})
    refusal = edge.refusal(Headers(headers))
    return None if refusal is None else str(refusal.details["key"])


@pytest.mark.parametrize("host", ["localhost:4133", "127.0.0.1", "[::1]:4133", "LOCALHOST"])
def test_loopback_has_its_own_names(host: str) -> None:
    assert refused(OriginPolicy(), host) is None
    assert refused(REMOTE, host) is None


@pytest.mark.parametrize("host", ["", "maya", "evil.example.org", "192.168.1.5:4134", "[::1", "localhost:x"])
def test_without_other_machines_no_other_name_is_good(host: str) -> None:
    assert refused(OriginPolicy(), host) == "Host"


@pytest.mark.parametrize("host", ["maya:4134", "MAYA", "192.168.1.5:4134", "[2001:db8::1]:4134"])
def test_other_machines_know_the_robot_by_its_names_and_addresses(host: str) -> None:
    assert refused(REMOTE, host) is None


def test_foreign_name_that_resolves_to_us_is_refused() -> None:
    assert refused(REMOTE, "evil.example.org:4134") == "Host"


@pytest.mark.parametrize(
    ("host", "origin", "key"),
    [
        ("localhost:4133", "http://localhost:4133", None),
        ("[::1]:4133", "http://[::1]:4133", None),
        ("localhost", "http://localhost", None),
        ("localhost:4133", "http://localhost:3000", "Origin"),
        ("localhost:4133", "http://localhost", "Origin"),
        ("localhost:4133", "http://127.0.0.1:4133", "Origin"),
        ("maya:4134", "http://localhost:4134", "Origin"),
        ("maya:4134", PANEL, None),
        ("maya:4134", "http://panel.example.org", "Origin"),
        ("maya:4134", "http://maya:4134", None),
        ("maya:4134", "http://maya:9999", "Origin"),
        ("maya:4134", "https://evil.example.org", "Origin"),
        ("maya:4134", "null", "Origin"),
        ("maya:4134", "", "Origin"),
        ("maya:4134", "http://[::1", "Origin"),
    ],
)
def test_pages_may_command_that_are_ours_or_listed(host: str, origin: str, key: str | None) -> None:
    assert refused(REMOTE, host, origin) == key


def test_without_other_machines_only_pages_of_the_service_may_command() -> None:
    assert refused(OriginPolicy(), "127.0.0.1:4133", "http://127.0.0.1:4133") is None
    assert refused(OriginPolicy(), "127.0.0.1:4133", "http://127.0.0.1:4134") == "Origin"


def test_an_origin_is_written_as_a_browser_sends_it() -> None:
    assert origin_of("https://Panel.Example.org/") == PANEL
    assert origin_of("http://10.0.0.1:8080") == "http://10.0.0.1:8080"
    assert host_of(PANEL) == "panel.example.org"


@pytest.mark.parametrize(
    "text", ["panel.example.org", "ftp://x", "https://", "https://x/page", "https://u@x", "http://["]
)
def test_invalid_origin_is_refused(text: str) -> None:
    with pytest.raises(InvalidValue):
        origin_of(text)
