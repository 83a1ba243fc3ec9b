"""Database, network, tokens, link and robot fail at random instants: no command is lost, none runs twice.

As test_coms_chaos.py, over a Realtime Database. The database's own log of writes says how often a result was written.
"""

from __future__ import annotations

import queue
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.campaign import Campaign
from tests.system.processes import Wire
from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_coms_chaos import ENDINGS, STEP, World
from tests.system.test_coms_rtdb import API_KEY, PASSWORD
from tests.system.test_guard import mark, served

pytestmark = [pytest.mark.system, pytest.mark.timeout(3600)]

ROBOT = ("robots", "MAYA")
RULES = (Path(__file__).parents[2] / "contrib/firebase/database.rules.json").read_text()


class Server:
    """The database as what is killed and started; its data stays."""

    def __init__(self, database: RealtimeDatabase) -> None:
        self.port = database.port
        self.kill = self.end = database.go_away
        self.start = database.come_back


class Supervisor:
    """Sends commands, and hears of what is written."""

    def __init__(self, database: RealtimeDatabase) -> None:
        self._database = database
        self._commands: dict[str, Any] = {}
        self._written: queue.Queue[None] = queue.Queue()
        database.store.written = lambda: self._written.put(None)

    @property
    def unanswered(self) -> int:
        """Return how many commands have no result."""
        return len(self._commands.keys() - {key for key, _ in self.results()})

    def results(self) -> list[tuple[str, Any]]:
        """Return the key and value of every result that was ever written."""
        writes = tuple(self._database.store.writes)
        return [(path[3], value) for path, value in writes if path[:3] == (*ROBOT, "results")]

    def send(self, key: str, point: tuple[float, float, float]) -> None:
        """Send a command."""
        args = dict(zip("xyz", point, strict=True))
        self._commands[key] = {"id": f"id {key}", "command": "approach", "args": args}
        self._database.set(f"robots/MAYA/commands/{key}", self._commands[key])

    def send_again(self) -> None:
        """Write every command that is open once more, as it is."""
        for key in self._database.get("robots/MAYA/commands") or ():
            self._database.set_if_there(f"robots/MAYA/commands/{key}", self._commands[key])

    def wait(self, patience: float = 120.0) -> None:
        """Wait until something is written, presence included; raises `queue.Empty` if nothing is for so long [s]."""
        self._written.get(timeout=patience)
        while not self._written.empty():
            self._written.get()


def test_no_command_is_lost_and_none_runs_twice(campaign: Campaign, tmp_path: Path) -> None:
    rng = campaign.rng()
    sent = 0
    with served(seed=5) as (twin, address), realtime_database(RULES) as database:
        with Wire(address) as wire:
            mark(twin, wire)
        database.store.users["maya@example.org"] = PASSWORD
        database.set("accounts/maya", {"robot": "MAYA"})
        environment = {
            "FIREBASE_AUTH_EMULATOR_HOST": f"127.0.0.1:{database.port}",
            "MAYA_COMS_USER": "maya@example.org",
            "MAYA_COMS_PASSWORD": PASSWORD,
            "MAYA_COMS_API_KEY": API_KEY,
        }
        there = World(twin, address, Server(database), tmp_path, "http", environment)
        lab = Supervisor(database)
        try:
            for _ in range(campaign.size(ci=20, long=300)):
                while lab.unanswered < 3:
                    sent += 1
                    lab.send(f"k{sent:04}", there.point(sent))
                for _ in range(rng.randrange(4)):
                    lab.wait()
                _disturb(there, lab, database, rng)
            while lab.unanswered:
                lab.wait()
        finally:
            there.close()
        results = lab.results()
        assert database.get("robots/MAYA/commands") is None
    assert len(results) == len({key for key, _ in results}) == sent, "every command has one result, written once"
    assert all(value["id"] == f"id {key}" for key, value in results)
    assert any(value["success"] for _, value in results)
    assert all(value["success"] or value["code"] in ENDINGS for _, value in results), results
    assert len(there.begun) > 1
    turned_back = [two - one for one, two in pairwise(there.begun) if two - one > STEP / 2]
    assert not turned_back, "a step ran again"


def _disturb(there: World, lab: Supervisor, database: RealtimeDatabase, rng: Random) -> None:
    """Have something fail."""
    failures: list[tuple[int, Callable[[], Any]]] = [
        (2, there.kill_robot),
        (3, there.kill_coms),
        (3, there.kill_broker),
        (3, database.cut),
        (3, there.network.cut),
        (2, there.network.hold),
        (2, there.stop_coms),
        (3, database.revoke_all),
        (2, lab.send_again),
    ]
    (chosen,) = rng.choices([what for _, what in failures], [weight for weight, _ in failures])
    chosen()
    if rng.random() < 0.7:
        with suppress(queue.Empty):
            lab.wait(2.0)
    there.go_on()
