from __future__ import annotations

import pytest
from starlette.requests import HTTPConnection

from maya_un.http.connections import is_local, source_of


def connection(address: str | None, **headers: str) -> HTTPConnection:
    """Return a connection from an address."""
    shown = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return HTTPConnection({"type": "http", "headers": shown, "client": None if address is None else (address, 1)})


@pytest.mark.parametrize(
    ("address", "local"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("192.168.1.5", False),
        ("2001:db8::1", False),
        ("x", False),
    ],
)
def test_this_machine_is_known_by_its_address(address: str, local: bool) -> None:
    assert is_local(connection(address)) is local
    assert source_of(connection(address)) == address


def test_client_without_an_address_is_not_local() -> None:
    assert not is_local(connection(None))
    assert source_of(connection(None)) == ""


@pytest.mark.parametrize("header", ["forwarded", "x_forwarded_for", "x_real_ip"])
def test_forwarded_request_is_not_local(header: str) -> None:
    assert not is_local(connection("127.0.0.1", **{header: "127.0.0.1"}))
