from __future__ import annotations

import pytest
from starlette.datastructures import Headers

from maya_un.errors import InvalidValue
from maya_un.http.middleware import OriginPolicy, host_of, origin_of

PANEL = "https://panel.example.org"
REMOTE = OriginPolicy(remote=True, hosts=frozenset({"maya", "panel.example.org"}), origins=frozenset({PANEL}))


def refused(edge: OriginPolicy, host: str, origin: str | None = None, *, local: bool = True) -> str | None:
    """Return which header keeps a request out, None where none does."""
    headers = {"host": host} | ({} if origin is None else {"origin": origin})
    refusal = edge.refusal(Headers(headers), local=local)
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
    assert refused(REMOTE, host, local=False) is None


def test_foreign_name_that_resolves_to_us_is_refused() -> None:
    assert refused(REMOTE, "evil.example.org:4134", local=False) == "Host"


@pytest.mark.parametrize(
    ("origin", "local", "key"),
    [
        ("http://localhost:3000", True, None),
        ("http://localhost:3000", False, "Origin"),
        (PANEL, False, None),
        ("http://panel.example.org", False, "Origin"),
        ("http://maya:4134", False, None),
        ("http://maya:9999", False, "Origin"),
        ("https://evil.example.org", True, "Origin"),
        ("null", True, "Origin"),
        ("", True, "Origin"),
        ("http://[::1", True, "Origin"),
    ],
)
def test_pages_may_command_that_are_ours_or_listed(origin: str, local: bool, key: str | None) -> None:
    assert refused(REMOTE, "maya:4134", origin, local=local) == key


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
