"""`maya dmc serve` as foreign software meets it, and `maya dmc fault` from another terminal."""

from __future__ import annotations

import json
import os
import resource
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.language.record import decode
from tests.ports import free_port
from tests.system.processes import Process, done, running
from tests.system.robots import up

pytestmark = pytest.mark.system

PATIENCE = 20.0
"""Longest wait for bytes that must come [s]."""


@contextmanager
def served(options: str = "") -> Iterator[tuple[Process, tuple[str, int]]]:
    """Serve a bench at a free port while the block runs; yields the process and where it listens."""
    with running(f"dmc serve --bench --port 0 {options}") as process:
        host, _, port = process.until("127.0.0.1:").rpartition(":")
        yield process, (host, int(port))


class Line:
    """A socket, and whole replies."""

    def __init__(self, kind: socket.SocketKind, address: tuple[str, int]) -> None:
        self.socket = socket.socket(socket.AF_INET, kind)
        self.socket.settimeout(PATIENCE)
        self.socket.connect(address)

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def say(self, text: str, answer: str) -> None:
        """Send a line and take exactly the answer."""
        self.socket.sendall(text.encode() + b"\r")
        heard = b""
        while len(heard) < len(answer):
            more = self.socket.recv(4096)
            assert more, heard
            heard += more
        assert heard.decode() == answer

    def ended(self) -> bool:
        """Wait for the end of the connection; tell whether it came."""
        try:
            return self.socket.recv(1) == b""
        except ConnectionResetError:
            return True
        except TimeoutError:
            return False


def tcp(address: tuple[str, int]) -> Line:
    return Line(socket.SOCK_STREAM, address)


def udp(address: tuple[str, int]) -> Line:
    return Line(socket.SOCK_DGRAM, address)


def fault(words: str) -> list[str]:
    """Say `maya dmc fault`, and return the names of the faults that then last."""
    code, said = done(f"dmc fault {words} --json")
    assert code == 0, said
    return [one["fault"] for one in json.loads(said)["active"]]


def test_a_session_by_tcp_and_udp_on_two_ports() -> None:
    also = free_port()
    there = ("127.0.0.1", also)
    with served(f"--axes 4 --also-port {also}") as (_, address), ExitStack() as lines:
        first = lines.enter_context(tcp(address))
        first.say("\x12\x16", "DMC4143 Rev 1.3k\r\n:")
        first.say("x=5;WH", ":IHA\r\n:")
        second = lines.enter_context(tcp(there))  # of two that wait at two ports, either may come first
        second.say("MG x;WH", " 5.0000\r\n:IHB\r\n:")
        with udp(there) as third:
            third.say("MG x;WH", " 5.0000\r\n:IHC\r\n:")
            first.say("DR 8,2", ":")
            samples = [decode(third.socket.recv(400)).sample for _ in range(100)]
        assert [(late - early) % 65536 for early, late in pairwise(samples)] == [8] * 99
        first.say("DR 0;IHT=>-3", "::")
        assert second.ended()


def test_udp_can_be_disabled() -> None:
    with served("--no-udp --firmware Box") as (_, address), tcp(address) as line, udp(address) as deaf:
        line.say("\x12\x16", "Box\r\n:")
        deaf.socket.send(b"WH\r")
        with pytest.raises(ConnectionRefusedError):
            deaf.socket.recv(100)


def test_burned_settings_survive_the_process_and_others_do_not(tmp_path: Path) -> None:
    memory = tmp_path / "memory.json"
    with served(f"--memory {memory}") as (process, address), tcp(address) as line:
        line.say("SPA=2000;KPB=9;keep=7;BN;BV", ":" * 5)
        line.say("SPA=4000;keep=8", "::")
        process.kill()
    with served(f"--memory {memory}") as (process, address), tcp(address) as line:
        line.say("MG _SPA,_KPB,keep,_RS", " 2000.0000 9.0000 7.0000 0.0000\r\n:")
        process.send(signal.SIGTERM)
        assert line.ended()
        assert process.end()[0] == 0
    memory.write_text("nonsense", encoding="utf-8")
    with served(f"--memory {memory}") as (_, address), tcp(address) as line:
        line.say("MG _SPA,_RS;TC", " 25000.0000 7.0000\r\n: 14\r\n:")


def test_faults_from_another_terminal() -> None:
    with served() as (_, address), tcp(address) as line:
        line.say("SH;OE*=1;JGA=2000;BGA", "::::")
        assert fault("refuse_commands probability=1") == ["refuse_commands"]
        line.say("x=1", "?")
        assert fault("abort_input") == ["refuse_commands", "abort_input"]
        assert fault("--clear") == []
        line.say("MG x", "?")
        line.say("MG _MOA,_SCA,_AB", " 1.0000 6.0000 1.0000\r\n:")
        assert fault("stuck_limit axis=B side=reverse") == ["stuck_limit"]
        line.say("MG _LFB,_LRB", " 1.0000 0.0000\r\n:")
        fault("half_open")
        line.socket.sendall(b"WH\r")
        with tcp(address) as other:
            other.say("WH", "IHB\r\n:")
        fault("--clear")
        line.say("WH", "IHA\r\n:")
        fault("cut")
        assert line.ended()
        fault("power_cycle outage=1000")
        with tcp(address) as refused:
            assert refused.ended()
        fault("--clear power_cycle")
        with tcp(address) as again:
            again.say("MG _IHA2,_BGA,_LRB", " 2.0000 0.0000 1.0000\r\n:")


def test_of_two_twins_one_is_named() -> None:
    with served() as (_, one), served() as (_, two):
        code, said = done("dmc fault drop")
        assert (code, "several run" in said) == (1, True)
        assert fault(f"drop probability=1 --twin {two[1]}") == ["drop"]
        with tcp(one) as line:
            line.say("MG 1", " 1.0000\r\n:")


def test_a_fault_of_the_robot_that_runs() -> None:
    """At any speed of its clock, and beside another twin if it is named."""
    with up("--speed 50") as robot, served():
        port = robot.url.rpartition(":")[2]
        assert fault(f"latency seconds=0.2 --for 1000 --twin {port}") == ["latency"]
        active = robot.ask("GET", "/v1/twin/faults")[1]["active"]
        assert [(one["fault"], one["values"]["seconds"]) for one in active] == [("latency", 0.2)]
        code, said = done("dmc fault --active")
        assert (code, "several run" in said) == (1, True)
        assert fault(f"--clear latency --twin {port}") == fault(f"--active --twin {port}") == []
        code, said = done(f"dmc fault encoder_loss axis=H --twin {port} --json")
        assert (code, json.loads(said)["error"]["code"]) == (2, 4001)


def _lines(path: Path) -> list[dict[str, Any]]:
    """Return the whole lines of a record so far."""
    *whole, _ = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in whole]


@contextmanager
def _following(path: Path) -> Iterator[Iterator[dict[str, Any]]]:
    """Yield the lines of a record as they come, as somebody beside the twin reads them."""
    follow = ["timeout", str(PATIENCE), "tail", "-n", "+1", "-f", str(path)]
    with subprocess.Popen(follow, stdout=subprocess.PIPE, text=True) as tail:
        assert tail.stdout is not None
        try:
            yield (json.loads(line) for line in tail.stdout)
        finally:
            tail.kill()


@pytest.mark.waits("about 4 s until a line of a twin at real speed comes to its end")
def test_record_is_read_while_the_twin_runs_and_is_whole_after_a_kill(tmp_path: Path) -> None:
    record = tmp_path / "mechanics.jsonl"
    with running(f"dmc serve --port 0 --seed 3 --record {record}") as process:
        host, _, port = process.until("127.0.0.1:").rpartition(":")
        with tcp((host, int(port))) as line, _following(record) as lines:
            line.say("SH;ACB=1000000;JGB=-400000;BGB", "::::")
            assert any(one["kind"] == "contact" and one["axes"] == ["b"] for one in lines)
            pushed = next(one for one in lines if one["kind"] == "motion" and one["total"]["stalled"][1] > 0.2)
            process.kill()
    assert pushed["total"]["tension"] > 0.0
    first, *rest = _lines(record)
    assert first["kind"] == "start"
    motions = [one for one in rest if one["kind"] == "motion"]
    assert all(late["since"] == early["time"] for early, late in pairwise(motions))
    assert record.read_bytes().endswith(b"\n")
    assert record.stat().st_mode & 0o777 == 0o600
    with running(f"dmc serve --port 0 --record {record}") as process:
        process.until("127.0.0.1:")
        process.send(signal.SIGTERM)
        assert process.end()[0] == 0
    assert [one["kind"] for one in _lines(record)[len(rest) + 1 :]] == ["start"]


def test_record_into_an_irregular_file_is_refused(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.write_text("kept", encoding="utf-8")
    (tmp_path / "link").symlink_to(kept)
    os.mkfifo(tmp_path / "pipe")
    for name in ("/dev/null", tmp_path / "link", tmp_path / "pipe", tmp_path, tmp_path / "no" / "file"):
        code, said = done(f"dmc serve --port 0 --record {name} --json")
        assert code != 0, said
        assert json.loads(said)["error"]["code"] == 5002, said
    assert kept.read_text(encoding="utf-8") == "kept"
    code, said = done("dmc serve --port 0 --bench --record x --json")
    assert json.loads(said)["error"]["code"] == 4008, said


def test_twin_whose_record_cannot_be_written_ends_with_the_reason(tmp_path: Path) -> None:
    record = tmp_path / "record"
    with running(f"dmc serve --port 0 --record {record}") as process:
        host, _, port = process.until("127.0.0.1:").rpartition(":")
        size = record.stat().st_size
        resource.prlimit(process.number, resource.RLIMIT_FSIZE, (size + 10, resource.RLIM_INFINITY))  # a full disk
        with tcp((host, int(port))) as line:
            line.say("SHA;JGA=1000;BGA", ":::")
            code, said = process.end()
    assert code != 0
    assert "5002" in said
    assert "Traceback" not in said
    assert record.stat().st_size == size + 10
