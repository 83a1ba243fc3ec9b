"""Half-open connections in a process that may open few files: stop is answered, nothing is flooded with tracebacks."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.system.processes import Process, Wire

pytestmark = pytest.mark.system

HALF_OPEN = 100
PATIENCE = 10.0
"""Before, a stop took more than 25 s [s]."""

MOST_LOGGED = 20_000
"""Before, tracebacks of many megabytes were written [bytes]."""

BEGUN = {
    "silent": b"",
    "half a request": b"GET /v1/sta",
    "half a websocket": b"GET /v1/stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n",
}


@contextlib.contextmanager
def limited(limit: int, line: str) -> Iterator[Process]:
    """Run a command that may open so many files, hard limit included."""
    process = Process(line, before=("sh", "-c", f'ulimit -n {limit}; exec "$0" "$@"'))
    try:
        yield process
    finally:
        process.kill()


@contextlib.contextmanager
def half_open(address: tuple[str, int], said: bytes) -> Iterator[list[socket.socket]]:
    """Open connections that never say all of their request."""
    with contextlib.ExitStack() as opened:
        lines: list[socket.socket] = []
        for _ in range(HALF_OPEN):
            line = opened.enter_context(socket.socket())
            line.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                line.connect(address)
            lines.append(line)
        for line in lines:
            with contextlib.suppress(OSError):
                line.send(said)
        yield lines


def address_in(line: str) -> tuple[str, int]:
    found = re.search(r"([0-9.]+):([0-9]+)", line)
    assert found is not None
    return found[1], int(found[2])


def stopped(address: tuple[str, int]) -> int:
    line = http.client.HTTPConnection(*address, timeout=PATIENCE)
    try:
        line.request("POST", "/v1/stop")
        return line.getresponse().status
    finally:
        line.close()


@pytest.fixture(autouse=True)
def own_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("MAYA_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "run"))
    return tmp_path


@pytest.mark.parametrize("limit", [40, 48, 64])
@pytest.mark.parametrize("said", BEGUN)
def test_stop_with_descriptors_used_up_is_answered(limit: int, said: str, own_folders: Path) -> None:
    with limited(limit, "up --port 0") as service:
        address = address_in(service.until("http://"))
        with half_open(address, BEGUN[said]):
            assert [stopped(address) for _ in range(5)] == [200] * 5
        log = own_folders / "state" / "maya.log"
        assert log.stat().st_size < MOST_LOGGED
        said_of_it = [line for line in log.read_text().splitlines() if "maya.connections" in line]
        assert len(said_of_it) == 1
        assert "Traceback" not in log.read_text()


def test_stop_with_rosbridge_flooded_is_answered(own_folders: Path) -> None:
    with limited(48, "up --port 0 --rosbridge-port 0") as service:
        announced = service.until("http://")
        rosbridge = address_in(service.until("ws://"))
        with half_open(rosbridge, b"GET / HTTP/1.1\r\n"):
            assert stopped(address_in(announced)) == 200
    log = own_folders / "state" / "maya.log"
    assert not log.exists() or log.stat().st_size < MOST_LOGGED


def test_served_twin_with_descriptors_used_up_answers_its_host_and_its_faults() -> None:
    with limited(32, "dmc serve --port 0 --json") as twin:
        address = address_in(twin.until('"address"'))
        control = ("127.0.0.1", int(twin.until('"control"').split(": ")[1].rstrip(",")))
        with Wire(f"{address[0]}:{address[1]}") as host, half_open(address, b"MG"), half_open(control, b'{"clear"'):
            assert host.numbers("1+1") == [2.0]
            with socket.create_connection(control, timeout=PATIENCE) as line:
                line.sendall(b"{}\n")
                assert json.loads(line.recv(1000)) == {"active": []}
        twin.send(2)  # type: ignore[arg-type]
        code, rest = twin.end()
        assert code in (0, 130)
        assert len(rest) < 1000


def test_service_with_too_few_descriptors_names_the_limit_to_raise() -> None:
    with limited(16, "up --port 0") as service:
        code, said = service.end()
    assert code == 2
    assert "5013" in said
    assert "ulimit -n" in said
