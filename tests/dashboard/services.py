"""A service with a dashboard that keeps its port and its folder over a restart, and its robot."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, NamedTuple

from tests.ports import free_port
from tests.secrecy import secret
from tests.system.robots import LOOKS, up

PASSWORD = secret("root of the dashboard")
"""Of the user `root`."""

SPEED = 20
"""Of the robot's clock: homing takes some seconds, and a motion at a tenth of its speed can be stopped."""


class Answer(NamedTuple):
    """An answer over HTTP."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        """The content of the body."""
        return json.loads(self.body)


class Service(ABC):
    """A robot with a dashboard, which keeps its address and its files in `folder` over a restart."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.folder = folder
        self.token = ""

    @abstractmethod
    def start(self) -> None:
        """Start it, and return when it answers."""

    @abstractmethod
    def kill(self) -> None:
        """End it."""

    def request(self, method: str, path: str, body: object = None, **headers: str) -> Answer:
        """Return an answer with its headers, whose names are in lower case; `_` in the name of one stands for `-`."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=30.0)
        try:
            named = {name.replace("_", "-"): text for name, text in headers.items()}
            connection.request(method, path, None if body is None else json.dumps(body), named)
            answer = connection.getresponse()
            return Answer(answer.status, {name.lower(): text for name, text in answer.getheaders()}, answer.read())
        finally:
            connection.close()

    def ask(self, request: str, body: object = None) -> Any:
        """Return the answer to "METHOD /path", which must not be a refusal."""
        answer = self._asked(request, body)
        assert answer.status < 300, answer.body
        return answer.json

    def refused(self, request: str, body: object = None) -> bool:
        """Ask, and return whether the answer is a refusal."""
        status = self._asked(request, body).status
        assert status < 500
        return status >= 400

    def until(self, holds: Callable[[Any], bool], path: str = "/v1/status") -> Any:
        """Look at something until it is so, and return it."""
        found: Any = None
        for _ in range(LOOKS):
            found = self.ask(f"GET {path}")
            if holds(found):
                return found
            self.ask(f"GET /v1/events?since={self.newest}&wait=0.1")
        raise AssertionError(f"it never was so: {found}")

    def _asked(self, request: str, body: object) -> Answer:
        method, path = request.split(" ", 1)
        known = {"Authorization": f"Bearer {self.token}"} if self.token else {}
        return self.request(method, path, body, Content_Type="application/json", **known)

    @property
    def state(self) -> dict[str, Any]:
        """The robot's state."""
        return self.ask("GET /v1/status")["state"]

    @property
    def newest(self) -> int:
        """The number of the newest event."""
        return self.ask("GET /v1/status")["last_event"]

    def until_event(self, kind: str, since: int) -> Any:
        """Return the first event of a kind after another one."""
        found = self.until(lambda events: any(one["kind"] == kind for one in events), f"/v1/events?since={since}")
        return next(one for one in found if one["kind"] == kind)

    def until_homed(self) -> None:
        """Home the robot if it is not homed, and wait for its end."""
        if not self.state["homed"]:
            if self.state["mode"] != "homing":
                self.ask("POST /v1/tasks", {"command": "home"})
            self.until(lambda status: status["state"]["homed"])
        self.until(lambda status: status["state"]["mode"] == "idle")

    def begin_motion(self, ratio: float = 0.1) -> None:
        """Have the robot turn slowly by about a radian: it is under way for long."""
        self.until_homed()
        self.ask("POST /v1/speed", {"ratio": ratio})
        joints = self.state["joints"]
        to = [0.2 if joints[0] > 0.7 else 1.2, 1.5, 1.5]
        self.ask("POST /v1/tasks", {"command": "move", "joints": to})
        self.until(lambda status: status["state"]["moving"])

    def at(self, time: float) -> dict[str, Any]:
        """Return the robot's state at a time of its clock [s], or soon after."""
        return self.until(lambda status: status["state"]["time"] >= time)["state"]

    def require_rest(self) -> None:
        """Wait until the robot is at rest; it must then stay at its place for two seconds of its own clock."""
        at = self.until(lambda status: not status["state"]["moving"] and status["state"]["mode"] == "idle")["state"]
        later = self.at(at["time"] + 2.0)
        assert (later["moving"], later["counts"]) == (False, at["counts"])


class ServiceProcess(Service):
    """A `maya up` of its own, which can be killed as by a power cut."""

    def __init__(self, folder: Path, options: str, settings: str = "", **environment: str) -> None:
        super().__init__(folder)
        self.environment = environment
        self._config = folder / "maya.toml" if settings else ""
        if settings:
            (folder / "maya.toml").write_text(settings, encoding="utf-8")
        self._options = options
        self._stack = ExitStack()

    def start(self) -> None:
        """Start it, and return when it answers."""
        places = {
            "MAYA_CONFIG": str(self._config),
            "MAYA_RUNTIME_DIR": str(self.folder / "run"),
            "MAYA_STATE_DIR": str(self.folder / "state"),
            "XDG_CONFIG_HOME": str(self.folder / "config"),
            "XDG_STATE_HOME": str(self.folder / "state"),
            **self.environment,
        }
        self._stack.enter_context(up(self._options, places, port=self.port))

    def kill(self) -> None:
        """Kill it as a power cut does."""
        self._stack.close()


@contextmanager
def service(folder: Path, options: str, settings: str = "", **environment: str) -> Iterator[ServiceProcess]:
    """Run a `maya up` while the block runs; `settings` is the text of its configuration."""
    made = ServiceProcess(folder, options, settings, **environment)
    try:
        made.start()
        yield made
    finally:
        made.kill()
