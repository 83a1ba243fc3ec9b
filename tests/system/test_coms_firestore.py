"""Firestore's library, documents, `maya coms`, rosbridge, `maya up` and its twin: each a process of its own.

Only the documents are served within the tests; the library judges that server too. The place of the part is the twin's
own record.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

from maya_un.errors import Unreachable
from tests.system.processes import Process
from tests.system.rtdb.server import realtime_database
from tests.system.test_coms import call, url_in
from tests.system.test_rosbridge_clients import SCRIPTS, node, served, stands_on_the_tray
from tests.system.test_rtdb_sdks import output_of

pytestmark = [pytest.mark.system, pytest.mark.timeout(300)]

STEPS: tuple[dict[str, Any], ...] = (
    {"command": "home", "id": "first"},
    {"command": "pick", "args": {"x": 0.41, "y": 1.13, "z": 0.4}},
    {"command": "place", "args": {"x": 1.18, "y": 0.21, "z": 0.4}},
    {"args": {"x": 0.5, "y": 0.9, "z": 0.5}},
    {"command": "approach", "args": {"x": 5, "y": 0.9, "z": 0.5}},
)


@pytest.mark.waits("about 3 s of homing, a pick and a place at a hundred times real speed, for a library in real time")
def test_firestores_library_has_the_robot_carry_a_part() -> None:
    with realtime_database() as database, served() as robot:
        database.set_document("robots/MAYA", {"default_command": "approach"})
        where = {"FIRESTORE_EMULATOR_HOST": f"127.0.0.1:{database.port}"}
        link = Process(f"coms --port 0 --url firestore://demo --rosbridge {robot.url} --connect", env=where)
        try:
            url = url_in(link.until("http://"))
            said = output_of(
                database, node(), SCRIPTS / "firestore_supervisor.mjs", database.port, "MAYA", *map(json.dumps, STEPS)
            )
            supervisors = call("GET", url, "/status")["supervisors"]
            assert (supervisors["url"], supervisors["connected"]) == ("firestore://demo", True)
            assert call("POST", url, "/disconnect")["state"] == "idle"
        finally:
            link.kill()
        assert stands_on_the_tray(robot.cube)
        assert database.document("robots/MAYA/state/presence")["state"] == "OFFLINE"
        written = [path.split("/")[2:] for path, data in database.documents.written if data is not None]
    results = said["results"]
    assert [one["result"]["code"] for one in results] == [None, None, None, None, str(Unreachable.code)]
    assert [one["open"] for one in results] == [False] * len(STEPS)
    assert results[0]["result"]["id"] == "first"
    assert all(one["result"]["id"] == one["key"] for one in results[1:])
    assert [key for kind, key in filter(None, written) if kind == "results"] == [one["key"] for one in results]
    assert said["presence"] == {"state": "ONLINE", "at": "number"}
    assert said["notes"] == [
        {"text": "äöü", "number": 1.5, "whole": 3, "yes": True, "list": ["x", None]}, {"deep": {"er": {"no": False}}},
    ]  # fmt: skip
    assert said["missing"] is False
