"""stop and status: by the service, and past it."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import pytest

from dmc41x3.address import NetworkAddress
from maya_un import runtime
from maya_un.cli import quick
from maya_un.cli.main import main
from maya_un.runtime import Running
from tests.ports import free_port
from tests.unit.cli.servers import controller, hanging_service, http_service

STATE: dict[str, Any] = {
    "mode": "not_homed",
    "joints": None,
    "point": None,
    "gripper_closed": False,
    "forward_limit": [False, True, False],
    "reverse_limit": [True, False, False],
    "fault": None,
}
STATUS: dict[str, Any] = {"address": "sim", "state": STATE, "progress": None, "jobs": [], "last_event": 3}


def published(monkeypatch: pytest.MonkeyPatch, url: str, address: NetworkAddress | None = None) -> None:
    """Have commands find a service."""
    monkeypatch.setattr(runtime, "find", lambda: Running(url, 1, address))
    monkeypatch.setattr(runtime, "claimant", lambda: 1)


def data_record(*status: int) -> bytes:
    """Return a data record of three axes with the given status words and nothing else."""
    record = bytearray(82 + 36 * 3)
    record[0] = 0x87
    struct.pack_into("<H", record, 2, len(record))
    for axis, word in enumerate(status):
        struct.pack_into("<H", record, 82 + 36 * axis, word)
    return bytes(record)


MOVING, COORDINATED = 1 << 15, 1 << 8


def test_stop_shows_duration_and_distance(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    report = {"was_moving": True, "duration": 0.88, "distance": [0.0, -0.02, 0.01]}
    with http_service(lambda *asked: (200 if asked[:2] == ("POST", "/v1/stop") else 404, report)) as url:
        published(monkeypatch, url)
        assert main(["stop"]) == 0
    assert "0.88 s" in (text := capsys.readouterr().out)
    assert "b 20.0 mm" in text


def test_stop_at_rest_is_reported(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    report = {"was_moving": False, "duration": 0.0, "distance": [0, 0, 0]}
    with http_service(lambda *_: (200, report)) as url:
        published(monkeypatch, url)
        assert main(["stop", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"service": True, **report}


def test_stop_of_a_job_that_waits_names_it(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    report = {"was_moving": False, "duration": 0.0, "distance": [0, 0, 0], "job": 1}
    with http_service(lambda *_: (200, report)) as url:
        published(monkeypatch, url)
        assert main(["stop"]) == 0
    assert capsys.readouterr().out == "Nothing was moving. Job 1 was ended.\n"


def test_a_service_that_hangs_is_passed_by(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    record = data_record(MOVING, MOVING | COORDINATED, MOVING | COORDINATED)
    with hanging_service() as url, controller(record) as (port, said):
        published(monkeypatch, url, NetworkAddress("127.0.0.1", port))
        assert main(["stop"]) == 0
    assert said == [b"ST S", b"QR", b"ST A"]
    assert "ABC began to brake" in capsys.readouterr().out


def test_a_service_that_lost_its_link_is_passed_by(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = {"code": 1010, "details": {}}
    with http_service(lambda *_: (409, problem)) as url, controller(data_record(0, 0, 0)) as (port, said):
        published(monkeypatch, url, NetworkAddress("127.0.0.1", port))
        assert main(["stop"]) == 0
    assert said[0] == b"ST S"


def test_other_program_at_our_old_port_is_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = {"was_moving": True, "duration": 1.0, "distance": [0.0, 0.0, 0.0]}
    with http_service(lambda *_: (200, answer), ours=False) as url, controller(data_record(0, 0, 0)) as (port, said):
        published(monkeypatch, url, NetworkAddress("127.0.0.1", port))
        assert main(["status"]) == 1
        assert main(["stop"]) == 0
    assert said[0] == b"ST S"


def test_controller_address_can_be_given_without_a_service(capsys: pytest.CaptureFixture[str]) -> None:
    with controller(data_record(0, 0, 0)) as (port, said):
        assert main(["stop", "--address", f"127.0.0.1:{port}", "--json"]) == 0
    assert said == [b"ST S", b"QR"]
    assert json.loads(capsys.readouterr().out)["was_moving"] is False


def test_real_is_the_configured_controller(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "c.toml"
    with controller(data_record(0, 0, 0)) as (port, said):
        file.write_text(f'[controller]\naddress = "127.0.0.1:{port}"\n')
        assert main(["stop", "--address", "real", "--config", str(file), "--json"]) == 0
    assert said == [b"ST S", b"QR"]
    assert json.loads(capsys.readouterr().out)["address"] == f"127.0.0.1:{port}"


def test_a_twin_in_a_service_that_hangs_cannot_be_reached(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(quick, "SERVICE_TIMEOUT", 0.05)
    with hanging_service() as url:
        published(monkeypatch, url)
        assert main(["stop"]) == 1
    assert "error 1021" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["stop", "status"])
def test_stale_file_is_no_service(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    published(monkeypatch, f"http://127.0.0.1:{free_port()}")
    assert main([command]) == 1
    assert "error 1020" in capsys.readouterr().err


@pytest.mark.parametrize(
    "line", ["stop now", "stop --address", "stop --address=x:y", "status please", "stop --address h 1"]
)
def test_unknown_words_are_refused(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 2
    assert capsys.readouterr().err.startswith("maya: error 400")


@pytest.mark.parametrize("command", ["stop", "status"])
def test_help_needs_no_service(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    assert f"maya {command}" in capsys.readouterr().out


def test_status_before_homing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with http_service(lambda *_: (200, STATUS)) as url:
        published(monkeypatch, url)
        assert main(["status"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("not homed   ")
    assert "position unknown" in text
    assert "b+ a−" in text


@pytest.mark.parametrize(
    ("duration", "line"),
    [(10.0, "follow the path: 3.0 of 10.0 s"), (0.0, "follow the path: since 3.0 s")],
    ids=["timed", "untimed"],
)
def test_status_shows_phase_and_progress(
    duration: float, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    progress = {"phase": "follow", "elapsed": 3.0, "duration": duration}
    with http_service(lambda *_: (200, {**STATUS, "progress": progress})) as url:
        published(monkeypatch, url)
        assert main(["status"]) == 0
    assert line in capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(("override", "told"), [(0.5, True), (1.0, False)])
def test_status_shows_a_reduced_speed(
    override: float, told: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with http_service(lambda *_: (200, {**STATUS, "state": {**STATE, "override": override}})) as url:
        published(monkeypatch, url)
        assert main(["status"]) == 0
    assert ("speed 50 %" in capsys.readouterr().out.splitlines()) is told


@pytest.mark.parametrize(("asks", "told"), [(True, True), (False, False)])
def test_status_shows_that_a_job_waits_for_an_answer(
    asks: bool, told: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    question = {"job": 1, "name": "x", "index": 1, "question": "Which part?", "choices": ["cube"], "open": asks}
    with http_service(lambda *_: (200, {**STATUS, "question": question})) as url:
        published(monkeypatch, url)
        assert main(["status"]) == 0
    assert ("job 1 waits for an answer: Which part?" in capsys.readouterr().out.splitlines()) == told


def test_status_with_a_place_a_fault_and_a_queue(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    state = {**STATE, "joints": [0.5, 2.0, 1.9], "point": [0.5, 1.0, 0.4], "fault": {"code": 2301, "message": "Ay"}}
    jobs = [{"state": "running"}, {"state": "queued"}]
    with http_service(lambda *_: (200, {**STATUS, "state": state, "jobs": jobs})) as url:
        published(monkeypatch, url)
        assert main(["status", "--lang", "es"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("sin referenciar   ")
    assert "a 28.65°  b 2000.0 mm  c 1900.0 mm   x 500.0 mm" in text
    assert "fallo 2301: Ay" in text
    assert "1 en marcha, 1 en espera" in text
