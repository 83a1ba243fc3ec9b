"""The campaign of tests/system/coms_chaos.py over a Realtime Database.

The database's own log of writes counts the writes of a result.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.campaign import Campaign
from tests.system import coms_chaos
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.system.test_coms_rtdb import RULES, admit

pytestmark = [pytest.mark.system, pytest.mark.timeout(3600)]

ROBOT = ("robots", "MAYA")


class Supervisor(coms_chaos.Supervisor):
    """Sends commands, and hears of what is written."""

    def __init__(self, database: RealtimeDatabase) -> None:
        super().__init__()
        self._database = database
        database.store.written = self.notice

    def write(self, key: str) -> None:
        """Write a command."""
        self._database.set(f"robots/MAYA/commands/{key}", self.sent[key])

    def send_again(self) -> None:
        """Write every command that is open once more, as it is."""
        for key in self.unanswered:
            self._database.set_if_there(f"robots/MAYA/commands/{key}", self.sent[key])

    def results(self) -> list[tuple[str, dict[str, Any]]]:
        """Return every result that was ever written."""
        writes = tuple(self._database.store.writes)
        return [(path[3], value) for path, value in writes if path[:3] == (*ROBOT, "results")]


@pytest.mark.waits("about 18 s of twenty failures with waits of up to 5 s, between processes in real time")
def test_no_command_is_lost_and_none_runs_twice(campaign: Campaign, tmp_path: Path) -> None:
    with realtime_database(RULES) as database:
        environment = admit(database, "{port}")
        server = coms_chaos.Server(database.port, database.go_away, database.come_back)
        lab = Supervisor(database)
        with coms_chaos.world(server, tmp_path, "http://127.0.0.1:{port}", **environment) as there:
            coms_chaos.disturb(
                campaign,
                there,
                lab,
                (3, database.cut),
                (3, database.revoke_all),
                (2, lambda: database.faults.append(Fault("PATCH", "results/", answered=True))),
            )
            assert database.get("robots/MAYA/commands") is None
        coms_chaos.judge(there, lab)
