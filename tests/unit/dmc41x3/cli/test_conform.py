"""`maya dmc conform`: against a small controller with known answers, and against what is none."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import pytest

from dmc41x3.cli import conform
from dmc41x3.conformance import Demand, Vector
from dmc41x3.conformance.vectors import Special, VectorStep
from tests.ports import free_port

Run = Callable[[Sequence[str]], int]

RIGHT = Vector("right", (VectorStep("NO\r", (":",)),), "G", "one", group="g")
WRONG = Vector("wrong", (VectorStep("NO\r", ("?", "x")),), "GE", "two", group="g")
MOVES = Vector("moves", (VectorStep("BG\r", (":",)),), "G", "one", demands=frozenset({Demand.MOVES}), group="g")
BURNS = Vector("burns", (VectorStep("BN\r", (":",)),), "G", "one", demands=frozenset({Demand.BURNS}), group="g")
CUT = Vector("cut", (VectorStep("IH\r", on="b"), VectorStep(on="b", special=Special.CLOSED)), "G", "one", group="g")
TALL = Vector("tall", (VectorStep("NO\r", ("?",)),), "G", "one", axes=(4, 8), group="g")


def reply(command: bytes) -> bytes | None:
    """Return the answer of a small controller of three axes; None ends the connection."""
    fixed = {b"MG _BV{F1.0}": b" 3\r\n:", b'MG "fence"': b"fence\r\n:", b"IH": None, b"TC": b" 0\r\n:"}
    rest = {b"MG _BGA|_BGB|_BGC": b" 0.0000\r\n:", b"MG _BGA|_BGB|_BGC{F1.0}": b" 0\r\n:"}
    return (fixed | rest).get(command, b":")


@contextmanager
def small_controller(says: bytes | None = None) -> Iterator[int]:
    """Serve any number of connections while the block runs; `says` is the answer to everything, if given."""

    def talk(connection: socket.socket) -> None:
        with connection:
            waiting = b""
            while data := connection.recv(1024):
                # A semicolon ends a command, and a backslash a download.
                *lines, waiting = (waiting + data).replace(b"\\", b"\r").replace(b";", b"\r").split(b"\r")
                for line in lines:
                    answer = says if says is not None else reply(line)
                    if answer is None:
                        return
                    connection.sendall(answer)

    def serve() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            thread = threading.Thread(target=talk, args=(connection,))
            threads.append(thread)
            thread.start()

    threads: list[threading.Thread] = []
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = threading.Thread(target=serve)
        server.start()
        try:
            yield listener.getsockname()[1]
        finally:
            listener.shutdown(socket.SHUT_RDWR)
            server.join()
            for thread in threads:
                thread.join()


@pytest.fixture
def table(monkeypatch: pytest.MonkeyPatch) -> list[Vector]:
    vectors = [RIGHT, MOVES, BURNS, CUT, TALL]
    monkeypatch.setattr(conform, "load", lambda: tuple(vectors))
    return vectors


def test_a_controller_without_differences_is_0(
    run: Run, table: list[Vector], capsys: pytest.CaptureFixture[str]
) -> None:
    with small_controller() as port:
        assert run(["conform", f"127.0.0.1:{port}"]) == 0
    assert capsys.readouterr().out.startswith("2 answers are right, 0 differ. 2 checks were skipped")


@pytest.mark.waits("3 s with --bench: what does not come is awaited for 1 s each time, on a real socket")
@pytest.mark.parametrize(("options", "asked"), [([], 2), (["--moves"], 3), (["--bench"], 4)])
def test_no_more_than_allowed_is_sent(
    run: Run, table: list[Vector], options: list[str], asked: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_controller() as port:
        assert run(["conform", f"127.0.0.1:{port}", "--json", *options]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["axes"], report["right"], report["differences"]) == (3, asked, [])
    assert sum(report["left_out"].values()) == 4 - asked


@pytest.mark.waits("2 s: twice, an answer that does not come is awaited for 1 s, on a real socket")
def test_difference_exits_with_1_and_shows_its_source(
    run: Run, table: list[Vector], capsys: pytest.CaptureFixture[str]
) -> None:
    table.append(WRONG)
    with small_controller() as port:
        assert run(["conform", f"127.0.0.1:{port}"]) == 1
        lines = capsys.readouterr().out.splitlines()
        assert run(["conform", f"127.0.0.1:{port}", "--json"]) == 1
        (found,) = json.loads(capsys.readouterr().out)["differences"]
    assert lines[0] == "g: wrong"
    assert [line.split()[0] for line in lines[1:4]] == ["sent", "expected", "'x'"]
    assert lines[4].split() == ["received", "':'"]
    assert "EPICS" in lines[5]
    assert lines[5].endswith("(two sources)")
    assert lines[6].startswith("2 answers are right, 1 differ.")
    assert (found["name"], found["expected"], found["received"], found["certainty"]) == (
        "wrong",
        ["?", "x"],
        ":",
        "two",
    )


def test_missing_controller(run: Run, table: list[Vector], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["conform", f"127.0.0.1:{free_port()}"]) == 1
    assert "1002" in capsys.readouterr().err


def test_something_that_says_nothing(
    run: Run, table: list[Vector], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(conform, "PATIENCE", 0.05)
    with small_controller(says=b"") as port:
        assert run(["conform", f"127.0.0.1:{port}"]) == 1
    assert "1003" in capsys.readouterr().err


@pytest.mark.parametrize("says", [b"?", b"220 ready\r\n:", b" 9.0000\r\n:", b":"])
def test_something_else(run: Run, table: list[Vector], says: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    with small_controller(says=says) as port:
        assert run(["conform", f"127.0.0.1:{port}"]) == 1
    assert "1005" in capsys.readouterr().err


def test_a_refused_connection_is_at_its_end() -> None:
    channel = conform.TcpChannel("127.0.0.1", free_port())
    channel.send(b"NO\r")
    assert (channel.connected, channel.ended(), channel.receive()) == (False, True, b"")
    assert channel.reason
