"""The Realtime Database as a transport: a real server that cuts, delays, goes away, redirects and ends tokens."""

from __future__ import annotations

import asyncio
import json
import logging
import os
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import certifi
import httpx
import pytest

from dmc41x3.loops import run
from maya_un.coms.agent import LONGEST
from maya_un.coms.database import FirebaseUser, FixedToken, NoToken, tls_context
from maya_un.coms.rtdb import Rtdb
from maya_un.coms.selection import transport_of
from maya_un.coms.settings import AgentSettings
from maya_un.coms.transport import Report, ReportKind, SupervisorChannel, SupervisorCommand, SupervisorTransport, keep
from maya_un.errors import InvalidValue, SupervisorsNotReached
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.waiting import until

RULES = (Path(__file__).parents[3] / "contrib/firebase/database.rules.json").read_text()

ROBOT = "robots/MAYA"
JOURNAL = "journal of the robot"

Story = Callable[[SupervisorChannel], Awaitable[None]]


@pytest.fixture
def database() -> Iterator[RealtimeDatabase]:
    with realtime_database() as one:
        yield one


@pytest.fixture
def guarded() -> Iterator[RealtimeDatabase]:
    """Yield a database with the rules of the documentation: a robot, and a supervisor of it."""
    with realtime_database(RULES) as one:
        one.store.users.update({"maya@example.org": "right", "lab@example.org": "right too"})
        one.set("accounts", {"maya": {"robot": "MAYA"}, "lab": {"commands": {"MAYA": True}}})
        yield one


def run_story(story: Story, transport: SupervisorTransport, robot: str = "MAYA") -> None:
    """Run a story with a connection."""

    async def main() -> None:
        async with asyncio.timeout(60.0), transport.connected(robot, JOURNAL) as channel:
            await story(channel)

    run(main())


def put(database: RealtimeDatabase, key: str, value: Any) -> None:
    database.set(f"{ROBOT}/commands/{key}", value)


def home(id_: str) -> dict[str, str]:
    return {"id": id_, "command": "home"}


def result(command: SupervisorCommand, **more: Any) -> Report:
    text = json.dumps({"id": command.id, "success": True, "error": None, "warnings": [], **more})
    return Report(command.id, ReportKind.RESULT, text, command.key)


async def lost(channel: SupervisorChannel) -> str:
    """Return why a connection ended; commands before that are passed over."""
    try:
        while True:
            await channel.receive()
    except SupervisorsNotReached as error:
        return str(error)


class Answers:
    """Answers every command as an agent does, over connections that are made again; `seen` lists the deliveries."""

    def __init__(self, transport: SupervisorTransport) -> None:
        self.seen: list[str] = []
        self.errors: list[str] = []
        self._transport = transport

    async def run(self) -> None:
        async def use() -> None:
            async with self._transport.connected("MAYA", JOURNAL) as channel:
                while True:
                    command = await channel.receive()
                    self.seen.append(command.key)
                    progress = Report(command.id, ReportKind.ACCEPTED, '{"state": "accepted"}', command.key)
                    await channel.send(progress)
                    await channel.send(result(command))

        await keep(use, lambda error: self.errors.append(str(error)), _Short())


class _Short(Random):
    """Draws no pause between attempts."""

    def uniform(self, a: float, b: float) -> float:
        del a, b
        return 0.01


def answered(database: RealtimeDatabase, transport: Rtdb, story: Callable[[Answers], Awaitable[None]]) -> Answers:
    """Run a story beside an agent that answers, until no command is open."""
    answers = Answers(transport)

    async def main() -> None:
        running = asyncio.create_task(answers.run())
        async with asyncio.timeout(60.0):
            await story(answers)
            await until(lambda: database.get(f"{ROBOT}/commands") is None)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    run(main())
    return answers


def results_written(database: RealtimeDatabase) -> list[str]:
    """Return the key of every result that was ever written."""
    return [path[3] for path, _ in database.store.writes if path[:3] == ("robots", "MAYA", "results")]


@pytest.mark.parametrize("backwards", [False, True])
def test_open_commands_are_in_the_order_of_their_keys(backwards: bool, database: RealtimeDatabase) -> None:
    database.rest.backwards = backwards
    keys = ["-Oz", "10", "9", "-Oa", "b", "B"]
    for key in keys:
        put(database, key, home(key))

    async def story(channel: SupervisorChannel) -> None:
        assert [(await channel.receive()).key for _ in keys] == ["9", "10", "-Oa", "-Oz", "B", "b"]
        put(database, "a", home("later"))
        command = await channel.receive()
        assert (command.key, json.loads(command.text), command.id) == ("a", home("later"), "a")

    run_story(story, Rtdb(database.url))


def test_commands_in_an_array_of_the_database_are_delivered(database: RealtimeDatabase) -> None:
    for key in "0123":
        put(database, key, home(key))

    async def story(channel: SupervisorChannel) -> None:
        assert [(await channel.receive()).key for _ in range(4)] == ["0", "1", "2", "3"]

    run_story(story, Rtdb(database.url))


def test_one_connection_serves_every_write_next_to_the_stream(database: RealtimeDatabase) -> None:
    put(database, "k", home("7"))

    async def story(channel: SupervisorChannel) -> None:
        command = await channel.receive()
        for _ in range(5):
            await channel.send(Report("7", ReportKind.EXECUTING, '{"id": "7", "state": "executing"}', "k"))
        await channel.send(result(command))

    run_story(story, Rtdb(database.url))
    assert len(database.callers) == 2


def test_a_result_and_the_end_of_its_command_are_one_write(database: RealtimeDatabase) -> None:
    put(database, "k", home("7"))

    async def story(channel: SupervisorChannel) -> None:
        command = await channel.receive()
        await channel.send(Report("7", ReportKind.EXECUTING, '{"id": "7", "state": "executing"}', "k"))
        assert database.get(f"{ROBOT}/progress") == {"k": {"id": "7", "state": "executing"}}
        database.store.writes.clear()
        await channel.send(result(command))
        written = ["/".join(path[2:]) for path, _ in database.store.writes]
        assert written == ["results/k", "progress/k", "commands/k"]

    run_story(story, Rtdb(database.url))
    assert database.get(ROBOT).keys() == {"presence", "results", "session"}
    assert database.get(f"{ROBOT}/results/k/success") is True


def test_a_command_of_the_old_form_has_its_key_as_id_and_the_default_command(database: RealtimeDatabase) -> None:
    database.set(f"{ROBOT}/document", {"default_command": "approach"})
    put(database, "-Ok", {"args": {"x": 1, "y": 2, "z": 3}})
    transport = Rtdb(database.url)

    async def story(channel: SupervisorChannel) -> None:
        assert (await channel.receive()).id == "-Ok"
        assert transport.default_command == "approach"

    run_story(story, transport)


def test_a_command_may_be_json_text(database: RealtimeDatabase) -> None:
    put(database, "k", '{"id": "7", "command": "home"}')

    async def story(channel: SupervisorChannel) -> None:
        assert json.loads((await channel.receive()).text) == home("7")
        await channel.send(
            Report("7", ReportKind.RESULT, '{"id": "7"}', None)
        )  # from an earlier connection: found by its id
        assert database.get(f"{ROBOT}/results") == {"k": {"id": "7"}}

    run_story(story, Rtdb(database.url))


def test_a_key_that_can_be_no_id_is_given_none(database: RealtimeDatabase) -> None:
    put(database, "k" * 300, {"command": "home"})

    async def story(channel: SupervisorChannel) -> None:
        assert (await channel.receive()).id is None

    run_story(story, Rtdb(database.url))


def test_a_command_that_is_written_in_parts_is_read_whole(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        database.set(f"{ROBOT}/commands/k/command", "approach")
        database.set(f"{ROBOT}/commands/k/args/x", 1)
        command = await channel.receive()
        assert json.loads(command.text)["command"] == "approach"

    run_story(story, Rtdb(database.url))


def test_command_removed_before_its_turn_is_not_delivered(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        for key in "ab":
            put(database, key, home(key))
        put(database, "a", None)
        put(database, "c", home("c"))
        keys = [(await channel.receive()).key]
        while keys[-1] != "c":
            keys.append((await channel.receive()).key)
        assert keys in (["b", "c"], ["a", "b", "c"])  # it may have come before it was removed
        await channel.send(Report("a", ReportKind.RESULT, '{"id": "a"}', "a"))
        assert database.get(f"{ROBOT}/results") is None

    run_story(story, Rtdb(database.url))


def test_commands_that_one_update_removes_are_closed(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        for key in "ab":
            put(database, key, home(key))
        await channel.receive()
        async with httpx.AsyncClient() as lab:
            answer = await lab.patch(f"{database.url}/{ROBOT}/commands.json", json={"a": None, "b": None})
        answer.raise_for_status()
        put(database, "c", home("c"))
        while (await channel.receive()).key != "c":  # "b" may have come before it was removed
            pass
        put(database, "a", home("another"))
        again = await channel.receive()
        assert (again.key, json.loads(again.text)) == ("a", home("another"))

    run_story(story, Rtdb(database.url))


def test_commands_that_are_removed_together_get_no_result(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        put(database, "a", home("a"))
        command = await channel.receive()
        database.set(f"{ROBOT}/commands", None)
        put(database, "c", home("c"))
        assert (await channel.receive()).key == "c"
        await channel.send(result(command))
        assert database.get(f"{ROBOT}/results") is None

    run_story(story, Rtdb(database.url))


@pytest.mark.parametrize("when", ["before", "while connected"])
def test_huge_command_is_delivered_cut_with_the_others(when: str, database: RealtimeDatabase) -> None:
    huge = {"id": "huge", "command": "x" * 10_000_000}
    if when == "before":
        put(database, "a", home("a"))
        put(database, "huge", huge)

    async def story(channel: SupervisorChannel) -> None:
        if when != "before":
            put(database, "a", home("a"))
            put(database, "huge", huge)
        put(database, "z", home("z"))
        found = {}
        while len(found) < 3:
            command = await channel.receive()
            found[command.key] = len(command.text)
            await channel.send(result(command))
        assert found["huge"] == LONGEST + 1
        assert database.get(f"{ROBOT}/commands") is None
        put(database, "after", home("after"))
        assert (await channel.receive()).key == "after"

    run_story(story, Rtdb(database.url))


@pytest.mark.parametrize(
    ("method", "text", "answered_"),
    [
        ("GET", "/commands", False),
        ("GET", "/commands", True),
        ("GET", "/document", True),
        ("PUT", "/presence", False),
        ("PUT", "/presence", True),
        ("PUT", "/progress", False),
        ("PUT", "/progress", True),
        ("PATCH", "results/", False),
        ("PATCH", "results/", True),
    ],
)
def test_a_cut_in_any_phase_loses_nothing_and_reports_nothing_twice(
    method: str, text: str, answered_: bool, database: RealtimeDatabase
) -> None:
    put(database, "a", home("a"))
    database.faults.append(Fault(method, text, answered_, times=2))

    async def story(answers: Answers) -> None:
        await until(lambda: bool(answers.errors))
        put(database, "b", home("b"))

    answers = answered(database, Rtdb(database.url), story)
    assert answers.errors
    assert database.faults == []
    assert sorted(results_written(database)) == ["a", "b"]


def test_commands_that_came_while_the_server_was_away_are_answered_once(database: RealtimeDatabase) -> None:
    async def story(answers: Answers) -> None:
        put(database, "a", home("a"))
        await until(lambda: database.get(f"{ROBOT}/results/a") is not None)
        database.go_away()
        for key in "bcd":
            put(database, key, home(key))
        await until(lambda: len(answers.errors) >= 3)
        database.come_back()

    answers = answered(database, Rtdb(database.url), story)
    assert answers.seen == ["a", "b", "c", "d"]
    assert results_written(database) == ["a", "b", "c", "d"]


def test_cuts_at_any_instant_lose_nothing_and_report_nothing_twice(database: RealtimeDatabase) -> None:
    keys = [f"{number:03}" for number in range(60)]

    async def story(answers: Answers) -> None:
        for number, key in enumerate(keys):
            put(database, key, home(key))
            if number % 5 == 4:
                await until(lambda least=number // 2: len(answers.seen) >= least)
                database.cut()
        await until(lambda: database.get(f"{ROBOT}/commands") is None)

    answered(database, Rtdb(database.url), story)
    assert sorted(results_written(database)) == keys


def test_a_stream_that_falls_silent_ends(database: RealtimeDatabase) -> None:
    database.rest.keep_alive = 0.05

    async def story(channel: SupervisorChannel) -> None:
        put(database, "a", home("a"))
        await channel.receive()
        database.rest.mute = True
        assert "does not answer in time" in await lost(channel)

    run_story(story, Rtdb(database.url, silence=0.5))


@pytest.mark.waits("1.5 s: three times the silence after which a real socket counts as dead")
def test_keep_alives_keep_a_stream(database: RealtimeDatabase) -> None:
    database.rest.keep_alive = 0.05

    async def story(channel: SupervisorChannel) -> None:
        receiving = asyncio.ensure_future(channel.receive())
        done, _ = await asyncio.wait([receiving], timeout=1.5)
        assert not done
        put(database, "a", home("a"))
        assert (await receiving).key == "a"

    run_story(story, Rtdb(database.url, silence=0.5))


def test_presence_beats_and_ends_with_the_connection(database: RealtimeDatabase) -> None:
    def beats() -> list[int]:
        found = [value for path, value in database.store.writes if path[-1] == "presence"]
        assert {one["state"] for one in found} <= {"ONLINE"}
        return [one["at"] for one in found]

    async def story(_: SupervisorChannel) -> None:
        await until(lambda: len(set(beats())) >= 3)

    run_story(story, Rtdb(database.url, heartbeat=0.02))
    assert database.get(f"{ROBOT}/presence/state") == "OFFLINE"


def test_a_connection_that_ends_as_it_begins_leaves_nothing_behind(database: RealtimeDatabase) -> None:
    async def story(_: SupervisorChannel) -> None:
        raise LookupError

    with pytest.raises(LookupError):
        run_story(story, Rtdb(database.url))


def test_it_is_offline_after_it_was_cancelled(database: RealtimeDatabase) -> None:
    async def main() -> None:
        running = asyncio.create_task(Answers(Rtdb(database.url)).run())
        await until(lambda: database.get(f"{ROBOT}/presence/state") == "ONLINE")
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    run(main())
    assert database.get(f"{ROBOT}/presence/state") == "OFFLINE"


def test_a_heartbeat_that_fails_ends_the_connection(database: RealtimeDatabase) -> None:
    async def story(channel: SupervisorChannel) -> None:
        database.faults.append(Fault("PUT", "/presence"))
        assert await lost(channel)

    run_story(story, Rtdb(database.url, heartbeat=0.02))


def test_redirects_are_followed_with_the_token(guarded: RealtimeDatabase) -> None:
    with realtime_database() as front:
        front.redirects_to = guarded.url
        guarded.set(f"{ROBOT}/commands/a", home("a"))

        async def story(channel: SupervisorChannel) -> None:
            await channel.send(result(await channel.receive()))

        run_story(story, Rtdb(front.url, FixedToken(guarded.store.secret)))
        assert front.get("/") is None
    assert guarded.get(f"{ROBOT}/results/a/success") is True


def test_a_ring_of_redirects_ends(database: RealtimeDatabase) -> None:
    database.redirects_to = database.url
    with pytest.raises(SupervisorsNotReached, match="redirects more than 5 times"):
        run_story(_nothing, Rtdb(database.url))


async def _nothing(_: SupervisorChannel) -> None:
    pass


@pytest.fixture
def signed_in(guarded: RealtimeDatabase, monkeypatch: pytest.MonkeyPatch) -> Rtdb:
    """Return a transport that shows the robot's user to the guarded database."""
    monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", f"127.0.0.1:{guarded.port}")
    return Rtdb(guarded.url, FirebaseUser("maya@example.org", "right", "key of the project"))


def test_a_user_signs_in_and_answers_within_the_rules(guarded: RealtimeDatabase, signed_in: Rtdb) -> None:
    async def story(channel: SupervisorChannel) -> None:
        put(guarded, "a", home("a"))
        command = await channel.receive()
        await channel.send(Report("a", ReportKind.ACCEPTED, '{"id": "a", "state": "accepted"}', "a"))
        await channel.send(result(command))

    run_story(story, signed_in)
    assert guarded.get(f"{ROBOT}/results/a/success") is True
    assert guarded.get(f"{ROBOT}/presence/state") == "OFFLINE"


def test_a_token_that_ends_is_refreshed_and_nothing_is_lost(guarded: RealtimeDatabase, signed_in: Rtdb) -> None:
    async def story(answers: Answers) -> None:
        for key in "abcdef":
            put(guarded, key, home(key))
            await until(lambda key=key: key in answers.seen)
            guarded.revoke_all()

    answers = answered(guarded, signed_in, story)
    assert any("no longer valid" in error for error in answers.errors)
    assert sorted(results_written(guarded)) == list("abcdef")


def test_a_token_that_ended_unnoticed_is_refreshed_at_the_next_request(
    guarded: RealtimeDatabase, signed_in: Rtdb
) -> None:
    async def story(channel: SupervisorChannel) -> None:
        put(guarded, "a", home("a"))
        command = await channel.receive()
        guarded.store.revoked.update(one.caller.token for one in guarded.store.listeners)
        await channel.send(result(command))

    run_story(story, signed_in)
    assert guarded.get(f"{ROBOT}/results/a/success") is True


def test_a_token_is_refreshed_before_it_ends_and_a_refused_refresh_signs_in(
    guarded: RealtimeDatabase, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", f"127.0.0.1:{guarded.port}")
    user = FirebaseUser("maya@example.org", "right", "key of the project")

    async def main() -> None:
        async with httpx.AsyncClient() as http:
            first = await user.token(http)
            assert await user.token(http) == first
            guarded.rest.token_lasts = 30
            user.refused()
            second = await user.token(http)
            third = await user.token(http)  # less than a minute is left of the second
            assert len({first, second, third}) == 3
            assert guarded.rest.sign_ins == 1
            guarded.faults.append(Fault("POST", "/token"))
            with pytest.raises(httpx.TransportError):
                await user.token(http)
            guarded.store.users.pop("maya@example.org")
            with pytest.raises(NoToken, match="INVALID_LOGIN_CREDENTIALS"):
                await user.token(http)
            guarded.store.users["maya@example.org"] = "right"
            assert await user.token(http) not in {first, second, third}
            assert guarded.rest.sign_ins == 2

    run(main())


def test_html_page_instead_of_a_token_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    async def serve_page(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"}")  # all of the request: its body is an object
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 6\r\n\r\n<html>")
        await writer.drain()
        writer.close()

    async def main() -> None:
        async with await asyncio.start_server(serve_page, "127.0.0.1", 0) as portal:
            monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", "127.0.0.1:{1}".format(*portal.sockets[0].getsockname()))
            async with httpx.AsyncClient() as http:
                with pytest.raises(NoToken, match="did not return a token"):
                    await FirebaseUser("maya@example.org", "right", "key of the project").token(http)

    run(main())


def test_rules_that_end_the_right_to_read_end_the_connection(guarded: RealtimeDatabase, signed_in: Rtdb) -> None:
    async def story(channel: SupervisorChannel) -> None:
        guarded.set_rules('{"rules": {".read": false}}')
        assert "rules no longer let" in await lost(channel)

    run_story(story, signed_in)


@pytest.mark.parametrize("shown", ["nothing", "a bad token", "a wrong password", "another robot"])
def test_refused_credentials_are_named_and_shown_nowhere(
    shown: str, guarded: RealtimeDatabase, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", f"127.0.0.1:{guarded.port}")
    caplog.set_level(logging.DEBUG)
    source = {
        "nothing": FixedToken(""),
        "a bad token": FixedToken("secret-token-1"),
        "a wrong password": FirebaseUser("maya@example.org", "secret-password-2", "secret-key-3"),
        "another robot": FirebaseUser("maya@example.org", "right", "secret-key-3"),
    }[shown]
    with pytest.raises(SupervisorsNotReached) as found:
        run_story(_nothing, Rtdb(guarded.url, source), "OTHER" if shown == "another robot" else "MAYA")
    expected = {"a bad token": "401: Could not parse auth token", "a wrong password": "INVALID_LOGIN_CREDENTIALS"}
    assert expected.get(shown, "401: Permission denied") in str(found.value)
    chain = f"{found.value!r} {found.value.__context__!r} {found.value.__cause__!r}"
    ours = [record.getMessage() for record in caplog.records if not record.name.startswith("uvicorn")]
    assert "secret-" not in str(found.value) + chain + "".join(ours)


def test_a_server_that_is_not_there_is_named_without_credentials(database: RealtimeDatabase) -> None:
    database.go_away()
    with pytest.raises(SupervisorsNotReached) as found:
        run_story(_nothing, Rtdb(f"{database.url}/?ns=demo", FixedToken("secret-1")))
    assert f"127.0.0.1:{database.port}" in str(found.value)
    assert "secret-1" not in repr(found.value) + str(found.value)
    database.come_back()


@pytest.mark.parametrize("name", ["", "a.b", "a$", "a#", "a[", "a]", "a/b", "a\n", "a\x7f"])
def test_a_name_that_can_be_no_key_is_refused_in_words(name: str, database: RealtimeDatabase) -> None:
    with pytest.raises(InvalidValue, match="NAME"):
        run_story(_nothing, Rtdb(database.url), name)


@pytest.mark.parametrize(
    "url",
    [
        "https://user:secret-1@db.example.org",
        "mqtts://user:secret-1@broker.example.org",
        "https://db.example.org/?auth=secret-1",
        "https://db.example.org/?access_token=secret-1&ns=demo",
        "http://db.example.org",
    ],
)
def test_an_address_that_would_show_credentials_is_refused(url: str) -> None:
    with pytest.raises(InvalidValue) as found:
        transport_of(AgentSettings(supervisors=url, password="secret-1"))
    assert "secret-1" not in str(found.value)


def test_a_user_without_the_projects_key_is_refused() -> None:
    with pytest.raises(InvalidValue, match="MAYA_COMS_API_KEY"):
        transport_of(AgentSettings(supervisors="https://db.example.org", user="maya@example.org", password="x"))


def test_more_commands_than_a_robot_takes_wait_in_the_database(database: RealtimeDatabase) -> None:
    database.set(f"{ROBOT}/commands", {f"k{number:04}": home(str(number)) for number in range(1100)})

    async def story(channel: SupervisorChannel) -> None:
        first = [await channel.receive() for _ in range(1000)]
        waiting = asyncio.ensure_future(channel.receive())
        done, _ = await asyncio.wait([waiting], timeout=0.05)
        assert not done
        await channel.send(result(first[0]))
        assert (await waiting).key == "k1000"

    run_story(story, Rtdb(database.url))


def supervisor(database: RealtimeDatabase, email: str) -> Any:
    """Return the caller that a user is."""
    return database.store.caller(database.store.sign_in(email))


@pytest.mark.parametrize(
    ("who", "path", "value", "may"),
    [
        ("lab", "robots/MAYA/commands/n", home("1"), True),
        ("lab", "robots/MAYA/commands/old", home("2"), False),
        ("lab", "robots/MAYA/commands/old", None, False),
        ("lab", "robots/MAYA/commands/n", 3, False),
        ("lab", "robots/OTHER/commands/n", home("1"), False),
        ("lab", "robots/MAYA/results/done", None, True),
        ("lab", "robots/MAYA/results/old", {"success": True}, False),
        ("lab", "robots/MAYA/presence", {"state": "ONLINE"}, False),
        ("lab", "accounts/lab/commands/OTHER", True, False),
        ("maya", "robots/MAYA/commands/n", home("1"), False),
        ("maya", "robots/MAYA/results/old", {"success": True}, True),
        ("maya", "robots/MAYA/results/gone", {"success": True}, False),
        ("maya", "robots/OTHER/presence", {"state": "ONLINE"}, False),
        ("maya", "robots/MAYA/document", {"default_command": "home"}, False),
        ("nobody", "robots/MAYA/commands/n", home("1"), False),
    ],
)
def test_the_rules_of_the_documentation(who: str, path: str, value: Any, may: bool, guarded: RealtimeDatabase) -> None:
    from tests.system.rtdb.store import Caller, DeniedError
    from tests.system.rtdb.tree import parts

    guarded.set("robots/MAYA", {"commands": {"old": home("0")}, "results": {"done": {"success": True}}})
    caller = Caller() if who == "nobody" else supervisor(guarded, who)
    try:
        guarded.store.write(parts(path), [(parts(path), value)], caller, merge=False)
        allowed = True
    except DeniedError:
        allowed = False
    assert allowed == may


def test_a_key_that_is_used_again_before_the_robot_knows_that_its_result_was_written(
    database: RealtimeDatabase,
) -> None:
    async def story(channel: SupervisorChannel) -> None:
        put(database, "k", home("1"))
        first = await channel.receive()
        database.held = "PATCH"
        answered = asyncio.create_task(channel.send(result(first)))
        await until(lambda: database.get(f"{ROBOT}/results/k") is not None)
        put(database, "k", home("2"))
        second = await channel.receive()
        assert json.loads(second.text) == home("2")
        database.held = ""
        await answered
        await channel.send(Report("2", ReportKind.RESULT, '{"id": "2"}', second.key))
        assert database.get(f"{ROBOT}/results/k") == {"id": "2"}

    run_story(story, Rtdb(database.url))


def test_a_long_session_costs_no_connections(database: RealtimeDatabase) -> None:
    database.set(f"{ROBOT}/commands", {f"k{number:04}": home(f"id {number}") for number in range(400)})

    async def story(channel: SupervisorChannel) -> None:
        for _ in range(400):
            await channel.receive()
        for number in range(20):
            put(database, f"later {number:02}", home(f"later {number}"))
            await channel.receive()
        assert len(database.callers) == 2

    run_story(story, Rtdb(database.url))


def test_error_names_the_missing_permission_of_older_rules(
    guarded: RealtimeDatabase, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIREBASE_AUTH_EMULATOR_HOST", f"127.0.0.1:{guarded.port}")
    rules = json.loads(RULES)
    del rules["rules"]["robots"]["$robot"]["session"]
    guarded.set_rules(json.dumps(rules))
    user = FirebaseUser("maya@example.org", "right", "key")

    async def main() -> None:
        async with Rtdb(guarded.url, user).connected("MAYA", JOURNAL):
            pass

    with pytest.raises(SupervisorsNotReached, match="it answers PUT robots/MAYA/session with 401: Permission denied"):
        run(main())
    assert guarded.get(f"{ROBOT}/presence") is None


def test_certificates_are_read_again_once_they_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "site.pem"
    file.write_text(Path(certifi.where()).read_text())
    monkeypatch.setenv("SSL_CERT_FILE", str(file))
    first = tls_context()
    assert tls_context() is first
    os.utime(file, ns=(0, 1))
    assert tls_context() is not first
