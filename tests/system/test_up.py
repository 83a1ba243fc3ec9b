"""`maya up` from its start to its end: its output, its files, its exit."""

from __future__ import annotations

import json
import signal
import socket
import ssl
import subprocess
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPSConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from maya_un import runtime
from tests.calm import CALM_FILE
from tests.system.processes import CALM, done, running

pytestmark = pytest.mark.system

JOB = """
steps:
  - home
  - gripper: open
  - home
"""


def ask(request: str, body: object = None, **headers: str) -> tuple[int, Any]:
    """Ask the running robot on loopback for "METHOD /path"; return the status and what it answers."""
    found = runtime.find()
    assert found is not None
    address = urlsplit(found.url)
    connection = HTTPConnection(address.hostname or "", address.port, timeout=30.0)
    try:
        method, path = request.split(" ", 1)
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        response = connection.getresponse()
        return response.status, json.loads(response.read())
    finally:
        connection.close()


def events_until(kind: str, **detail: object) -> None:
    """Wait for an event of a kind with such a detail."""
    since = 0
    while True:
        _, events = ask(f"GET /v1/events?since={since}&wait=20")
        assert events, f"no {kind} came"
        for event in events:
            since = event["seq"]
            if event["kind"] == kind and detail.items() <= event["detail"].items():
                return


@pytest.fixture
def job(tmp_path: Path) -> str:
    file = tmp_path / "job.yaml"
    file.write_text(JOB)
    return str(file)


@pytest.fixture
def ear(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """Messages to systemd."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ear:
        ear.bind(str(tmp_path / "notify"))
        ear.settimeout(30.0)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        yield ear


def test_systemd_is_notified_of_its_life(ear: socket.socket, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "200000")
    with running(f"up --port 0 --speed 100 {CALM}", cold=True) as up:
        heard = [ear.recv(100)]
        while heard.count(b"WATCHDOG=1") < 3 or b"READY=1" not in heard:
            heard.append(ear.recv(100))
        assert ask("GET /v1/ready") == (200, {"ready": True, "reasons": []})
        up.send(signal.SIGTERM)
        while heard[-1] != b"STOPPING=1":
            heard.append(ear.recv(100))
        assert up.end()[0] == 0
    assert set(heard) == {b"READY=1", b"WATCHDOG=1", b"STOPPING=1"}


def test_running_job_waits_for_a_person_and_waiting_jobs_stay(job: str) -> None:
    with running(f"up --port 0 --speed 20 {CALM}", cold=True) as up:
        up.until("maya home")
        assert done(f"job submit {job}", cold=True)[0] == 0
        assert done(f"job submit {job}", cold=True)[0] == 0
        events_until("step", state="running", index=1)
        code, text = done("down", cold=True)
        assert (code, "has ended" in text) == (0, True)
        told = up.end()
        assert told[0] == 0
        assert "Job 1 is interrupted" in told[1]
    with running(f"up --port 0 --speed 20 {CALM}", cold=True) as up:
        said = up.until("interrupted")
        assert "Job 1 (job) was interrupted at step 1, home." in said
        assert "still" not in said
        _, queue = ask("GET /v1/queue")
        assert (queue["mode"], queue["reason"]) == ("paused", "restart")
        assert queue["recovery"]["job"] == 1
        assert [(line["id"], line["state"]) for line in queue["waiting"]] == [(1, "interrupted"), (2, "queued")]
        assert ask("GET /v1/status")[1]["state"]["mode"] == "not_homed"


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, between processes in real time")
@pytest.mark.parametrize("how", ["maya up --on-exit finish", "maya down --finish"])
def test_running_step_is_finished_on_request(how: str, job: str) -> None:
    option = " --on-exit finish" if "exit" in how else ""
    with running(f"up --port 0 --speed 100{option} {CALM}") as up:
        up.until("maya home")
        done(f"job submit {job}")
        events_until("step", state="running", index=1)
        code, _ = done("down" if option else "down --finish")
        assert code == 0
        told = up.end()
        assert (told[0], "Ending after the running step of job 1" in told[1]) == (0, True)
    with running(f"up --port 0 --speed 100 {CALM}") as up:
        assert "between two steps" in up.until("interrupted")
        steps = ask("GET /v1/jobs/1")[1]["steps"]
        assert [step["state"] for step in steps] == ["done", "queued", "queued"]


def test_a_second_word_does_not_wait(job: str) -> None:
    with running("up --port 0 --on-exit finish") as up:
        up.until("maya home")
        done(f"job submit {job}")
        events_until("step", state="running", index=1)
        up.send(signal.SIGINT)
        up.until("Ending after the running step")
        assert ask("GET /v1/status")[0] == 200  # reading and stopping still work
        up.send(signal.SIGINT)
        told = up.end(20.0)
    assert (told[0], "The robot decelerates along the path and stops now." in told[1]) == (0, True)


def test_a_queue_in_memory_is_gone_with_it(job: str, tmp_path: Path) -> None:
    with running(f"up --port 0 --speed 100 --journal memory --json {CALM}") as up:
        about = up.until('"journal"')
        assert about == '"journal": null,'
        up.until("}")
        done(f"job submit {job}")
        assert done("down")[0] == 0
        assert up.end()[0] == 0
    assert not (tmp_path / "state" / "maya" / "maya.db").exists()


def test_written_configuration_is_in_force_at_the_next_start(tmp_path: Path) -> None:
    file = tmp_path / "machine.toml"
    calm = CALM_FILE.read_text(encoding="utf-8")
    file.write_text(f"{calm}\n[geometry]\nheight = 2.34 # measured\n", encoding="utf-8")
    up_line = f"up --port 0 --config {file}"
    with running(up_line) as up:
        up.until("maya home")
        status, check = ask("PUT /v1/config", {"settings": {"geometry": {"height": 2.36}}})
        assert (status, check["from_now"]) == (200, [{"name": "geometry.height", "before": 2.34, "after": 2.36}])
        assert ask("GET /v1/config")[1]["geometry"]["height"] == 2.34
        assert done("down")[0] == 0
        assert up.end()[0] == 0
    assert "height = 2.36 # measured" in file.read_text(encoding="utf-8")
    with running(up_line) as up:
        up.until("maya home")
        assert ask("GET /v1/config")[1]["geometry"]["height"] == 2.36
        assert "configure" in [line["operation"] for line in ask("GET /v1/audit")[1]]
        assert ask("GET /v1/examples")[1][0]["name"] == "01_pick_and_place"


def test_one_file_has_one_queue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "queue.db"
    with running(f"up --port 0 --journal {file}") as up:
        up.until("maya home")
        monkeypatch.setenv("MAYA_RUNTIME_DIR", str(tmp_path / "other"))
        code, text = done(f"up --port 0 --journal {file}")
    assert (code, "error 5010" in text) == (2, True)


def test_nothing_to_end_is_reported() -> None:
    code, text = done("down")
    assert (code, "error 1020" in text) == (1, True)


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[Path, Path]:
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    made = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    named = ["-subj", "/CN=maya", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)]
    subprocess.run([*made, *named], check=True, capture_output=True)
    return cert, key


def test_other_machines_are_let_in_once_there_are_users(certificate: tuple[Path, Path]) -> None:
    """A local request on the public listener needs a token too, as soon as there are users."""
    remote = f"--listen 127.0.0.1:0 --tls-cert {certificate[0]} --tls-key {certificate[1]}"
    code, text = done(f"up --port 0 {remote}")
    assert (code, "maya user add" in text) == (2, True)
    with running("up --port 0") as up:
        up.until("maya home")
        token = json.loads(done("user add root --role admin --json")[1])["token"]
        done("down")
    with running(f"up --port 0 {remote}") as up:
        address = urlsplit(up.until("https://").rpartition(" ")[2])
        trusting = ssl.create_default_context(cafile=str(certificate[0]))
        answers: list[int] = []
        for shown in ({}, {"Authorization": f"Bearer {token}"}, {"Authorization": "Bearer maya_00000000_wrong"}):
            line = HTTPSConnection(address.hostname or "", address.port, timeout=30.0, context=trusting)
            line.request("GET", "/v1/status", headers=shown)
            response = line.getresponse()
            answers.append(response.status)
            assert response.getheader("Maya") is not None
            response.read()
            line.close()
        assert answers == [401, 200, 401]
        assert ask("GET /v1/status")[0] == 401
        assert ask("POST /v1/stop")[0] == 200


@pytest.mark.parametrize(
    "options", ["--listen 0.0.0.0", "--plain", "--listen 0.0.0.0 --plain --tls-cert x --tls-key y"]
)
def test_listener_for_other_hosts_is_not_opened_by_accident(options: str) -> None:
    code, text = done(f"up --port 0 {options}")
    assert (code, "error 4008" in text) == (2, True)


def test_the_unit_is_one_that_systemd_likes(tmp_path: Path) -> None:
    if not Path("/usr/bin/systemd-analyze").exists():
        pytest.skip("systemd is not installed here")
    unit = Path(__file__).parents[2] / "contrib" / "systemd" / "maya.service"
    ours = tmp_path / "maya.service"
    ours.write_text(unit.read_text().replace("/opt/maya/bin/maya", "/bin/true"))
    verified = subprocess.run(["systemd-analyze", "verify", str(ours)], capture_output=True, text=True, check=False)
    assert (verified.returncode, verified.stdout, verified.stderr) == (0, "", "")
    line = ["systemd-analyze", "security", "--offline=true", "--threshold=20", str(ours)]
    assert subprocess.run(line, capture_output=True, check=False).returncode == 0
