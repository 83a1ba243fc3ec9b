"""Hostile commands in a Realtime Database: each is answered or refused as documented, and nothing else is disturbed.

The database, `maya coms`, rosbridge, `maya up` and its twin are real; the database has the rules of the documentation,
but a supervisor whose account is stolen can write all this. The twin's own record says whether the robot moved.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import pytest

from maya_un.errors import (
    InvalidMessage,
    InvalidRequest,
    InvalidValue,
    KeyReused,
    StepExpired,
    StepNotBegun,
    StepOfOtherRobot,
    UnknownName,
    Unreachable,
)
from maya_un.graph.steps import QUIET
from tests.system.processes import Process, running
from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_coms import asked, url_in
from tests.system.test_coms_rtdb import ROBOT, coms, wait

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

PLACE = {"x": 0.5, "y": 0.9, "z": 0.5}
NEAR = {"command": "approach", "args": PLACE}
TELEOP = {"command": "can_teleop"}
DEEP = '{"command": "home", "args": ' + "[" * 900 + "]" * 900 + "}"
OLD = "2001-01-01T00:00:00Z"


def below(levels: int) -> Any:
    """Return objects within each other."""
    return {"a": below(levels - 1)} if levels else 1


REFUSED: dict[str, tuple[Any, int]] = {
    "10 MB": ({"command": "home", "args": {"x": "x" * 10_000_000}}, InvalidMessage.code),
    "10 MB of text": ("x" * 10_000_000, InvalidMessage.code),
    "deep text": (DEEP, InvalidMessage.code),
    "deeper text": ("[" * 60_000, InvalidMessage.code),
    "deep id": ({**NEAR, "id": below(25)}, InvalidRequest.code),
    "number": (3, InvalidMessage.code),
    "text": ("home", InvalidMessage.code),
    "true": (True, InvalidMessage.code),
    "array": (["home", "home"], InvalidMessage.code),
    "array as command": ({"command": ["home"]}, UnknownName.code),
    "array as args": ({**NEAR, "args": [0.5, 0.9, 0.5]}, InvalidRequest.code),
    "array as id": ({**NEAR, "id": ["1"]}, InvalidRequest.code),
    "no command": ({"args": PLACE}, InvalidRequest.code),
    "unknown command": ({"command": "dance"}, UnknownName.code),
    "stop": ({"command": "stop"}, UnknownName.code),
    "true as x": ({**NEAR, "args": {**PLACE, "x": True}}, InvalidValue.code),
    "text as x": ({**NEAR, "args": {**PLACE, "x": "0.5"}}, InvalidValue.code),
    "no number": ('{"command": "approach", "args": {"x": NaN, "y": 1, "z": 1}}', InvalidValue.code),
    "no limit": ('{"command": "approach", "args": {"x": 1e999, "y": 1, "z": 1}}', InvalidValue.code),
    "long number": ({**NEAR, "args": {**PLACE, "x": 10**300}}, InvalidValue.code),
    "far away": ({**NEAR, "args": {**PLACE, "x": 5}}, Unreachable.code),
    "other robot": ({**NEAR, "robot": "OTHER"}, StepOfOtherRobot.code),
    "array as robot": ({**NEAR, "robot": ["MAYA"]}, InvalidRequest.code),
    "late": ({**NEAR, "deadline": OLD}, StepExpired.code),
    "no date": ({**NEAR, "deadline": "tomorrow"}, InvalidRequest.code),
    "control characters as id": ({**NEAR, "id": "a\nb"}, InvalidRequest.code),
    "other content": ({**TELEOP, "id": "home"}, KeyReused.code),
    "wrong content": ({"command": "dance", "id": "home"}, KeyReused.code),
    "k" * 300: ({"command": "home"}, InvalidRequest.code),
    "ä ö?&=%2e\\\"'<b>": ({"command": "dance"}, UnknownName.code),
    "__proto__": ({"command": "dance"}, UnknownName.code),
}
"""Commands by their key, and the code of each refusal."""

EMPTY: dict[str, Any] = {"null": None, "nothing": {}, "nothing deep": {"args": {"x": None}}, "no array": []}
"""These are no commands: the database does not keep them."""


class House(NamedTuple):
    """A database with a robot that is at home, and the URLs of its `maya coms` and of its `maya up`."""

    database: RealtimeDatabase
    link: str
    door: str

    def send(self, key: str, command: Any) -> None:
        """Write a command."""
        self.database.set(f"{ROBOT}/commands/{key}", command)

    def result(self, key: str) -> dict[str, Any]:
        """Return the result of a command when it is there, and check that the command is gone."""
        wait(lambda: self.database.get(f"{ROBOT}/results/{key}") is not None)
        assert self.database.get(f"{ROBOT}/commands/{key}") is None
        found: dict[str, Any] = self.database.get(f"{ROBOT}/results/{key}")
        return found

    def require_well(self, key: str) -> None:
        """Check that a good command succeeds, and that both sides are connected."""
        self.send(key, NEAR)
        result = self.result(key)
        assert result["success"], result
        status = asked("GET", self.link, "/status")
        assert (status["state"], status["steps"]) == ("connected", {})


@pytest.fixture(scope="module")
def house() -> Iterator[House]:
    with realtime_database() as database, running("up --port 0 --rosbridge-port 0 --journal memory --speed 100") as up:
        door, rosbridge = url_in(up.until("Door:")), url_in(up.until("ws://"))
        with connected(database, rosbridge) as link:
            one = House(database, url_in(link.until("http://")), door)
            one.send("home", {"command": "home"})
            assert one.result("home")["success"]
            yield one


@contextmanager
def connected(database: RealtimeDatabase, rosbridge: str) -> Iterator[Process]:
    """Run `maya coms`, connected."""
    link = coms(database, rosbridge, "--connect")
    try:
        yield link
    finally:
        link.kill()


def test_each_hostile_command_gets_its_refusal(house: House) -> None:
    for key, (command, code) in REFUSED.items():
        house.send(key, command)
        result = house.result(key)
        assert (result["success"], result.get("code")) == (False, str(code)), key
        assert len(json.dumps(result)) < 4000, key
    house.require_well("after each")


def test_all_hostile_commands_at_once_get_their_refusals(house: House) -> None:
    house.database.set(f"{ROBOT}/results", None)
    before = house.database.get(f"{ROBOT}/presence/at")
    all_ = {key: command for key, (command, _) in REFUSED.items()} | EMPTY
    house.database.set(f"{ROBOT}/commands", {**all_, "~": NEAR, "0": NEAR})
    for key, (_, code) in REFUSED.items():
        assert house.result(key).get("code") in {str(code), str(StepNotBegun.code)}, key
    assert house.result("0")["success"]
    house.result("~")
    assert house.database.get(f"{ROBOT}/commands") is None
    assert not EMPTY.keys() & house.database.get(f"{ROBOT}/results").keys()
    assert house.database.get(f"{ROBOT}/presence/at") >= before
    house.require_well("after all")


@pytest.mark.parametrize("nonsense", [7, "home", ["home", None, {"command": "dance"}], True])
def test_nonsense_in_place_of_all_commands_disturbs_nothing(nonsense: Any, house: House) -> None:
    house.database.set(f"{ROBOT}/commands", nonsense)
    house.database.set(f"{ROBOT}/progress", nonsense)
    house.database.set(f"{ROBOT}/document", nonsense)
    house.require_well(f"after {type(nonsense).__name__}")


def test_more_commands_at_once_than_may_wait_delay_no_stop(house: House) -> None:
    house.database.set(f"{ROBOT}/results", None)
    bad = {f"b{number:04}": {"command": "dance"} for number in range(200)}
    good = {f"g{number:04}": {**NEAR, "args": {**PLACE, "z": 0.5 + number % 2}} for number in range(900)}
    house.database.set(f"{ROBOT}/commands", {**bad, **good})
    wait(lambda: house.database.get(f"{ROBOT}/results/g0000") is not None)
    assert asked("POST", house.door, "/v1/stop")["status"] == 200
    wait(lambda: house.database.get(f"{ROBOT}/commands") is None)
    results = house.database.get(f"{ROBOT}/results")
    assert results.keys() == bad.keys() | good.keys()
    assert {results[key]["code"] for key in bad} == {str(UnknownName.code)}
    ended = [results[key].get("code") for key in good]
    assert ended.count(str(StepNotBegun.code)) > 800
    quiet = time.monotonic() + 2 * QUIET
    wait(lambda: time.monotonic() > quiet)  # for so long no command may come after a stop
    house.require_well("after more than may wait")
