"""The chaos that every transport must survive: supervisors, server, network, link and robot fail at random instants.

Each command turns the boom a little further, so a step that ran again later would turn it back: the twin's mechanics
see that. A transport brings its server, the failures that only it has, and a supervisor: a foreign client that keeps
its own account of commands and results.
"""

from __future__ import annotations

import json
import queue
import signal
import socket
import threading
import time
from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from maya_un.assembly.controller import Twin
from maya_un.config import Config
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints
from tests.campaign import Campaign
from tests.ports import free_port
from tests.system.processes import Process, Wire
from tests.system.test_watchdog import mark, served

STEP = 0.004
"""Each command turns the boom so much further [rad]."""

ENDINGS = {"success", "INTERRUPTED", "4042", "1011", "2202", "2310", "2105"}
"""Ends of a step whose robot was killed, or so slow that the watchdog stopped it (2310).

After that it refuses steps (2105) until it is killed and starts again.
"""

MECHANISM = Mechanism.of(Config())

_OPEN = 3
"""Number of commands without a result while something fails."""

_PATIENCE = 300.0
"""For the last results, when nothing fails any more [s]."""

Failure = tuple[int, Callable[[], Any]]
"""Relative frequency and function of each incident."""


class Supervisor(ABC):
    """Sends commands: `sent` holds them by the key of their delivery. It uses nothing of the package."""

    def __init__(self) -> None:
        self.sent: dict[str, dict[str, Any]] = {}
        self._changes: queue.Queue[None] = queue.Queue()

    def send(self, number: int, point: tuple[float, float, float]) -> None:
        """Send the command of a number."""
        key = f"k{number:04}"
        args = dict(zip("xyz", point, strict=True))
        self.sent[key] = {"id": f"id {key}", "command": "approach", "args": args}
        self.write(key)

    @property
    def unanswered(self) -> list[str]:
        """Return the keys of the commands without a result."""
        return sorted(self.sent.keys() - {key for key, _ in self.results()})

    def notice(self) -> None:
        """Note that something was reported."""
        self._changes.put(None)

    def wait(self, patience: float = 5.0) -> bool:
        """Wait until something is reported, at most so long [s]; return whether something was."""
        try:
            self._changes.get(timeout=patience)
        except queue.Empty:
            return False
        while not self._changes.empty():
            self._changes.get()
        return True

    @abstractmethod
    def write(self, key: str) -> None:
        """Send the command of a key to the server."""

    @abstractmethod
    def send_again(self) -> None:
        """Send what has no result once more."""

    @abstractmethod
    def results(self) -> list[tuple[str, dict[str, Any]]]:
        """Return key and value of every result that was ever given, one that was given twice twice."""


class Network:
    """Between the link and the server: passes bytes on, and cuts or holds them."""

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


class Server(NamedTuple):
    """The broker or database between supervisors and the link. Its port stays the same."""

    port: int
    kill: Callable[[], object]
    start: Callable[[], object]


class World:
    """All that can fail, and the twin that does not.

    In `url`, the address of the supervisors' server, and in the `environment` of `maya coms`, {port} stands for the
    port of the network before the server.
    """

    def __init__(
        self, twin: Twin, address: str, server: Server, folder: Path, url: str, environment: dict[str, str]
    ) -> None:
        self._server = server
        self._away = False
        self.network = Network(server.port)
        self._url = url.format(port=self.network.port)
        self._address = address
        self._folder = folder
        self._environment = {name: value.format(port=self.network.port) for name, value in environment.items()} | {
            "MAYA_RUNTIME_DIR": str(folder / "run"),
            "MAYA_STATE_DIR": str(folder / "state"),
        }
        self._rosbridge = free_port()
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
        line = f"coms --connect --port 0 --url {self._url} --rosbridge ws://127.0.0.1:{self._rosbridge}"
        process = Process(line, env=self._environment)
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

    def end_server(self, how: Callable[[], object] | None = None) -> None:
        """End the server, by killing it unless requested otherwise; `go_on` starts it again."""
        (how or self._server.kill)()
        self._away = True

    def stop_coms(self) -> None:
        """Suspend `maya coms`; `go_on` lets it go on."""
        self.coms.send(signal.SIGSTOP)

    def go_on(self) -> None:
        """End what lasts."""
        with suppress(ProcessLookupError):
            self.coms.send(signal.SIGCONT)
        self.network.let_go()
        if self._away:
            self._server.start()
        self._away = False

    def close(self) -> None:
        """End all."""
        self.go_on()
        self.coms.kill()
        self.robot.kill()
        self.network.close()


@contextmanager
def world(server: Server, folder: Path, url: str, **environment: str) -> Iterator[World]:
    """Run a robot that is at home and its link to a server; see `World`."""
    with ExitStack() as held:
        twin, address = held.enter_context(served(seed=5))
        with Wire(address) as wire:
            mark(twin, wire)
        there = World(twin, address, server, folder, url, environment)
        held.callback(there.close)
        yield there


def disturb(campaign: Campaign, there: World, lab: Supervisor, *more: Failure) -> None:
    """Let things fail while a supervisor commands the robot, until every command has its result."""
    rng = campaign.rng()
    failures: list[Failure] = [
        (2, there.kill_robot),
        (3, there.kill_coms),
        (3, there.end_server),
        (3, there.network.cut),
        (2, there.network.hold),
        (2, there.stop_coms),
        (2, lab.send_again),
        *more,
    ]
    number = 0
    for _ in range(campaign.size(ci=20, long=300)):
        for _ in range(_OPEN - len(lab.unanswered)):
            number += 1
            lab.send(number, there.point(number))
        for _ in range(rng.randrange(4)):
            lab.wait()
        (chosen,) = rng.choices([what for _, what in failures], [weight for weight, _ in failures])
        chosen()
        if rng.random() < 0.7:
            lab.wait(2.0)
        there.go_on()
    latest = time.monotonic() + _PATIENCE
    while lab.unanswered:
        assert time.monotonic() < latest, f"commands without a result: {lab.unanswered}"
        lab.wait()


def judge(there: World, lab: Supervisor) -> None:
    """Check that no command was lost, that none ran twice, and that each has one final result."""
    results = lab.results()
    assert sorted(key for key, _ in results) == sorted(lab.sent), "every command has one result, given once"
    endings: Counter[str] = Counter()
    finals: defaultdict[str, set[str]] = defaultdict(set)
    for key, value in results:
        assert value["id"] == lab.sent[key]["id"]
        finals[value["id"]].add(json.dumps(value, sort_keys=True))
        endings["success" if value["success"] else value["code"]] += 1
    print(f"{len(lab.sent)} commands with {len(finals)} ids: {dict(endings)}")
    assert all(len(one) == 1 for one in finals.values()), "every id has one final result"
    assert endings["success"] > len(results) / 8, endings  # on a busy machine, disturbances interrupt most commands
    assert endings.keys() <= ENDINGS
    assert len(there.begun) > 1
    turned_back = [two - one for one, two in pairwise(there.begun) if two - one > STEP / 2]
    assert not turned_back, "a step ran again"
