"""Listeners and their limits: real sockets, so these tests run in real loops and threads."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import json
import socket
import ssl
import subprocess
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import Any, TypeVar, cast

import pytest

from dmc41x3.listening import STOPS
from dmc41x3.loops import run
from maya_un.errors import AddressInUse, FileUnreadable, InvalidValue
from maya_un.http import protocol
from maya_un.http.app import create_app
from maya_un.http.bridge import Bridge
from maya_un.http.origins import OriginPolicy
from maya_un.http.protocol import ConnectionSlots
from maya_un.http.sockets import LOOPBACK, ListeningSocket, bound_socket, far_socket, tls_of
from maya_un.http.thread import served
from maya_un.service.service import Service
from tests.unit.http.service_stand_in import ServiceStandIn
from tests.waiting import eventually

T = TypeVar("T")


def serving(
    work: Callable[[str], T],
    *far: ListeningSocket,
    near: ListeningSocket | None = None,
    service: ServiceStandIn | None = None,
) -> T:
    """Return the result of `work` in another thread while a server listens; it gets the URL of the first listener."""

    async def main() -> T:
        loop = asyncio.get_running_loop()
        app = create_app(Bridge(loop, cast("Service", service)), OriginPolicy(remote=True))
        listener = near or ListeningSocket(bound_socket(0))
        async with served(app, listener, *far) as url:
            return await loop.run_in_executor(None, work, url)

    return run(main())


def connected(url: str) -> socket.socket:
    """Return a connection to a server."""
    host, _, port = url.rpartition("//")[2].rpartition(":")
    return socket.create_connection((host, int(port)), timeout=10.0)


def health(connection: http.client.HTTPConnection) -> tuple[int, Any]:
    """Return the description of the server, and disconnect."""
    try:
        connection.request("GET", "/v1/health")
        response = connection.getresponse()
        return response.status, json.loads(response.read())
    finally:
        connection.close()


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("tls")
    cert, key = folder / "cert.pem", folder / "key.pem"
    made = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    named = ["-subj", "/CN=maya", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)]
    subprocess.run([*made, *named], check=True, capture_output=True)
    return cert, key


def test_one_listener_uses_tls_and_the_other_does_not(certificate: tuple[Path, Path]) -> None:
    far = far_socket(LOOPBACK, 0, tls_of(*certificate))
    trusting = ssl.create_default_context(cafile=str(certificate[0]))

    def ask(url: str) -> tuple[tuple[int, Any], tuple[int, Any]]:
        near = http.client.HTTPConnection(url.removeprefix("http://"), timeout=10.0)
        secure = http.client.HTTPSConnection(far.url.removeprefix("https://"), timeout=10.0, context=trusting)
        return health(near), health(secure)

    assert far.url.startswith("https://127.0.0.1:")
    near, secure = serving(ask, far)
    assert near == secure
    assert near[0] == 200


def test_old_tls_is_not_spoken(certificate: tuple[Path, Path]) -> None:
    assert tls_of(*certificate).minimum_version == ssl.TLSVersion.TLSv1_2


@pytest.mark.parametrize("broken", ["missing", "no certificate", "another's key"])
def test_invalid_certificate_is_reported_at_once(broken: str, certificate: tuple[Path, Path], tmp_path: Path) -> None:
    cert, key = certificate
    if broken == "missing":
        cert = tmp_path / "nowhere.pem"
    elif broken == "no certificate":
        cert = tmp_path / "text.pem"
        cert.write_text("text")
    else:
        key = tmp_path / "key.pem"
        subprocess.run(["openssl", "genrsa", "-out", str(key), "2048"], check=True, capture_output=True)
    with pytest.raises(FileUnreadable):
        tls_of(cert, key)


def test_key_with_a_password_prompts_for_none(certificate: tuple[Path, Path], tmp_path: Path) -> None:
    key = tmp_path / "key.pem"
    line = ["openssl", "ec", "-in", str(certificate[1]), "-out", str(key), "-aes128", "-passout", "pass:secret"]
    subprocess.run(line, check=True, capture_output=True)
    with pytest.raises(FileUnreadable, match="password"):
        tls_of(certificate[0], key)


def test_taken_port_and_foreign_address_are_refused() -> None:
    with bound_socket(0) as listener, pytest.raises(AddressInUse):
        listener.listen()
        bound_socket(listener.getsockname()[1])
    with pytest.raises(InvalidValue):
        bound_socket(0, "192.0.2.1")
    with pytest.raises(InvalidValue):
        bound_socket(0, "no.such.host.invalid")


def test_a_port_is_taken_from_the_instant_it_is_given_also_before_anybody_is_served() -> None:
    with bound_socket(0) as first, pytest.raises(AddressInUse):
        bound_socket(first.getsockname()[1])


def test_listener_limits_connections_per_address_and_in_all() -> None:
    places = ConnectionSlots(most=3, most_each=2)
    assert [places.take(address) for address in ("a", "a", "a", "b", "c")] == [True, True, False, True, False]
    places.give_back("a")
    assert [places.take(address) for address in ("c", "a")] == [True, False]


def test_full_listener_does_not_block_the_other() -> None:
    far = ListeningSocket(bound_socket(0), most=2, most_each=2)

    def ask(url: str) -> tuple[int, int]:
        idle = [connected(far.url) for _ in range(2)]
        one_more, _ = health(http.client.HTTPConnection(far.url.removeprefix("http://"), timeout=10.0))
        status, _ = health(http.client.HTTPConnection(url.removeprefix("http://"), timeout=10.0))
        for connection in idle:
            connection.close()
        return one_more, status

    assert serving(ask, far) == (503, 200)


@pytest.mark.parametrize(
    "said", [b"", b"GET /v1/sta", b"POST /v1/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\n"]
)
def test_stop_is_served_however_many_connections_there_are(said: bytes) -> None:
    near = ListeningSocket(bound_socket(0), most=4, most_each=4)
    service = ServiceStandIn()

    def ask(url: str) -> list[int]:
        host = url.removeprefix("http://")
        idle = [connected(url) for _ in range(4 + 2 * STOPS)]
        for connection in idle:
            with contextlib.suppress(OSError):
                connection.sendall(said)
        answers: list[int] = []
        for path in ("/v1/stop", "/v1/abort", "/v1/status"):
            line = http.client.HTTPConnection(host, timeout=10.0)
            line.request("POST", path)
            answers.append(line.getresponse().status)
            line.close()
        for connection in idle:
            connection.close()
        return answers

    assert serving(ask, near=near, service=service) == [200, 200, 503]
    assert [what for what, *_ in service.asked] == ["stop", "abort"]


def test_silent_connection_beyond_the_limit_is_closed_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "STOP_PATIENCE", 0.05)
    near = ListeningSocket(bound_socket(0), most=1, most_each=1)

    def ask(url: str) -> bytes:
        with connected(url), connected(url) as silent:
            try:
                return silent.recv(1)
            except ConnectionResetError:
                return b""

    assert serving(ask, near=near) == b""


def test_a_place_is_free_again_after_its_connection() -> None:
    near = ListeningSocket(bound_socket(0), most=1, most_each=1)

    def ask(url: str) -> list[int]:
        answers: list[int] = []
        for _ in range(5):
            with connected(url) as line:
                line.sendall(b"GET /v1/health HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                said = b""
                while part := line.recv(4096):
                    said += part
            answers.append(int(said[9:12]))
        return answers

    assert serving(ask, near=near) == [200] * 5


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="this system has no TCP_USER_TIMEOUT")
@pytest.mark.waits("about a second of the system's clock, by which it ends a connection that nobody reads")
def test_client_that_does_not_read_its_answer_loses_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "ANSWER_PATIENCE", 0.5)
    near = ListeningSocket(bound_socket(0), most=1, most_each=1)

    def ask(url: str) -> None:
        address = url.removeprefix("http://")
        host, _, port = address.rpartition(":")
        with socket.socket() as line:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            line.connect((host, int(port)))
            line.sendall(b"GET /v1/openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n")
            eventually(lambda: health(http.client.HTTPConnection(address))[0] == HTTPStatus.OK, "a free place")

    serving(ask, near=near)


@pytest.mark.parametrize("said", [b"", b"GET /v1/health HTTP/1.1\r\nHost: local", b"\x16\x03\x01"])
def test_incomplete_request_is_cut(said: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "HEAD_PATIENCE", 0.05)

    def ask(url: str) -> bytes:
        with connected(url) as line:
            line.sendall(said)
            try:
                return line.recv(4096)[:12]
            except ConnectionResetError:
                return b""

    assert serving(ask) in {b"", b"HTTP/1.1 400"}


def test_slow_second_request_is_cut_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "HEAD_PATIENCE", 0.2)

    def ask(url: str) -> bytes:
        with connected(url) as line:
            line.sendall(b"GET /v1/health HTTP/1.1\r\nHost: localhost\r\n\r\n")
            first = b""
            while not first.endswith(b"}"):
                first += line.recv(4096)
            line.sendall(b"GET /v1/heal")
            try:
                rest = line.recv(4096)
            except ConnectionResetError:
                rest = b""
            return first[:12] + rest

    assert serving(ask) == b"HTTP/1.1 200"


def test_invalid_http_is_refused_with_our_code() -> None:
    def ask(url: str) -> bytes:
        with connected(url) as line:
            line.sendall(b"TP\r\n\r\n")
            said = b""
            while part := line.recv(4096):
                said += part
        return said

    head, _, body = serving(ask).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400")
    assert b"content-type: application/problem+json" in head.lower()
    assert b"\r\nmaya: " in head.lower()
    assert json.loads(body)["code"] == 4005
