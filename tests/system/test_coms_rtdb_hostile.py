"""The hostile commands of tests/system/coms_hostile.py in a Realtime Database, and those that only it can hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from maya_un.errors import InvalidMessage, InvalidRequest, InvalidValue, UnknownName
from tests.system import coms_hostile
from tests.system.coms_hostile import NEAR, below
from tests.system.processes import Process, running
from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_coms import UP, url_in
from tests.system.test_coms_rtdb import ROBOT, coms

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

DEEP = '{"command": "home", "args": ' + "[" * 900 + "]" * 900 + "}"

REFUSED: coms_hostile.Refused = {
    **coms_hostile.REFUSED,
    "10 MB": ({"command": "home", "args": {"x": "x" * 10_000_000}}, InvalidMessage.code),
    "10 MB of text": ("x" * 10_000_000, InvalidMessage.code),
    "deep text": (DEEP, InvalidMessage.code),
    "deeper text": ("[" * 60_000, InvalidMessage.code),
    "deeper id": ({**NEAR, "id": below(25)}, InvalidRequest.code),
    "number": (3, InvalidMessage.code),
    "text": ("home", InvalidMessage.code),
    "true": (True, InvalidMessage.code),
    "array": (["home", "home"], InvalidMessage.code),
    "no number": ('{"command": "approach", "args": {"x": NaN, "y": 1, "z": 1}}', InvalidValue.code),
    "no limit": ('{"command": "approach", "args": {"x": 1e999, "y": 1, "z": 1}}', InvalidValue.code),
    "longer number": ({**NEAR, "args": {"x": 10**300, "y": 1, "z": 1}}, InvalidValue.code),
    "__proto__": ({"command": "dance"}, UnknownName.code),
}

EMPTY: dict[str, Any] = {"null": None, "nothing": {}, "nothing deep": {"args": {"x": None}}, "no array": []}
"""These are no commands: the database does not keep them."""


class RtdbSetup(coms_hostile.DatabaseSetup):
    """A Realtime Database with a robot."""

    def __init__(self, database: RealtimeDatabase, link: str, service: str) -> None:
        super().__init__(link, service)
        self.database = database

    def send_all(self, commands: Mapping[str, Any]) -> None:
        """Write commands in one change; other commands are gone then."""
        if len(commands) > 1:
            self.database.set(f"{ROBOT}/commands", commands)
        for key in commands if len(commands) == 1 else ():
            self.database.set(f"{ROBOT}/commands/{key}", commands[key])

    def found(self, key: str) -> dict[str, Any] | None:
        """Return the result of a command."""
        found: dict[str, Any] | None = self.database.get(f"{ROBOT}/results/{key}")
        return found

    def results(self) -> dict[str, dict[str, Any]]:
        """Return all results."""
        found: dict[str, dict[str, Any]] = self.database.get(f"{ROBOT}/results") or {}
        return found

    def open(self) -> set[str]:
        """Return the keys of the open commands."""
        return set(self.database.get(f"{ROBOT}/commands") or ())

    def clear(self) -> None:
        """Remove all results."""
        self.database.set(f"{ROBOT}/results", None)


@pytest.fixture(scope="module")
def rtdb_setup() -> Iterator[RtdbSetup]:
    with realtime_database() as database, running(UP) as up:
        service, rosbridge = url_in(up.until("Service:")), url_in(up.until("ws://"))
        with connected(database, rosbridge) as link:
            one = RtdbSetup(database, url_in(link.until("http://")), service)
            one.send_all({"home": {"command": "home"}})
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


def test_each_hostile_command_gets_its_refusal(rtdb_setup: RtdbSetup) -> None:
    coms_hostile.require_each_is_refused(rtdb_setup, REFUSED)


def test_all_hostile_commands_at_once_get_their_refusals(rtdb_setup: RtdbSetup) -> None:
    before = rtdb_setup.database.get(f"{ROBOT}/presence/at")
    coms_hostile.require_all_are_refused(rtdb_setup, REFUSED, EMPTY)
    assert rtdb_setup.database.get(f"{ROBOT}/presence/at") >= before


@pytest.mark.parametrize("nonsense", [7, "home", ["home", None, {"command": "dance"}], True])
def test_nonsense_in_place_of_all_commands_disturbs_nothing(nonsense: Any, rtdb_setup: RtdbSetup) -> None:
    rtdb_setup.database.set(f"{ROBOT}/commands", nonsense)
    rtdb_setup.database.set(f"{ROBOT}/progress", nonsense)
    rtdb_setup.database.set(f"{ROBOT}/document", nonsense)
    rtdb_setup.require_well(f"after {type(nonsense).__name__}")


@pytest.mark.waits("3 s: twice the time for which no step may come after a stop")
def test_more_commands_at_once_than_may_wait_delay_no_stop(rtdb_setup: RtdbSetup) -> None:
    coms_hostile.require_no_stop_is_delayed(rtdb_setup)
