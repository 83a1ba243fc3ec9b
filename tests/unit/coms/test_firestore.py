"""Firestore as a transport: a real server that cuts, goes away and ends tokens."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_un.coms.agent import LONGEST
from maya_un.coms.database import FirebaseUser, FixedToken
from maya_un.coms.firestore import Firestore
from maya_un.coms.selection import transport_of
from maya_un.coms.settings import AgentSettings
from maya_un.coms.transport import Report, ReportKind, SupervisorChannel, SupervisorTransport
from maya_un.errors import SupervisorsNotReached
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.unit.coms.test_rtdb import Answers, home, lost, result, run_story
from tests.waiting import until

ROBOT = "robots/MAYA"
SOON = 0.01


@pytest.fixture
def database(monkeypatch: pytest.MonkeyPatch) -> Iterator[RealtimeDatabase]:
    with realtime_database() as one:
        monkeypatch.setenv("FIRESTORE_EMULATOR_HOST", f"127.0.0.1:{one.port}")
        monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", f"127.0.0.1:{one.port}")
        one.store.users["maya@example.org"] = "right"
        one.set_document(ROBOT, {})
        yield one


def firestore(**more: Any) -> Firestore:
    """Return the transport, which asks often."""
    return Firestore("firestore://demo", FixedToken(""), **{"interval": SOON, **more})


def put(database: RealtimeDatabase, key: str, fields: dict[str, Any] | None) -> None:
    database.set_document(f"{ROBOT}/commands/{key}", fields)


def results_written(database: RealtimeDatabase) -> list[str]:
    """Return the key of every result that was ever written."""
    return [path.rpartition("/")[2] for path, _ in database.documents.written if f"{ROBOT}/results/" in path]


def answered(
    database: RealtimeDatabase, transport: SupervisorTransport, story: Callable[[Answers], Awaitable[None]], *keys: str
) -> Answers:
    """Run a story beside an agent that answers, until these commands are answered."""
    answers = Answers(transport)

    async def main() -> None:
        running = asyncio.create_task(answers.run())
        async with asyncio.timeout(60.0):
            await story(answers)
            await until(lambda: all(database.document(f"{ROBOT}/commands/{key}") is None for key in keys))
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    run(main())
    return answers


def test_open_commands_are_in_the_order_of_their_creation(database: RealtimeDatabase) -> None:
    for key in ("z", "a", "m"):
        put(database, key, home(key))

    async def story(channel: SupervisorChannel) -> None:
        assert [(await channel.receive()).key for _ in range(3)] == ["z", "a", "m"]
        put(database, "b", home("later"))
        command = await channel.receive()
        assert (command.key, json.loads(command.text), command.id) == ("b", home("later"), "b")

    run_story(story, firestore())


def test_a_result_and_the_end_of_its_command_are_one_commit(database: RealtimeDatabase) -> None:
    place = {"x": 1, "y": 0.5, "z": None, "more": [True, "\u00e4", {"deep": []}]}
    put(database, "k", {"command": "pick", "args": place, "deadline": "2999-01-01T00:00:00Z"})

    async def story(channel: SupervisorChannel) -> None:
        command = await channel.receive()
        assert json.loads(command.text)["args"] == place
        await channel.send(Report("k", ReportKind.EXECUTING, '{"id": "k", "state": "executing"}', "k"))
        assert database.document(f"{ROBOT}/progress/k") == {"id": "k", "state": "executing"}
        await channel.send(result(command, error=None, warnings=["args.more was ignored"]))
        last = [path for path, _ in database.documents.written[-3:]]
        assert last == [f"{ROBOT}/{name}/k" for name in ("commands", "progress", "results")]

    run_story(story, firestore())
    assert database.document(f"{ROBOT}/commands/k") is database.document(f"{ROBOT}/progress/k") is None
    assert database.document(f"{ROBOT}/results/k") == {
        "id": "k", "success": True, "error": None, "warnings": ["args.more was ignored"],
    }  # fmt: skip


def test_one_connection_serves_every_request(database: RealtimeDatabase) -> None:
    put(database, "k", home("7"))

    async def story(channel: SupervisorChannel) -> None:
        command = await channel.receive()
        for _ in range(5):
            await channel.send(Report("7", ReportKind.EXECUTING, '{"id": "7", "state": "executing"}', "k"))
        await channel.send(result(command))

    run_story(story, firestore())
    assert len(database.callers) == 1


def test_a_command_that_is_removed_gets_no_result(database: RealtimeDatabase) -> None:
    for key in "ab":
        put(database, key, home(key))

    async def story(channel: SupervisorChannel) -> None:
        first = await channel.receive()
        put(database, "a", None)
        await channel.send(result(first))
        assert (await channel.receive()).key == "b"

    run_story(story, firestore())
    assert results_written(database) == []


def test_command_under_way_stays_claimed_while_there_are_too_many_others(
    database: RealtimeDatabase, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("maya_un.coms.firestore.MOST_AT_ONCE", 3)
    put(database, "z", home("z"))

    async def story(channel: SupervisorChannel) -> None:
        first = await channel.receive()
        for key in "abc":  # Firestore returns the first documents in the order of their names
            put(database, key, home(key))
        assert (await channel.receive()).key == "a"
        claims = database.document(f"{ROBOT}/state/session")["claims"]
        assert claims.keys() == {"a", "b", "c", "z"}
        await channel.send(result(first))

    run_story(story, firestore())
    assert results_written(database) == ["z"]


def test_a_command_may_be_of_the_old_form(database: RealtimeDatabase) -> None:
    database.set_document(ROBOT, {"default_command": "approach"})
    put(database, "k", {"args": {"x": 1, "y": 2, "z": 3}})
    transport = firestore()

    async def story(channel: SupervisorChannel) -> None:
        assert (await channel.receive()).id == "k"
        assert transport.default_command == "approach"

    run_story(story, transport)


@pytest.mark.parametrize(
    ("key", "fields"),
    [
        ("huge", {"command": "x" * 1_500_000}),
        ("long", {"command": "home", "args": {"x": "x" * 100_000}}),
        ("nothing", {}),
        ("wrong", {"id": [1], "command": 7, "args": [[]]}),
        ("%2F ?#\u00e4", {"command": "home"}),
    ],
)
def test_odd_documents_are_delivered_with_the_others(
    key: str, fields: dict[str, Any], database: RealtimeDatabase
) -> None:
    put(database, key, fields)
    put(database, "good", home("good"))

    async def story(channel: SupervisorChannel) -> None:
        odd = await channel.receive()
        assert odd.key == key
        assert len(odd.text) > LONGEST if key in {"huge", "long"} else json.loads(odd.text) == fields
        await channel.send(result(odd))
        good = await channel.receive()
        assert good.key == "good"
        await channel.send(result(good))

    run_story(story, firestore())
    assert sorted(results_written(database)) == sorted([key, "good"])


@pytest.mark.parametrize("answered_", [False, True])
@pytest.mark.parametrize(
    ("method", "text"),
    [("GET", ROBOT), ("GET", "/commands/a"), ("POST", "runQuery"), ("POST", "presence"), ("POST", "/results/")],
)
def test_a_cut_in_any_phase_loses_nothing_and_reports_nothing_twice(
    method: str, text: str, answered_: bool, database: RealtimeDatabase
) -> None:
    put(database, "a", home("a"))
    database.faults.append(Fault(method, text, answered_, times=2))

    async def story(answers: Answers) -> None:
        await until(lambda: bool(answers.errors))
        put(database, "b", home("b"))

    answered(database, firestore(), story, "a", "b")
    assert database.faults == []
    assert sorted(results_written(database)) == ["a", "b"]


def test_commands_that_came_while_firestore_was_away_are_answered_once(database: RealtimeDatabase) -> None:
    async def story(answers: Answers) -> None:
        put(database, "a", home("a"))
        await until(lambda: database.document(f"{ROBOT}/results/a") is not None)
        database.go_away()
        for key in "bcd":
            put(database, key, home(key))
        await until(lambda: len(answers.errors) >= 3)
        database.come_back()

    answered(database, firestore(), story, *"abcd")
    assert sorted(results_written(database)) == list("abcd")


def test_presence_beats_and_ends_with_the_connection(database: RealtimeDatabase) -> None:
    def beats() -> set[str]:
        return {data["at"] for path, data in database.documents.written if path.endswith("/state/presence")}

    async def story(_: SupervisorChannel) -> None:
        await until(lambda: len(beats()) >= 3)
        assert database.document(f"{ROBOT}/state/presence")["state"] == "ONLINE"

    run_story(story, firestore(heartbeat=0.02))
    assert database.document(f"{ROBOT}/state/presence")["state"] == "OFFLINE"


def test_a_heartbeat_that_fails_ends_the_connection(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        database.faults.append(Fault("POST", "presence"))
        assert await lost(channel)

    run_story(story, firestore(heartbeat=0.02))


def test_a_token_that_ends_is_refreshed(database: RealtimeDatabase) -> None:
    user = FirebaseUser("maya@example.org", "right", "key of the project")

    async def story(channel: SupervisorChannel) -> None:
        put(database, "a", home("a"))
        command = await channel.receive()
        database.store.revoked.update(database.documents.tokens)
        await channel.send(result(command))

    run_story(story, Firestore("firestore://demo", user, interval=SOON))
    assert database.document(f"{ROBOT}/results/a")["success"]
    assert len(database.documents.tokens) == 2


def test_firestore_names_the_database_and_the_default_command(database: RealtimeDatabase) -> None:
    database.set_document(ROBOT, {"database_url": database.url, "default_command": "approach"})
    settings = AgentSettings(supervisors="firestore://demo", user="maya@example.org", password="right", api_key="key")
    transport = transport_of(settings)
    assert transport.where == "firestore://demo"

    async def story(channel: SupervisorChannel) -> None:
        database.set(f"{ROBOT}/commands/a", home("a"))
        await channel.send(result(await channel.receive()))

    run_story(story, transport)
    assert transport.default_command == "approach"
    assert database.get(f"{ROBOT}/results/a/success") is True


async def _nothing(_: SupervisorChannel) -> None:
    pass


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        (None, "there is no document robots/MAYA"),
        ({"database_url": "ftp://x"}, "not like"),
        ({"database_url": 3}, "not like"),
        ({"database_url": "https://[demo.firebaseio.com"}, "not like"),
    ],
)
def test_a_robot_without_a_valid_document_is_named(document: Any, reason: str, database: RealtimeDatabase) -> None:
    database.set_document(ROBOT, document)
    with pytest.raises(SupervisorsNotReached, match=reason):
        run_story(_nothing, firestore())


def test_a_token_that_firestore_refuses_is_shown_nowhere(database: RealtimeDatabase) -> None:
    assert database.port
    with pytest.raises(SupervisorsNotReached, match="401: Could not parse") as found:
        run_story(_nothing, transport_of(AgentSettings(supervisors="firestore://demo", password="secret-1")))
    assert "secret-1" not in f"{found.value} {found.value!r}"
