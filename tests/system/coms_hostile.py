"""Hostile commands that every database must survive: each is refused as documented, and nothing else is disturbed.

The database, `maya coms`, rosbridge, `maya up` and its twin are real. The database has the rules of the documentation,
but a supervisor whose account is stolen can write all this.
"""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import partial
from typing import Any

from maya_ros.graph.servers.steps import QUIET
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
from tests.system.test_coms import call
from tests.system.test_coms_rtdb import wait
from tests.waiting import eventually

PLACE = {"x": 0.5, "y": 0.9, "z": 0.5}
NEAR = {"command": "approach", "args": PLACE}

Refused = Mapping[str, tuple[Any, int]]
"""Commands by their key, and the code of each refusal."""


def below(levels: int) -> Any:
    """Return objects within each other."""
    return {"a": below(levels - 1)} if levels else 1


REFUSED: Refused = {
    "long": ({"command": "home", "args": {"x": "x" * 900_000}}, InvalidMessage.code),
    "deep id": ({**NEAR, "id": below(15)}, InvalidRequest.code),
    "array as command": ({"command": ["home"]}, UnknownName.code),
    "array as args": ({**NEAR, "args": [0.5, 0.9, 0.5]}, InvalidRequest.code),
    "array as id": ({**NEAR, "id": ["1"]}, InvalidRequest.code),
    "no command": ({"args": PLACE}, InvalidRequest.code),
    "unknown command": ({"command": "dance"}, UnknownName.code),
    "stop": ({"command": "stop"}, UnknownName.code),
    "true as x": ({**NEAR, "args": {**PLACE, "x": True}}, InvalidValue.code),
    "text as x": ({**NEAR, "args": {**PLACE, "x": "0.5"}}, InvalidValue.code),
    "long number": ({**NEAR, "args": {**PLACE, "x": 2**63 - 1}}, InvalidValue.code),
    "far away": ({**NEAR, "args": {**PLACE, "x": 5}}, Unreachable.code),
    "other robot": ({**NEAR, "robot": "OTHER"}, StepOfOtherRobot.code),
    "array as robot": ({**NEAR, "robot": ["MAYA"]}, InvalidRequest.code),
    "late": ({**NEAR, "deadline": "2001-01-01T00:00:00Z"}, StepExpired.code),
    "no date": ({**NEAR, "deadline": "tomorrow"}, InvalidRequest.code),
    "control characters as id": ({**NEAR, "id": "a\nb"}, InvalidRequest.code),
    "other content": ({"command": "can_teleop", "id": "home"}, KeyReused.code),
    "wrong content": ({"command": "dance", "id": "home"}, KeyReused.code),
    "k" * 300: ({"command": "home"}, InvalidRequest.code),
    "ä ö?&=%2e\\\"'<b>": ({"command": "dance"}, UnknownName.code),
}
"""Hostile commands that every database can hold."""


class DatabaseSetup(ABC):
    """A database with a robot that is at home, and the URLs of its `maya coms` and of its `maya up`."""

    def __init__(self, link: str, service: str) -> None:
        self.link = link
        self.service = service

    @abstractmethod
    def send_all(self, commands: Mapping[str, Any]) -> None:
        """Write commands by their keys, together."""

    @abstractmethod
    def found(self, key: str) -> dict[str, Any] | None:
        """Return the result of a command, None if there is none."""

    @abstractmethod
    def results(self) -> dict[str, dict[str, Any]]:
        """Return all results."""

    @abstractmethod
    def open(self) -> set[str]:
        """Return the keys of the open commands, of many only some."""

    @abstractmethod
    def clear(self) -> None:
        """Remove all results."""

    def result(self, key: str) -> dict[str, Any]:
        """Return the result of a command when it is there, and check that the command is gone."""
        wait(lambda: self.found(key) is not None)
        assert key not in self.open()
        result = self.found(key)
        assert result is not None
        return result

    def has_more(self, seen: int) -> bool:
        """Tell whether it has more results than were seen, or no open command."""
        return len(self.results()) > seen or not self.open()

    def stop(self) -> None:
        """Stop the robot."""
        assert call("POST", self.service, "/v1/stop")["status"] == 200

    def wait_after_stop(self) -> None:
        """Wait for as long as no command may come after a stop, and as long again."""
        quiet = time.monotonic() + 2 * QUIET
        wait(lambda: time.monotonic() > quiet)

    def require_well(self, key: str) -> None:
        """Check that a good command succeeds, and that both sides are connected."""
        self.send_all({key: NEAR})
        result = self.result(key)
        assert result["success"], result
        wait(lambda: call("GET", self.link, "/status")["steps"] == {})
        assert call("GET", self.link, "/status")["state"] == "connected"


def require_each_is_refused(house: DatabaseSetup, refused: Refused) -> None:
    """Send hostile commands one after the other."""
    for key, (command, code) in refused.items():
        house.send_all({key: command})
        result = house.result(key)
        assert (result["success"], result.get("code")) == (False, str(code)), key
        assert len(json.dumps(result)) < 4000, key
    house.require_well("after each")


def require_all_are_refused(house: DatabaseSetup, refused: Refused, empty: Mapping[str, Any]) -> None:
    """Send hostile commands at once, among `empty` ones that a database does not keep."""
    house.clear()
    house.send_all({key: command for key, (command, _) in refused.items()} | dict(empty) | {"~": NEAR, "0": NEAR})
    for key, (_, code) in refused.items():
        assert house.result(key).get("code") in {str(code), str(StepNotBegun.code)}, key
    assert house.result("0")["success"]
    house.result("~")
    assert not house.open()
    assert not empty.keys() & house.results().keys()
    house.require_well("after all")


def require_no_stop_is_delayed(house: DatabaseSetup) -> None:
    """Send more commands at once than may wait, and stop the robot."""
    house.clear()
    bad = {f"b{number:04}": {"command": "dance"} for number in range(200)}
    good = {f"g{number:04}": {**NEAR, "args": {**PLACE, "z": 0.5 + number % 2}} for number in range(900)}
    house.send_all({**bad, **good})
    wait(lambda: house.found("g0000") is not None)
    house.stop()
    while house.open():  # a thousand results take a busy machine minutes
        eventually(partial(house.has_more, len(house.results())), "another result", pause=1.0)
    results = house.results()
    assert results.keys() == bad.keys() | good.keys()
    assert {results[key]["code"] for key in bad} == {str(UnknownName.code)}
    ended = [results[key].get("code") for key in good]
    assert ended.count(str(StepNotBegun.code)) > 800
    house.wait_after_stop()
    house.require_well("after more than may wait")
