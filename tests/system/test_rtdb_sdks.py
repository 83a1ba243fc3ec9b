"""Firebase's own libraries judge the Realtime Database of the tests: JavaScript, its admin form, and Python."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.system.rtdb.server import RealtimeDatabase, realtime_database
from tests.system.test_rosbridge_clients import SCRIPTS, node

pytestmark = [pytest.mark.system, pytest.mark.timeout(180)]

ROOT = Path(__file__).parents[2]
PYTHON = (ROOT / ".venv-clients/bin/python", ROOT / "tests/system/foreign/firebase_admin_client.py")

PARTS = {"a": {"at": 3}, "b": {"at": 1}, "c": {"at": 2}, "d": {"at": "x"}}

SAME = {
    "set and get": {"text": "äöü", "number": 1.5, "yes": True, "list": ["x", "y"]},
    "update": [{"text": "äöü", "number": 2, "list": ["x", "y"]}, {"deep": "new"}],
    "remove": None,
    "queries": {
        "last": {key: PARTS[key] for key in "ad"},
        "first": {key: PARTS[key] for key in "ab"},
        "equal": {"c": PARTS["c"]},
        "between": {key: PARTS[key] for key in "bc"},
        "key": {key: PARTS[key] for key in "cd"},
    },
    "transaction": 1,
    "contended": 20,
    "timestamp": True,
    "increment": 7.5,
}
"""Data that every library reads back."""

RULES = """{"rules": {"users": {"$uid": {
    ".read": "auth.uid === $uid", ".write": "auth.uid === $uid", "x": {".validate": "newData.isNumber()"}
}}}}"""


def output_of(database: RealtimeDatabase, *command: object) -> dict[str, Any]:
    """Return a program's output, once it has gone through everything it has."""
    where = {"FIREBASE_DATABASE_EMULATOR_HOST": f"127.0.0.1:{database.port}"}
    words = [str(word) for word in command]
    done = subprocess.run(
        words, cwd=SCRIPTS, env=os.environ | where, capture_output=True, text=True, timeout=120.0, check=False
    )
    said: dict[str, Any] = {}
    for line in done.stdout.splitlines():
        said |= json.loads(line)
    assert said.get("done") is True, done.stdout + done.stderr
    return said


@pytest.mark.parametrize("library", ["client", "admin"])
def test_the_javascript_libraries_find_a_database(library: str) -> None:
    with realtime_database() as database:
        said = output_of(database, node(), SCRIPTS / "rtdb.mjs", library, database.port)
        assert database.longest_message > 500_000
    assert {name: said[name] for name in SAME} == SAME
    assert said["push"] == [[1, 2, 3], [2], True]
    assert said["off"] == 3
    assert said["on value"] == "seen"
    assert said["transaction on an object"] == {"at": 3, "more": [1.25, "é", False]}
    assert (said["long frames"], said["long event"]) == (True, 100_001)
    assert (said["on disconnect"], said["merged on disconnect"], said["cancelled on disconnect"]) == (
        "OFFLINE", {"deep": True}, None,
    )  # fmt: skip
    assert said["listen again"] == "told again"


def test_the_python_library_finds_a_database() -> None:
    if not PYTHON[0].exists():
        pytest.fail("there is no .venv-clients: `./test` sets it up")
    with realtime_database(keep_alive=0.5) as database:  # the library waits for an event before it stops to listen
        said = output_of(database, *PYTHON, database.port)
    assert {name: said[name] for name in SAME} == SAME
    assert said["push"] == [[1, 2, 3], True]
    assert said["shallow"] == dict.fromkeys("abcd", True)
    assert (said["not changed"], said["changed"], said["stale"], said["fresh"]) == (False, [True, 3], False, True)
    assert said["long"] is True
    assert said["listen"] == [
        ["put", "/", None],
        ["put", "/a", 1],
        ["patch", "/", {"b": 2, "c/d": 3}],
        ["put", "/a", None],
    ]
    assert said["refused"] == "InvalidArgumentError"


def test_the_javascript_library_signs_in_and_obeys_rules() -> None:
    with realtime_database(RULES) as database:
        database.store.users["lab@example.org"] = "right"
        words = [node(), SCRIPTS / "rtdb_users.mjs", database.port, "lab@example.org", "right", "lab"]
        program = subprocess.Popen(
            [str(word) for word in words],
            cwd=SCRIPTS, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        try:
            said = _talked(program, database)
        finally:
            program.kill()
            program.communicate()
    assert said == {
        "nobody writes": "PERMISSION_DENIED",
        "nobody reads": "Permission denied",
        "wrong password": "auth/invalid-credential",
        "signs in": "lab",
        "writes": "ok",
        "elsewhere": "PERMISSION_DENIED",
        "invalid": "PERMISSION_DENIED",
        "after the token": 2,
        "cancelled": "PERMISSION_DENIED",
        "signed out": "PERMISSION_DENIED",
        "done": True,
    }


def _talked(program: subprocess.Popen[str], database: RealtimeDatabase) -> dict[str, Any]:
    """Return the program's output; end its token and change the rules when it is ready for that."""
    assert program.stdin is not None
    assert program.stdout is not None
    said: dict[str, Any] = {}
    for line in program.stdout:
        if not line.startswith("{"):
            continue  # a warning of the library about what is refused
        found = json.loads(line)
        if found.get("ready") == "listens":
            database.revoke_all()
            database.set("users/lab/x", 2)
        elif found.get("ready") == "renewed":
            database.set_rules('{"rules": {".read": false}}')
        else:
            said |= found
        if "ready" in found:
            program.stdin.write("\n")
            program.stdin.flush()
        if "done" in found:
            break
    return said
