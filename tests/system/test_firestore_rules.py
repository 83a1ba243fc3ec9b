"""Google's emulator judges the security rules of the documentation, and what `maya coms` does under them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_un.coms.database import FixedToken
from maya_un.coms.firestore import Firestore
from maya_un.coms.transport import Report, ReportKind, SupervisorChannel
from tests.system.firestore_emulator import HTTP, RULES, emulator, needs_emulator
from tests.system.rtdb.store import Store

pytestmark = [pytest.mark.system, pytest.mark.timeout(180), needs_emulator]

DOCUMENTS = "projects/demo/databases/(default)/documents"
ROBOT = "robots/MAYA"
OWNER = "owner"
"""The token of somebody above all rules, at an emulator."""

TOKENS = {"nobody": "", "owner": OWNER} | {name: Store().sign_in(name) for name in ("maya", "other", "lab", "stranger")}
"""`maya` and `other` are robots; `lab` is a supervisor of MAYA; `stranger` has no account."""

EVERYBODY = ("maya", "lab", "other", "stranger", "nobody")


class Emulator:
    """Requests to an emulator; `who` is a name in `TOKENS`."""

    def __init__(self, port: int) -> None:
        self._url = f"http://127.0.0.1:{port}/v1/{DOCUMENTS}"

    def commit(self, who: str, *writes: dict[str, Any]) -> int:
        """Write all or nothing, and return the status."""
        return self._asked("POST", ":commit", who, {"writes": writes})

    def may_read(self, who: str, path: str) -> bool:
        """Return whether somebody may read a document."""
        return self._asked("GET", f"/{path}", who) in {200, 404}

    def may_list(self, who: str, collection: str) -> bool:
        """Return whether somebody may read the keys of the robot's collection."""
        query = {"from": [{"collectionId": collection}], "select": {"fields": [{"fieldPath": "__name__"}]}}
        return self._asked("POST", f"/{ROBOT}:runQuery", who, {"structuredQuery": query}) == 200

    def _asked(self, method: str, path: str, who: str, body: object = None) -> int:
        headers = {"Authorization": f"Bearer {TOKENS[who]}"} if TOKENS[who] else {}
        status = HTTP.request(method, self._url + path, headers=headers, json=body, timeout=30.0).status_code
        assert status in {200, 403, 404}, status
        return status


def put(path: str, **fields: str) -> dict[str, Any]:
    """Return the write of a document with texts."""
    values = {name: {"stringValue": value} for name, value in fields.items()}
    return {"update": {"name": f"{DOCUMENTS}/{path}", "fields": values}}


def remove(path: str) -> dict[str, Any]:
    """Return the removal of a document."""
    return {"delete": f"{DOCUMENTS}/{path}"}


def result(key: str) -> list[dict[str, Any]]:
    """Return what a robot writes when a step ends."""
    return [
        remove(f"{ROBOT}/commands/{key}") | {"currentDocument": {"exists": True}},
        remove(f"{ROBOT}/progress/{key}"),
        put(f"{ROBOT}/results/{key}", id=key),
    ]


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    with emulator(RULES) as found:
        yield found


@pytest.fixture
def google(port: int) -> Emulator:
    """Return the emulator with two robots, a supervisor, and a command, progress and a result of MAYA."""
    one = Emulator(port)
    lab = put("accounts/lab")
    lab["update"]["fields"] = {"commands": {"arrayValue": {"values": [{"stringValue": "MAYA"}]}}}
    accounts = [put("accounts/maya", robot="MAYA"), put("accounts/other", robot="OTHER"), lab]
    below = [put(f"{ROBOT}/{kind}/old", id="old") for kind in ("commands", "progress", "results")]
    assert one.commit("owner", *accounts, put(ROBOT), put("robots/OTHER"), *below) == 200
    assert one.commit("owner", remove(f"{ROBOT}/commands/new"), remove(f"{ROBOT}/results/new")) == 200
    return one


@pytest.mark.parametrize(
    "path",
    [ROBOT, *(f"{ROBOT}/{place}" for place in ("commands/old", "progress/old", "results/old", "state/presence"))],
)
def test_only_a_robot_and_its_supervisors_read(path: str, google: Emulator) -> None:
    assert [who for who in EVERYBODY if google.may_read(who, path)] == ["maya", "lab"]


@pytest.mark.parametrize("collection", ["commands", "results"])
def test_only_a_robot_and_its_supervisors_list(collection: str, google: Emulator) -> None:
    assert [who for who in EVERYBODY if google.may_list(who, collection)] == ["maya", "lab"]


def test_every_user_reads_only_his_own_account(google: Emulator) -> None:
    for path in ("accounts/maya", "accounts/lab"):
        assert [who for who in EVERYBODY if google.may_read(who, path)] == [path.rpartition("/")[2]]


@pytest.mark.parametrize(
    ("write", "allowed"),
    [
        (put(f"{ROBOT}/commands/new", command="home"), ["lab"]),
        (put(f"{ROBOT}/commands/old", command="pick"), []),
        (remove(f"{ROBOT}/commands/old"), ["maya"]),
        (put("robots/OTHER/commands/new", command="home"), []),
        (put(f"{ROBOT}/progress/old", id="old"), ["maya"]),
        (put(f"{ROBOT}/results/old", id="old"), ["maya"]),
        (put(f"{ROBOT}/results/new", id="new"), []),
        (remove(f"{ROBOT}/results/old"), ["lab"]),
        (put(f"{ROBOT}/state/presence", state="ONLINE"), ["maya"]),
        (put(f"{ROBOT}/state/session", session="1"), ["maya"]),
        (put(f"{ROBOT}/state/session/deeper/one", session="1"), []),
        (put(ROBOT, default_command="home"), []),
        (put("accounts/stranger", robot="MAYA"), []),
        (put("accounts/maya", robot="OTHER"), []),
        (put(f"{ROBOT}/commands/old/deeper/one", command="home"), []),
        (put("elsewhere/one", x="1"), []),
    ],
)
def test_each_write_is_allowed_only_to_those_who_need_it(
    write: dict[str, Any], allowed: list[str], google: Emulator
) -> None:
    found = [who for who in ("maya", "other", "stranger", "nobody", "lab") if google.commit(who, write) == 200]
    assert found == allowed


def test_a_robot_writes_a_result_only_with_the_end_of_its_command(google: Emulator) -> None:
    assert google.commit("lab", *result("old")) == 403
    assert google.commit("maya", *result("old")) == 200
    assert google.commit("maya", *result("old")) == 403, "a result that is there is not written again"


def test_a_command_that_is_removed_costs_no_connection(
    port: int, google: Emulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRESTORE_EMULATOR_HOST", f"127.0.0.1:{port}")

    async def story(channel: SupervisorChannel) -> None:
        first = await channel.receive()
        assert google.commit("owner", remove(f"{ROBOT}/commands/{first.key}")) == 200
        await channel.send(Report(first.key, ReportKind.RESULT, '{"id": "old"}', first.key))
        assert google.commit("lab", put(f"{ROBOT}/commands/new", command="home")) == 200
        second = await channel.receive()
        await channel.send(Report(second.key, ReportKind.RESULT, '{"id": "new"}', second.key))

    async def main() -> None:
        transport = Firestore("firestore://demo", FixedToken(TOKENS["maya"]), interval=0.01)
        async with asyncio.timeout(60.0), transport.connected("MAYA", "journal") as channel:
            await story(channel)

    run(main())
    assert google.commit("owner", put(f"{ROBOT}/results/new", id="new") | {"currentDocument": {"exists": True}}) == 200
