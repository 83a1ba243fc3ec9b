"""Supervisors, broker, network, link and robot fail at random instants: no command is lost, none runs twice.

Each command turns the boom a little further, so a step that ran again later would turn it back: the twin's mechanics
see that. The supervisor is plain paho; it sends a command again until it has its result, as every client of a broker
must that may lose what it stored.
"""

from __future__ import annotations

import json
import queue
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any, Protocol

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from maya_un.assembly import Twin
from maya_un.config import Config
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.system.brokers import Broker, broker
from tests.system.processes import Process, Wire
from tests.system.test_guard import mark, served

pytestmark = [pytest.mark.system, pytest.mark.timeout(3600)]

STEP = 0.004
"""Each command turns the boom so much further [rad]."""

MECHANISM = Mechanism.of(Config())


class Supervisor:
    """Sends commands, each again until it has a result; `results` holds every result of every id."""

    def __init__(self, broker: Broker) -> None:
        self.results: dict[str, set[str]] = {}
        self.unanswered: dict[str, str] = {}
        self._changes: queue.Queue[str] = queue.Queue()
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2, "supervisor", protocol=mqtt.MQTTv5)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_message = self._on_message
        self._client.on_connect = self._on_connect
        self._client.connect("127.0.0.1", broker.port, clean_start=True)
        self._client.loop_start()

    def _on_connect(self, *_: object) -> None:
        self._client.subscribe([("maya/v1/MAYA/results", 1), ("maya/v1/MAYA/progress", 1)])
        for text in tuple(self.unanswered.values()):
            self._publish(text)

    def _on_message(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        data = json.loads(message.payload)
        if message.topic.endswith("results"):
            self.results.setdefault(data["id"], set()).add(message.payload.decode())
            self.unanswered.pop(data["id"], None)
        self._changes.put(message.topic)

    def send(self, id_: str, point: tuple[float, float, float]) -> None:
        """Send a command."""
        args = dict(zip("xyz", point, strict=True))
        self.unanswered[id_] = json.dumps({"id": id_, "command": "approach", "args": args})
        self._publish(self.unanswered[id_])

    def send_again(self) -> None:
        """Send all that has no result once more."""
        for text in tuple(self.unanswered.values()):
            self._publish(text)

    def _publish(self, text: str) -> None:
        self._client.publish("maya/v1/MAYA/commands", text, 1)

    def wait(self) -> None:
        """Wait until something is reported; if nothing is, send again."""
        try:
            self._changes.get(timeout=5.0)
        except queue.Empty:
            self.send_again()

    def close(self) -> None:
        """Disconnect."""
        self._client.disconnect()
        self._client.loop_stop()


class Network:
    """Between the link and the broker: passes bytes on, and cuts or holds them."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._open = threading.Event()
        self._open.set()
        self._pairs: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                try:
                    far = socket.create_connection(("127.0.0.1", self._target))
                except OSError:
                    near.close()
                    continue
                self._pairs += [near, far]
                for one, other in ((near, far), (far, near)):
                    threading.Thread(target=self._pass_on, args=(one, other), daemon=True).start()

    def _pass_on(self, one: socket.socket, other: socket.socket) -> None:
        with suppress(OSError):
            while data := one.recv(65_536):
                self._open.wait()
                other.sendall(data)
        _shut(one)
        _shut(other)

    def cut(self) -> None:
        """End every connection."""
        for one in self._pairs:
            _shut(one)
        self._pairs.clear()

    def hold(self) -> None:
        """Hold every byte back."""
        self._open.clear()

    def let_go(self) -> None:
        """Pass on what was held."""
        self._open.set()

    def close(self) -> None:
        """End."""
        self._listener.close()
        self._open.set()
        self.cut()


def _shut(one: socket.socket) -> None:
    with suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()


class Server(Protocol):
    """What stands between supervisors and the link: a broker, or a database."""

    port: int

    def kill(self) -> None: ...
    def end(self) -> None: ...
    def start(self) -> None: ...


class World:
    """All that can fail, and the twin that does not; `scheme` is that of the server's URL."""

    def __init__(
        self,
        twin: Twin,
        address: str,
        one: Server,
        folder: Path,
        scheme: str = "mqtt",
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self.broker = one
        self._scheme = scheme
        self.network = Network(one.port)
        self._address = address
        self._folder = folder
        self._environment = {
            "MAYA_RUNTIME_DIR": str(folder / "run"),
            "MAYA_STATE_DIR": str(folder / "state"),
            **(environment or {}),
        }
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self._rosbridge: int = free.getsockname()[1]
        self.begun: list[float] = []
        self._start = Joints(*twin.mechanics.true_joints())

        def tap(_letter: str, way: str, data: bytes) -> None:
            if way == "rx" and b"BGS" in data:
                self.begun.append(twin.mechanics.true_joints()[0])

        twin.controller.tap = tap
        self.robot = self._start_robot()
        self.coms = self._start_coms()

    def point(self, number: int) -> tuple[float, float, float]:
        """Return where the command of a number sends the gripper [m]."""
        a, b, c = self._start
        found = MECHANISM.fk(Joints(a - STEP * number, b, c))
        return (found.x, found.y, found.z)

    def _start_robot(self) -> Process:
        line = f"up --port 0 --skip-home --rosbridge-port {self._rosbridge} --address {self._address}"
        process = Process(f"{line} --journal {self._folder}/maya.db", env=self._environment)
        process.until("maya home")
        return process

    def _start_coms(self) -> Process:
        line = f"coms --connect --port 0 --url {self._scheme}://127.0.0.1:{self.network.port}"
        process = Process(f"{line} --rosbridge ws://127.0.0.1:{self._rosbridge}", env=self._environment)
        process.until("http://")
        return process

    def kill_robot(self) -> None:
        """Kill `maya up`, and start it again."""
        self.robot.kill()
        self.robot = self._start_robot()

    def kill_coms(self) -> None:
        """Kill `maya coms`, and start it again."""
        self.coms.kill()
        self.coms = self._start_coms()

    def kill_broker(self) -> None:
        """Kill the broker, and start it again."""
        self.broker.kill()
        self.broker.start()

    def end_broker(self) -> None:
        """End the broker as a service manager does, and start it again."""
        self.broker.end()
        self.broker.start()

    def stop_coms(self) -> None:
        """Suspend `maya coms`; `go_on` lets it go on."""
        self.coms.send(signal.SIGSTOP)

    def go_on(self) -> None:
        """End what lasts."""
        with suppress(ProcessLookupError):
            self.coms.send(signal.SIGCONT)
        self.network.let_go()

    def close(self) -> None:
        """End all."""
        self.go_on()
        self.coms.kill()
        self.robot.kill()
        self.network.close()


@contextmanager
def world(folder: Path) -> Iterator[tuple[World, Supervisor]]:
    with ExitStack() as held:
        twin, address = held.enter_context(served(seed=5))
        with Wire(address) as wire:
            mark(twin, wire)
        one = held.enter_context(broker(folder))
        there = World(twin, address, one, folder)
        held.callback(there.close)
        lab = Supervisor(one)
        held.callback(lab.close)
        yield there, lab


def test_no_command_is_lost_and_none_runs_twice(campaign: Campaign, tmp_path: Path) -> None:
    rng = campaign.rng()
    sent = 0
    with world(tmp_path) as (there, lab):
        for _ in range(campaign.size(ci=20, long=300)):
            while len(lab.unanswered) < 3:
                sent += 1
                lab.send(str(sent), there.point(sent))
            for _ in range(rng.randrange(4)):
                lab.wait()
            _disturb(there, lab, rng)
        while lab.unanswered:
            lab.wait()
        results = [json.loads(text) for texts in lab.results.values() for text in texts]
    assert len(results) == len(lab.results) == sent, "every command has one final result"
    assert any(result["success"] for result in results)
    assert all(result["success"] or result["code"] in ENDINGS for result in results), results
    assert len(there.begun) > 1
    turned_back = [two - one for one, two in pairwise(there.begun) if two - one > STEP / 2]
    assert not turned_back, "a step ran again"


ENDINGS = {"INTERRUPTED", "4042", "1011", "2202", "2310"}
"""How a step may end whose robot was killed."""


def _disturb(there: World, lab: Supervisor, rng: Random) -> None:
    """Have something fail."""
    failures: list[tuple[int, Callable[[], Any]]] = [
        (2, there.kill_robot),
        (3, there.kill_coms),
        (3, there.kill_broker),
        (2, there.end_broker),
        (3, there.network.cut),
        (2, there.network.hold),
        (2, there.stop_coms),
        (3, lab.send_again),
    ]
    (chosen,) = rng.choices([what for _, what in failures], [weight for weight, _ in failures])
    chosen()
    if rng.random() < 0.7:
        lab.wait()
    there.go_on()
