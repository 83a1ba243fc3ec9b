"""Supervisors, a real broker, `maya coms`, `maya up` and its twin: each a process of its own."""

from __future__ import annotations

import json
import queue
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from maya_un.config.files import parse
from maya_un.errors import NotHomed, SessionTakenOver, WrongRobot
from maya_un.http.doctor import host
from maya_un.schema.diagnosis import FindingOutcome
from maya_un.supervisor import Supervisor as Supervising
from tests.system.brokers import Broker, broker, disconnect
from tests.system.processes import CALM, Process, running
from tests.waiting import eventually

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

UP = f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 {CALM}"


class Supervisor:
    """Sends commands and hears what is published for one robot: plain paho, none of our code."""

    def __init__(self, broker: Broker, robot: str = "MAYA") -> None:
        self._robot = robot
        self._heard: queue.Queue[tuple[str, dict[str, Any]]] = queue.Queue()
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
        self._client.on_message = self._on_message
        self._client.on_connect = self._on_connect
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()

    def _on_connect(self, *_: object) -> None:
        self._client.subscribe(f"maya/v1/{self._robot}/#", 1)

    def _on_message(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        self._heard.put((message.topic.rpartition("/")[2], json.loads(message.payload)))

    def send(self, id_: str, command: str, **args: object) -> None:
        """Publish a command; returns when the broker has it."""
        text = json.dumps({"id": id_, "command": command, "args": args})
        self._client.publish(f"maya/v1/{self._robot}/commands", text, 1).wait_for_publish(30.0)

    def hear(self, topic: str) -> dict[str, Any]:
        """Return the next message on a topic; others are passed over."""
        until = time.monotonic() + 120.0
        while True:
            name, data = self._heard.get(timeout=until - time.monotonic())
            if name == topic:
                return data

    def until_online(self) -> None:
        """Wait until the robot's link is there."""
        while self.hear("connection")["connection"] != "ONLINE":
            pass

    def until_executing(self) -> None:
        """Wait until a step begins; its acceptance is not reported if it begins at once."""
        while self.hear("progress")["state"] != "executing":
            pass

    def close(self) -> None:
        """Disconnect."""
        disconnect(self._client)


@contextmanager
def supervisor(broker: Broker, robot: str = "MAYA") -> Iterator[Supervisor]:
    one = Supervisor(broker, robot)
    try:
        yield one
    finally:
        one.close()


def call(method: str, url: str, path: str) -> dict[str, Any]:
    """Return what the server of `maya coms` answers."""
    with closing(HTTPConnection(url.removeprefix("http://"), timeout=10.0)) as connection:
        connection.request(method, path)
        answer = connection.getresponse()
        return {"status": answer.status, **json.loads(answer.read())}


def supervisors_of(url: str) -> dict[str, Any]:
    """Return what the server of `maya coms` tells of its supervisors."""
    found: dict[str, Any] = call("GET", url, "/status")["supervisors"]
    return found


def url_in(line: str) -> str:
    return next(word for word in line.split() if "://" in word).rstrip(".:,")


@contextmanager
def robot() -> Iterator[str]:
    """Run `maya up`, homed, with a fast clock; yield the URL of its rosbridge."""
    with running(UP) as up:
        yield url_in(up.until("ws://"))


def coms(broker: Broker, rosbridge: str, *more: str) -> Process:
    return Process(" ".join(["coms", "--port 0", f"--url {broker.url}", f"--rosbridge {rosbridge}", *more]))


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_two_robots_with_one_name_do_not_fight_for_its_session(tmp_path: Path) -> None:
    with broker(tmp_path) as one, robot() as rosbridge:
        first = coms(one, rosbridge, "--connect")
        url = url_in(first.until("http://"))
        eventually(lambda: call("GET", url, "/status")["state"] == "connected", "connected", 60.0)
        second = coms(one, rosbridge, "--connect")
        other = url_in(second.until("http://"))
        try:
            eventually(lambda: supervisors_of(url)["code"] == SessionTakenOver.code, "the first gives way", 60.0)
            with supervisor(one) as lab:
                lab.until_online()
                lab.send("1", "home")
                assert lab.hear("results")["success"] is True
            assert call("GET", other, "/status")["state"] == "connected"
            assert supervisors_of(url)["code"] == SessionTakenOver.code
            log = (tmp_path / "mosquitto.log").read_text()
            assert log.count("as maya-coms-MAYA (") == 2, log
            (found,) = host.coms(parse({"coms": {"server_address": url}}))
            assert (found.outcome, found.key) == (FindingOutcome.FAIL, "coms_taken")
        finally:
            first.kill()
            second.kill()


def test_port_0_of_the_address_takes_a_free_port(tmp_path: Path) -> None:
    config = tmp_path / "maya.toml"
    config.write_text('[coms]\nserver_address = "http://localhost:0"\n')
    up = f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 --coms --config {config}"
    with running(up) as process:
        line = process.until("POST /connect")
        assert urlsplit(url_in(line)).port not in {None, 0, 80}


def test_coms_of_up_speaks_the_language_of_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_COMS_URL", "mqtt://192.0.2.1")
    monkeypatch.setenv("MAYA_COMS_PASSWORD", "hunter2")
    config = tmp_path / "maya.toml"
    config.write_text('[coms]\nserver_address = "http://localhost:0"\n')
    up = f"up --port 0 --rosbridge-port 0 --journal memory --speed 100 --coms --lang es --config {config}"
    with running(up) as process:
        assert "sin cifrar" in process.until("La contraseña va a mqtt://192.0.2.1")
        assert process.until("Escuchando en http://").endswith("GET /status.")


def test_a_password_without_encryption_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MAYA_COMS_PASSWORD", "hunter2")
    link = Process("coms --port 0 --url mqtt://192.0.2.1 --connect")
    try:
        assert "without encryption" in link.until("The password goes to mqtt://192.0.2.1")
        url = url_in(link.until("Listening"))
        assert call("GET", url, "/status")["password_in_clear"] is True
        found = [finding.key for finding in host.coms(parse({"coms": {"server_address": url}}))]
        assert found == ["coms_clear", "coms_waits"]
    finally:
        link.kill()


def test_a_supervisor_is_warned_in_the_same_words(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("MAYA_COMS_PASSWORD", "hunter2")
    link, fleet = Process("coms --port 0 --url mqtt://192.0.2.1"), Process("fleet list --url mqtt://192.0.2.1")
    try:
        warning = link.until("without encryption").removeprefix("maya: ")
        assert fleet.until("without encryption") == warning
    finally:
        link.kill()
        fleet.kill()
    Supervising("mqtt://192.0.2.1")
    Supervising("mqtts://192.0.2.1")
    Supervising("mqtt://localhost")
    assert [record.getMessage() for record in caplog.records] == [warning]


@pytest.mark.parametrize(
    ("options", "environment", "name"),
    [("", {}, "CRANE"), ("", {"NAME": "ROBOT7"}, "ROBOT7"), ("--name ARM", {"NAME": "ROBOT7"}, "ARM")],
)
def test_name_is_from_the_line_the_environment_or_the_configuration(
    options: str, environment: dict[str, str], name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NAME", raising=False)
    config = tmp_path / "maya.toml"
    config.write_text('[coms]\nname = "CRANE"\n')
    link = Process(f"coms --port 0 --config {config} {options}", env=environment)
    try:
        url = url_in(link.until("Listening"))
        assert call("GET", url, "/status") == {"status": 200, "state": "idle", "name": name}
        (finding,) = host.coms(parse({"coms": {"server_address": url, "name": name}}))
        assert (finding.outcome, finding.key) == (FindingOutcome.OK, "coms_idle")
        (finding,) = host.coms(parse({"coms": {"server_address": url, "name": "MAYA2"}}))
        assert (finding.outcome, finding.key) == (FindingOutcome.WARN, "coms_other")
    finally:
        link.kill()


def test_no_command_reaches_the_robot_of_another_name(tmp_path: Path) -> None:
    with broker(tmp_path) as one, robot() as rosbridge, supervisor(one, "MAYA2") as lab:
        link = coms(one, rosbridge, "--connect", "--name MAYA2")
        try:
            url = url_in(link.until("http://"))
            lab.until_online()
            lab.send("1", "home")

            def is_refused() -> bool:
                status = call("GET", url, "/status")
                robot = status["robot"]  # between two attempts it waits for the robot's name
                seen = robot["code"] == WrongRobot.code and "'MAYA'" in robot["waits_for"]
                return seen and status["steps"] == {"1": "sending"}

            eventually(is_refused, "it sees that", 60.0)
        finally:
            link.kill()
        with supervisor(one) as other:
            link = coms(one, rosbridge, "--connect")
            try:
                other.until_online()
                other.send("2", "can_teleop")
                assert other.hear("results")["code"] == str(NotHomed.code)  # the first command moved nothing
            finally:
                link.kill()


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_supervisor_moves_the_robot_over_mqtt(tmp_path: Path) -> None:
    with broker(tmp_path) as one, robot() as rosbridge:
        link = coms(one, rosbridge)
        try:
            url = url_in(link.until("http://"))
            assert call("GET", url, "/status")["state"] == "idle"
            assert call("POST", url, "/connect")["status"] == 200
            with supervisor(one) as lab:
                lab.until_online()
                lab.send("1", "home")
                lab.until_executing()
                assert lab.hear("results")["success"]
                lab.send("2", "approach", x=0.5, y=0.9, z=0.5)
                assert lab.hear("results") | {"started": "", "finished": ""} == {
                    "id": "2", "success": True, "error": None, "code": None, "started": "", "finished": "",
                    "warnings": [],
                }  # fmt: skip
                lab.send("3", "approach", x=5, y=0.9, z=0.5)
                refused = lab.hear("results")
                assert (refused["id"], refused["success"], refused["code"]) == ("3", False, "2101")
                assert call("GET", url, "/status")["state"] == "connected"
                assert call("POST", url, "/disconnect")["state"] == "idle"
                assert lab.hear("connection") == {"connection": "OFFLINE"}
        finally:
            link.kill()


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_a_command_survives_the_death_of_coms_and_runs_once(tmp_path: Path) -> None:
    with broker(tmp_path) as one, robot() as rosbridge:
        link = coms(one, rosbridge, "--connect")
        try:
            with supervisor(one) as lab:
                lab.until_online()
                lab.send("1", "home")
                lab.until_executing()
                link.kill()
                lab.send("2", "approach", x=0.5, y=0.9, z=0.5)
                link = coms(one, rosbridge, "--connect")
                results = [lab.hear("results") for _ in range(2)]
                assert [(result["id"], result["success"]) for result in results] == [("1", True), ("2", True)]
        finally:
            link.kill()
