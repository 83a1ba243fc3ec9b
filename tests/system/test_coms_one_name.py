"""Two robots with one name at one database: no command runs on both, and the first one gives way with a message.

Each robot, its twin and its link are processes of their own. The journals of both robots say what each has accepted;
they are read as plain SQLite. The database keeps every write; as a Realtime Database it obeys our rules.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest

from maya_un.config.files import parse
from maya_un.errors import SessionTakenOver, StepTakenElsewhere
from maya_un.http.doctor import host
from maya_un.schema.diagnosis import FindingOutcome
from tests.system.processes import CALM, Process, running
from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_coms import call, supervisors_of, url_in
from tests.system.test_coms_rtdb import RULES, admit, wait

pytestmark = [pytest.mark.system, pytest.mark.timeout(600)]

ROBOT = "robots/MAYA"


class Cloud:
    """A database for both of its services, with the actions of a supervisor."""

    def __init__(self, database: RealtimeDatabase, kind: str) -> None:
        self._database = database
        self._is_tree = kind == "rtdb"
        self.url = database.url if self._is_tree else "firestore://demo"
        self.environment = {"FIRESTORE_EMULATOR_HOST": f"127.0.0.1:{database.port}", **admit(database)}
        if not self._is_tree:
            database.set_document(ROBOT, {})

    def send(self, key: str, command: str = "home", **args: float) -> None:
        """Send a command."""
        data = {"command": command, "args": args}
        if self._is_tree:
            self._database.set(f"{ROBOT}/commands/{key}", data)
        else:
            self._database.set_document(f"{ROBOT}/commands/{key}", data)

    def of(self, kind: str, key: str) -> Any:
        """Return the progress or the result of a command."""
        path = f"{ROBOT}/{kind}/{key}"
        return self._database.get(path) if self._is_tree else self._database.document(path)

    def results(self) -> list[str]:
        """Return the key of every result that was ever written."""
        if self._is_tree:
            return [path[3] for path, _ in tuple(self._database.store.writes) if path[2:3] == ("results",)]
        return [path.split("/")[3] for path, _ in tuple(self._database.documents.written) if "/results/" in path]


class Robot:
    """A robot with its journal, and its link to the cloud; both run until `close`."""

    def __init__(self, folder: Path, cloud: Cloud, rosbridge: str) -> None:
        self._journal = folder / "steps.db"
        self._line = f"coms --connect --port 0 --url {cloud.url} --rosbridge {rosbridge}"
        self._environment = cloud.environment
        self.link: Process | None = None
        self.url = ""

    def connect(self) -> None:
        """Start its link."""
        self.link = Process(self._line, env=self._environment)
        self.url = url_in(self.link.until("http://"))

    def kill_link(self) -> None:
        """Kill its link."""
        if self.link is not None:
            self.link.kill()
            self.link = None

    @property
    def state(self) -> str:
        """The state of its link."""
        return str(call("GET", self.url, "/status")["state"])

    @property
    def has_given_way(self) -> bool:
        """Whether its link reports that another robot has its name."""
        return supervisors_of(self.url)["code"] == SessionTakenOver.code

    def accepted(self) -> set[str]:
        """Return the ids of the steps that it has accepted."""
        with closing(sqlite3.connect(f"file:{self._journal}?mode=ro", uri=True)) as journal:
            return {id_ for (id_,) in journal.execute("SELECT id FROM steps")}


@contextmanager
def robot(folder: Path, cloud: Cloud, speed: int = 100) -> Iterator[Robot]:
    folder.mkdir()
    environment = {"MAYA_STATE_DIR": str(folder), "MAYA_RUNTIME_DIR": str(folder / "run")}
    line = f"up --port 0 --rosbridge-port 0 --journal {folder}/maya.db --speed {speed} {CALM}"
    with running(line, env=environment) as up:
        one = Robot(folder, cloud, url_in(up.until("ws://")))
        try:
            yield one
        finally:
            one.kill_link()


@pytest.fixture(params=["rtdb", "firestore"])
def there(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[Cloud, Robot, Robot]]:
    """Yield a cloud and two robots with one name, neither of them connected; the first one is slow."""
    with realtime_database(RULES) as database:
        cloud = Cloud(database, request.param)
        with (
            robot(tmp_path / "first", cloud, 10) as first,
            robot(tmp_path / "second", cloud) as second,
        ):
            yield cloud, first, second


@pytest.mark.waits("up to 10 s until the first robot's next heartbeat finds that another has its name")
def test_no_command_moves_both_robots_and_the_first_gives_way(there: tuple[Cloud, Robot, Robot]) -> None:
    cloud, first, second = there
    first.connect()
    wait(lambda: first.state == "connected")
    keys = [f"k{number:02}" for number in range(30)]
    for key in keys[:10]:
        cloud.send(key, "can_teleop")
    second.connect()
    for key in keys[10:20]:
        cloud.send(key, "can_teleop")
    wait(lambda: first.has_given_way)
    for key in keys[20:]:
        cloud.send(key, "can_teleop")
    wait(lambda: all(cloud.of("results", key) is not None for key in keys))
    assert not first.accepted() & second.accepted(), "both robots carried out a command"
    assert set(keys[20:]) <= second.accepted()
    assert sorted(cloud.results()) == keys
    assert second.state == "connected"
    status = supervisors_of(first.url)
    assert status["waits_for"] == str(SessionTakenOver(where=cloud.url, name="MAYA"))
    (found,) = host.coms(parse({"coms": {"server_address": first.url}}))
    assert (found.outcome, found.key) == (FindingOutcome.FAIL, "coms_taken")


def test_running_step_is_not_begun_by_the_second_robot(there: tuple[Cloud, Robot, Robot]) -> None:
    cloud, first, second = there
    first.connect()
    cloud.send("long", "home")
    wait(lambda: cloud.of("progress", "long") is not None)
    assert first.accepted() == {"long"}
    second.connect()
    wait(lambda: cloud.of("results", "long") is not None)
    result = cloud.of("results", "long")
    assert (result["success"], result["code"]) == (False, str(StepTakenElsewhere.code))
    assert second.accepted() == set()


@pytest.mark.waits("24 s of homing at ten times real speed, between processes in real time")
@pytest.mark.long
def test_link_of_a_robot_reconnects_after_a_crash(there: tuple[Cloud, Robot, Robot]) -> None:
    cloud, first, _ = there
    first.connect()
    cloud.send("before", "home")
    wait(lambda: cloud.of("progress", "before") is not None)
    first.kill_link()
    cloud.send("meanwhile", "can_teleop")
    first.connect()
    wait(lambda: all(cloud.of("results", key) is not None for key in ("before", "meanwhile")))
    assert cloud.of("results", "before")["success"] is True
    assert cloud.of("results", "meanwhile")["success"] is True
    assert first.accepted() == {"before", "meanwhile"}


@pytest.mark.waits("up to 10 s until the first robot's next heartbeat finds that another has its name")
@pytest.mark.long
def test_a_robot_that_gave_way_takes_the_name_back_at_connect(there: tuple[Cloud, Robot, Robot]) -> None:
    cloud, first, second = there
    first.connect()
    wait(lambda: first.state == "connected")
    second.connect()
    wait(lambda: first.has_given_way)
    second.kill_link()
    call("POST", first.url, "/disconnect")
    call("POST", first.url, "/connect")
    cloud.send("k", "can_teleop")
    wait(lambda: cloud.of("results", "k") is not None)
    assert first.accepted() == {"k"}
