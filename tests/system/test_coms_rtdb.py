"""Firebase's library, a database, `maya coms`, rosbridge, `maya up` and its twin: each a process of its own.

Only the database runs within the tests. The place of the part is the twin's own record.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from maya_un.errors import InvalidMessage, Unreachable
from tests.secrecy import secret
from tests.system.processes import Process
from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_coms import call, url_in
from tests.system.test_rosbridge_clients import SCRIPTS, node, served, stands_on_the_tray
from tests.system.test_rtdb_sdks import output_of
from tests.waiting import eventually

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

RULES = (Path(__file__).parents[2] / "contrib/firebase/database.rules.json").read_text()
ROBOT = "robots/MAYA"
PASSWORD = secret("password of the robot")
API_KEY = secret("key-of-the-project")

STEPS: tuple[dict[str, Any], ...] = (
    {"command": "home", "id": "first"},
    {"command": "pick", "args": {"x": 0.41, "y": 1.13, "z": 0.4}},
    {"command": "place", "args": {"x": 1.18, "y": 0.21, "z": 0.4}},
    {"args": {"x": 0.5, "y": 0.9, "z": 0.5}, "key": "old form"},
    {"command": "approach", "args": {"x": 5, "y": 0.9, "z": 0.5}},
    {"command": "x" * 100_000},
)


def admit(database: RealtimeDatabase, port: object = None) -> dict[str, str]:
    """Give the robot MAYA an account; return the environment that signs it in, by default at the database itself."""
    database.store.users["maya@example.org"] = PASSWORD
    database.set("accounts/maya", {"robot": "MAYA"})
    return {
        "FIREBASE_AUTH_EMULATOR_HOST": f"127.0.0.1:{database.port if port is None else port}",
        "MAYA_COMS_USER": "maya@example.org",
        "MAYA_COMS_PASSWORD": PASSWORD,
        "MAYA_COMS_API_KEY": API_KEY,
    }


def coms(database: RealtimeDatabase, rosbridge: str, *more: str, **environment: str) -> Process:
    line = ["coms", "--port 0", f"--url {database.url}/?ns=demo", f"--rosbridge {rosbridge}", *more]
    return Process(" ".join(line), env=environment)


def wait(holds: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    eventually(holds, "what the test waits for")


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for a library in real time")
def test_firebases_library_has_the_robot_carry_a_part() -> None:
    with realtime_database() as database, served() as robot:
        database.set(f"{ROBOT}/document", {"default_command": "approach"})
        link = coms(database, robot.url)
        try:
            url = url_in(link.until("http://"))
            assert call("GET", url, "/status")["state"] == "idle"
            assert call("POST", url, "/connect")["status"] == 200
            steps = [json.dumps(step) for step in STEPS]
            said = output_of(database, node(), SCRIPTS / "rtdb_supervisor.mjs", database.port, "MAYA", *steps)
            assert call("GET", url, "/status")["state"] == "connected"
            assert call("POST", url, "/disconnect")["state"] == "idle"
        finally:
            link.kill()
        assert stands_on_the_tray(robot.cube)
        assert database.get(f"{ROBOT}/presence/state") == "OFFLINE"
        assert database.get(ROBOT).keys() == {"document", "presence", "session"}
    assert said["presence"] == "ONLINE"
    results = said["results"]
    assert [one["result"].get("code") for one in results] == [
        None, None, None, None, str(Unreachable.code), str(InvalidMessage.code),
    ]  # fmt: skip
    assert [one["result"]["success"] for one in results] == [True, True, True, True, False, False]
    assert [one["open"] for one in results] == [None] * len(STEPS)
    assert results[0]["result"]["id"] == "first"
    assert all(one["result"]["id"] == one["key"] for one in results[1:5])
    assert results[1]["states"][-1] == "executing"


@pytest.mark.waits("2.4 s of homing at a hundred times real speed, between processes in real time")
def test_commands_survive_the_death_of_coms_and_each_has_one_result() -> None:
    with realtime_database(RULES) as database, served() as robot:
        environment = admit(database)
        link = coms(database, robot.url, "--connect", **environment)
        try:
            database.set(f"{ROBOT}/commands/k1", {"id": "1", "command": "home"})
            wait(lambda: database.get(f"{ROBOT}/progress/k1") is not None)
            link.kill()
            target = {"x": 0.5, "y": 0.9, "z": 0.5}
            database.set(f"{ROBOT}/commands/k2", {"id": "2", "command": "approach", "args": target})
            database.revoke_all()
            link = coms(database, robot.url, "--connect", **environment)
            url = url_in(link.until("http://"))
            wait(lambda: database.get(f"{ROBOT}/commands") is None)
            shown = json.dumps(call("GET", url, "/status"))
            shown += link.command_line
            database.revoke_all()
            database.set(f"{ROBOT}/commands/k3", {"id": "3", "command": "can_teleop"})
            wait(lambda: database.get(f"{ROBOT}/commands") is None)
        finally:
            link.kill()
        found = database.get(f"{ROBOT}/results")
        assert {key: (one["id"], one["success"]) for key, one in found.items()} == {
            f"k{number}": (str(number), True) for number in (1, 2, 3)
        }
        written = [path[3] for path, _ in database.store.writes if path[:3] == ("robots", "MAYA", "results")]
        assert written == ["k1", "k2", "k3"]
    assert PASSWORD not in shown
    assert API_KEY not in shown
