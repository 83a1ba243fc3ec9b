"""The campaign of tests/system/coms_chaos.py over Firestore.

The supervisor speaks plain REST. Firestore's own dates say how often a result was written.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.campaign import Campaign
from tests.system import coms_chaos
from tests.system.firestore_emulator import HTTP
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.system.test_coms_rtdb import admit

pytestmark = [pytest.mark.system, pytest.mark.timeout(3600)]

DOCUMENTS = "projects/demo/databases/(default)/documents"
ROBOT = f"{DOCUMENTS}/robots/MAYA"


class Supervisor(coms_chaos.Supervisor):
    """Adds commands, and asks for their results when Firestore writes something."""

    def __init__(self, database: RealtimeDatabase) -> None:
        super().__init__()
        self._url = f"{database.url}/v1"
        self._found: dict[str, dict[str, Any]] = {}
        database.store.written = self.notice

    def write(self, key: str) -> None:
        """Add a command."""
        self._commit(key, {"exists": False})

    def send_again(self) -> None:
        """Write every open command once more, as it is, and add each under another key too."""
        for key in self.unanswered:
            self._commit(key, {"exists": True})
            if f"{key}+" not in self.sent and not key.endswith("+"):
                self.sent[f"{key}+"] = self.sent[key]
                self.write(f"{key}+")

    def results(self) -> list[tuple[str, dict[str, Any]]]:
        """Return every result; one that was written twice has two dates."""
        found = self.below("results")
        return [(one["name"].rpartition("/")[2], _data(one)) for one in found for _ in _dates(one)]

    @property
    def unanswered(self) -> list[str]:
        """Return the keys of the commands without a result."""
        missing = [key for key in self.sent if key not in self._found]
        names = [f"{ROBOT}/results/{key}" for key in missing]
        for one in self._asked(f"{DOCUMENTS}:batchGet", {"documents": names}) if names else ():
            if "found" in one:
                self._found[one["found"]["name"].rpartition("/")[2]] = _data(one["found"])
        return sorted(self.sent.keys() - self._found.keys())

    def below(self, collection: str) -> list[dict[str, Any]]:
        """Return the documents of a collection of the robot."""
        query = {"structuredQuery": {"from": [{"collectionId": collection}]}}
        return [one["document"] for one in self._asked(f"{ROBOT}:runQuery", query) if "document" in one]

    def _commit(self, key: str, wanted: dict[str, bool]) -> None:
        """Write a command where the document exists, or where it does not, as is wanted."""
        command = self.sent[key]
        fields = {
            "id": {"stringValue": command["id"]},
            "command": {"stringValue": command["command"]},
            "args": {"mapValue": {"fields": {name: {"doubleValue": one} for name, one in command["args"].items()}}},
        }
        write = {"update": {"name": f"{ROBOT}/commands/{key}", "fields": fields}, "currentDocument": wanted}
        answer = HTTP.post(f"{self._url}/{DOCUMENTS}:commit", json={"writes": [write]})
        assert answer.is_success or wanted.get("exists"), answer.text

    def _asked(self, path: str, body: dict[str, Any]) -> list[dict[str, Any]]:
        answer = HTTP.post(f"{self._url}/{path}", json=body)
        assert answer.is_success, answer.text
        found: list[dict[str, Any]] = answer.json()
        return found


def _data(document: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a result; only its warnings are no plain values."""
    fields = document["fields"]
    return {name: next(iter(value.values())) for name, value in fields.items()}


def _dates(document: dict[str, Any]) -> set[str]:
    return {document["createTime"], document["updateTime"]}


@pytest.mark.waits("about 18 s of twenty failures with waits of up to 5 s, between processes in real time")
def test_no_command_is_lost_and_none_runs_twice(campaign: Campaign, tmp_path: Path) -> None:
    with realtime_database() as database:
        database.set_document("robots/MAYA", {})
        environment = {"FIRESTORE_EMULATOR_HOST": "127.0.0.1:{port}", **admit(database, "{port}")}
        server = coms_chaos.Server(database.port, database.go_away, database.come_back)
        lab = Supervisor(database)
        with coms_chaos.world(server, tmp_path, "firestore://demo", **environment) as there:

            def lose(*, answered: bool) -> None:
                database.faults.append(Fault("POST", '"writes": [{"delete"', answered=answered))

            coms_chaos.disturb(
                campaign,
                there,
                lab,
                (3, database.cut),
                (3, database.revoke_all),
                (2, lambda: lose(answered=False)),
                (2, lambda: lose(answered=True)),
            )
            assert lab.below("commands") == lab.below("progress") == []
        coms_chaos.judge(there, lab)
