"""The fleet as displays see it: `maya up --coms` and `maya fleet list --follow` at a real broker."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from maya_un.supervisor import Supervisor
from tests.calm import CALM_FILE
from tests.ports import free_port
from tests.streaming import connected
from tests.system.brokers import Broker, broker, disconnect
from tests.system.processes import Process, running
from tests.system.robots import Running, up
from tests.waiting import eventually

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]


@contextmanager
def robot(folder: Path, url: str, *, coms: bool = True) -> Iterator[Running]:
    """Run the robot MAYA with its link to the supervisors at `url`."""
    config = folder / "maya.toml"
    config.write_text(f'{CALM_FILE.read_text()}[coms]\nserver_address = "http://localhost:{free_port()}"\n')
    places = {"MAYA_COMS_URL": url, "MAYA_RUNTIME_DIR": str(folder / "run"), "MAYA_STATE_DIR": str(folder / "state")}
    link = "--coms" if coms else "--rosbridge"
    with up(f"{link} --rosbridge-port 0 --journal memory --speed 100 --config {config}", places) as found:
        yield found


def fleet_of(service: Running, holds: Callable[[Any], bool]) -> Any:
    """Return the fleet once something holds for it."""
    return service.until(holds, "/v1/fleet")


def states(fleet: Any) -> dict[str, str]:
    return {one["name"]: one["state"] for one in fleet["robots"]}


def watchers(of: int) -> list[int]:
    """Return the processes below a process that watch the fleet."""
    children = Path(f"/proc/{of}/task").glob("*/children")
    numbers = [int(number) for file in children for number in file.read_text().split()]
    return [number for number in numbers if b"--follow" in Path(f"/proc/{number}/cmdline").read_bytes()]


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, as the broker lives in real time")
def test_service_shows_the_fleet_through_the_death_of_broker_and_watcher(tmp_path: Path) -> None:
    one = Broker(tmp_path)
    with robot(tmp_path, one.url) as service:
        try:
            found = fleet_of(service, lambda fleet: fleet["trouble"] is not None)
            assert (found["link"], found["trouble"]["code"], found["broker"]) == ("connecting", 1051, one.url)
            one.start()
            found = fleet_of(service, lambda fleet: states(fleet) == {"MAYA": "idle"})
            assert (found["link"], found["trouble"], found["refused"], found["more"]) == ("connected", None, False, 0)
            asyncio.run(home_is_streamed(service, one))
            one.kill()
            found = fleet_of(service, lambda fleet: fleet["link"] == "lost")
            assert (found["trouble"]["code"], found["robots"][0]["last"][0]["command"]) == (1051, "home")
            one.start()
            found = fleet_of(service, lambda fleet: fleet["link"] == "connected" and states(fleet) == {"MAYA": "idle"})
            (watcher,) = watchers(service.pid)
            os.kill(watcher, signal.SIGKILL)
            found = fleet_of(service, lambda fleet: fleet["link"] == "lost")
            assert states(found) == {"MAYA": "idle"}
            fleet_of(service, lambda fleet: fleet["link"] == "connected" and states(fleet) == {"MAYA": "idle"})
            (again,) = watchers(service.pid)
            service.end()
            eventually(lambda: not Path(f"/proc/{again}").exists(), "the watcher has ended")
        finally:
            one.kill()


async def home_is_streamed(service: Running, one: Broker) -> None:
    """Have `anna` home MAYA; a client of the stream sees the step, its supervisor and its end."""
    async with (
        asyncio.timeout(120.0),
        connected(f"{service.url.replace('http', 'ws', 1)}/v1/stream") as client,
        Supervisor(one.url, name="anna") as lab,
    ):
        assert client.got[0]["fleet"] is True
        await client.ask("subscribe", fleet=True)
        step = lab.robot("MAYA").home()
        while states((shown := await client.until("fleet"))["fleet"])["MAYA"] != "working":
            pass
        executing = shown["fleet"]["robots"][0]["step"]
        assert [executing[key] for key in ("id", "state", "command", "supervisor")] == [
            step.id,
            "executing",
            "home",
            "anna",
        ]
        await step
        while states((shown := await client.until("fleet"))["fleet"])["MAYA"] != "idle":
            pass
        last = shown["fleet"]["robots"][0]["last"][0]
        assert [last[key] for key in ("id", "state", "supervisor", "error")] == [step.id, "done", "anna", None]


def test_without_a_watchable_broker_the_fleet_says_so(tmp_path: Path) -> None:
    broker_url, database = f"mqtt://127.0.0.1:{free_port()}", f"http://127.0.0.1:{free_port()}"
    for url, coms, link in (("", True, "none"), (broker_url, False, "none"), (database, True, "unsupported")):
        with robot(tmp_path, url, coms=coms) as service:
            found = service.ask("GET", "/v1/fleet")[1]
            assert (found["link"], found["robots"], found["trouble"]) == (link, [], None)
            assert watchers(service.pid) == []
            asyncio.run(greeting_has_no_fleet(service))
            service.end()


async def greeting_has_no_fleet(service: Running) -> None:
    async with connected(f"{service.url.replace('http', 'ws', 1)}/v1/stream") as client:
        assert client.got[0]["fleet"] is False


class Robots:
    """Any number of robots, in plain paho: presence, reports, and anything else."""

    def __init__(self, broker: Broker) -> None:
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()

    def say(self, robot: str, kind: str, content: object, *, retain: bool = False) -> None:
        """Publish content as JSON, or bytes unchanged."""
        data = content if isinstance(content, bytes) else json.dumps(content).encode()
        self._client.publish(f"maya/v1/{robot}/{kind}", data, 1, retain).wait_for_publish(30.0)

    def close(self) -> None:
        """Disconnect."""
        disconnect(self._client)


@contextmanager
def following(one: Broker) -> Iterator[Callable[[Callable[[Any], bool]], Any]]:
    """Run `maya fleet list --follow`; yield a function that returns the first list for which something holds."""
    with running(f"fleet list --follow --json --url {one.url}") as process:

        def until(holds: Callable[[Any], bool]) -> Any:
            while not holds(found := json.loads(process.until("{"))):
                pass
            return found

        yield until


NONSENSE = (b"not JSON", b"[]", b'{"id": NaN}', b"\xff\xfe", b"[" * 2000, b'{"id": "1", "state": {}}', b"9" * 5000)


def test_list_follows_any_number_of_robots_through_nonsense(tmp_path: Path) -> None:
    with broker(tmp_path) as one, following(one) as until:
        robots = Robots(one)
        try:
            for number in range(230):
                robots.say(f"R{number:03}", "connection", {"connection": "ONLINE"}, retain=True)
            assert len(until(lambda fleet: fleet["more"] == 30)["robots"]) == 200
            for kind in ("commands", "progress", "results", "connection"):
                for content in NONSENSE if kind == "connection" else (b"", *NONSENSE):
                    robots.say("R001", kind, content)
            robots.say("R000", "commands", {"id": "1", "command": "home", "supervisor": "<b>anna</b>"}, retain=True)
            robots.say("R000", "progress", {"id": "1", "state": "executing", "date": "2026-01-31T12:00:00Z"})
            found = until(lambda fleet: states(fleet)["R000"] == "working")["robots"][0]
            assert (found["step"]["supervisor"], found["last"]) == ("<b>anna</b>", [])
            robots.say("R000", "connection", {"connection": "CONNECTION_BROKEN"}, retain=True)
            until(lambda fleet: states(fleet)["R000"] == "lost")
            robots.say("R000", "connection", b"", retain=True)
            assert "R000" not in states(until(lambda fleet: fleet["more"] == 30 and len(fleet["robots"]) == 199))
        finally:
            robots.close()
        with following(one) as later:  # a stored command is not one of now
            assert states(later(lambda fleet: len(fleet["robots"]) == 200)).get("R000") is None


def test_people_read_states_steps_and_errors_in_their_language(tmp_path: Path) -> None:
    with broker(tmp_path) as one:
        robots = Robots(one)
        process = Process(f"fleet list --follow --url {one.url} --lang es")
        try:
            robots.say("MAYA", "connection", {"connection": "ONLINE"}, retain=True)
            assert process.until("MAYA") == "MAYA  sin pasos"
            robots.say(
                "MAYA", "commands", {"id": "1", "command": "gripper", "args": {"open": True}, "supervisor": "anna"}
            )
            assert process.until("un paso espera")
            result = {"id": "1", "success": False, "error": "It is stuck.", "code": "3001", "warnings": []}
            robots.say("MAYA", "results", result | {"started": "", "finished": ""})
            assert process.until("falló") == "MAYA  el último paso falló  gripper True  anna  It is stuck. (3001)"
            one.kill()
            assert "(1051)" in process.until("1051")
        finally:
            process.kill()
            robots.close()
