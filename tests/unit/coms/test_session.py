"""Two robots with one name at one real database: a command goes to one of them, whatever is cut in between."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, contextmanager, suppress
from itertools import count
from random import Random
from typing import Any

import pytest

from dmc41x3.loops import run
from maya_un.coms import firestore, rtdb
from maya_un.coms.database import FixedToken
from maya_un.coms.firestore import Firestore
from maya_un.coms.rtdb import Rtdb
from maya_un.coms.transport import SupervisorChannel, SupervisorTransport
from maya_un.errors import SessionTakenOver, StepTakenElsewhere, SupervisorsNotReached
from tests.system.rtdb.server import Fault, RealtimeDatabase, realtime_database
from tests.system.rtdb.tree import applied, parts
from tests.unit.coms.test_rtdb import home, result
from tests.waiting import until

ROBOT = "robots/MAYA"
SOON = 0.01


class Place:
    """A database as one of its services."""

    def __init__(self, database: RealtimeDatabase, kind: str) -> None:
        self.database = database
        self._is_tree = kind == "rtdb"
        self.get: Callable[[str], Any] = database.get if self._is_tree else database.document
        self.set: Callable[[str, Any], None] = database.set if self._is_tree else database.set_document
        self.session = f"{ROBOT}/session" if self._is_tree else f"{ROBOT}/state/session"
        self.presence = f"{ROBOT}/presence" if self._is_tree else f"{ROBOT}/state/presence"
        self.write = ("PUT", "/session") if self._is_tree else ("POST", "state/session")
        if not self._is_tree:
            database.set_document(ROBOT, {})

    def transport(self, heartbeat: float = 10.0) -> SupervisorTransport:
        """Return a link's way there: a session of its own."""
        if self._is_tree:
            return Rtdb(self.database.url, heartbeat=heartbeat)
        return Firestore("firestore://demo", FixedToken(""), interval=SOON, heartbeat=heartbeat)

    def overwrite(self, path: str, value: Any) -> None:
        """Replace data, from within the database's thread."""
        if self._is_tree:
            self.database.store.tree = applied(self.database.store.tree, [(parts(path), value)], 0)
        else:
            self.database.documents.set(path, value)

    def put(self, key: str, id_: str | None = None) -> None:
        """Send a command."""
        self.set(f"{ROBOT}/commands/{key}", home(id_ or f"id {key}"))

    def code(self, key: str) -> Any:
        """Return the code of a command's result."""
        return self.get(f"{ROBOT}/results/{key}")["code"]


@pytest.fixture(params=["rtdb", "firestore"])
def place(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Place]:
    with realtime_database() as database:
        monkeypatch.setenv("FIRESTORE_EMULATOR_HOST", f"127.0.0.1:{database.port}")
        yield Place(database, request.param)


def run_story(story: Callable[[], Awaitable[None]]) -> None:
    async def main() -> None:
        async with asyncio.timeout(120.0):
            await story()

    run(main())


@contextmanager
def changing(place: Place) -> Iterator[None]:
    """Change the session before every write of it by somebody else."""
    numbers = count()

    def before(method: str, where: bytes) -> None:
        if method == place.write[0] and place.write[1].encode() in where:
            place.overwrite(place.session, {"number": next(numbers)})

    place.database.before, usual = before, place.database.before
    try:
        yield
    finally:
        place.database.before = usual


async def taken(channel: SupervisorChannel, seen: list[str], *, answers: bool = True) -> None:
    """Note every command that comes, and answer it."""
    while True:
        command = await channel.receive()
        seen.append(command.key)
        if answers:
            await channel.send(result(command))


async def served(transport: SupervisorTransport, journal: str, seen: list[str]) -> None:
    """Serve as the link of a robot, which reconnects until another robot has its name."""
    while True:
        with suppress(SupervisorsNotReached):
            async with transport.connected("MAYA", journal) as channel:
                await taken(channel, seen, answers=False)


def test_command_goes_to_one_of_two_robots_despite_cuts(place: Place) -> None:
    rng = Random(7)
    keys = [f"k{number:03}" for number in range(120)]
    both, last = keys[:100], keys[100:]
    first, second = list[str](), list[str]()

    async def story() -> None:
        one = asyncio.create_task(served(place.transport(), "one", first))
        await until(lambda: place.get(place.session) is not None)
        two: asyncio.Task[None] | None = None
        for number, key in enumerate(both):
            place.put(key)
            if rng.random() < 0.1:
                place.database.faults.append(Fault(*place.write, rng.random() < 0.5, times=1))
            if number == 60:
                await until(lambda: len(first) > 30)
                two = asyncio.create_task(served(place.transport(), "two", second))
        assert two is not None
        await asyncio.wait({one})
        with pytest.raises(SessionTakenOver):
            one.result()
        for key in last:
            place.put(key)
        await until(lambda: all(key in first or key in second or place.get(f"{ROBOT}/results/{key}") for key in keys))
        two.cancel()
        await asyncio.gather(two, return_exceptions=True)

    run_story(story)
    assert not set(first) & set(second), "both robots got a command"
    assert first
    assert set(last) <= set(second)
    refused = [key for key in keys if place.get(f"{ROBOT}/results/{key}") is not None]
    assert set(refused) >= set(first)
    assert not set(refused) & set(second)
    assert {place.code(key) for key in refused} == {str(StepTakenElsewhere.code)}


def test_next_link_of_the_same_robot_gets_commands_of_the_last_one(place: Place) -> None:
    async def story() -> None:
        place.put("k")
        async with place.transport().connected("MAYA", "journal") as crashed:
            await crashed.receive()
            async with place.transport().connected("MAYA", "journal") as channel:
                command = await channel.receive()
                assert json.loads(command.text) == home("id k")
                await channel.send(result(command))
            place.put("later")
            with pytest.raises(SessionTakenOver):
                await crashed.receive()

    run_story(story)
    assert place.get(f"{ROBOT}/results/later") is None


def test_an_idle_robot_notices_at_its_heartbeat_and_does_not_write_that_the_other_is_away(place: Place) -> None:
    async def story() -> None:
        async with AsyncExitStack() as held:
            first = await held.enter_async_context(place.transport(SOON).connected("MAYA", "one"))
            async with place.transport().connected("MAYA", "two"):
                with pytest.raises(SessionTakenOver):
                    await first.receive()
                await held.aclose()
                assert place.get(place.presence)["state"] == "ONLINE"

    run_story(story)


def test_claims_of_commands_with_long_keys_stay_small(place: Place) -> None:
    keys = [f"{number}{'k' * 700}" for number in range(20)]

    async def story() -> None:
        for key in keys:
            place.put(key)
        async with place.transport().connected("MAYA", "one") as channel:
            seen = [await channel.receive() for _ in keys]
            assert {one.key for one in seen} == set(keys)
        assert len(json.dumps(place.get(place.session))) < 4000
        async with place.transport().connected("MAYA", "two") as channel:
            place.put("last")
            assert (await channel.receive()).key == "last"

    run_story(story)
    assert {place.code(key) for key in keys} == {str(StepTakenElsewhere.code)}


def test_claims_are_forgotten_with_their_commands(place: Place) -> None:
    async def story() -> None:
        async with place.transport().connected("MAYA", "journal") as channel:
            for key in ("0", "1", "2", "a"):
                place.put(key)
                await channel.send(result(await channel.receive()))

    run_story(story)
    assert place.get(place.session)["claims"] == {"a": "journal"}


def test_removed_session_is_written_again(place: Place) -> None:
    async def story() -> None:
        async with place.transport().connected("MAYA", "journal") as channel:
            place.put("a")
            await channel.receive()
            place.set(place.session, None)
            place.put("b")
            await channel.receive()

    run_story(story)
    assert place.get(place.session)["claims"] == {"a": "journal", "b": "journal"}


def test_a_session_that_is_nonsense_is_replaced(place: Place) -> None:
    place.set(place.session, {"id": [1], "claims": "x"})
    place.put("a")

    async def story() -> None:
        async with place.transport().connected("MAYA", "journal") as channel:
            assert (await channel.receive()).key == "a"

    run_story(story)


def test_command_with_a_used_key_is_claimed_again(place: Place) -> None:
    async def story() -> None:
        async with place.transport().connected("MAYA", "one") as first:
            place.put("k")
            await first.send(result(await first.receive()))
            async with place.transport().connected("MAYA", "two") as second:
                place.put("new")
                assert (await second.receive()).key == "new"
                place.put("k", "again")
                with pytest.raises(SessionTakenOver):
                    await first.receive()
                assert (await second.receive()).key == "k"

    run_story(story)


def test_a_key_that_another_robot_had_taken_can_be_used_again(place: Place) -> None:
    async def story() -> None:
        place.put("k")
        async with place.transport().connected("MAYA", "one") as first:
            await first.receive()
        async with place.transport(SOON).connected("MAYA", "two") as second:
            heard = asyncio.create_task(second.receive())
            await until(lambda: place.get(f"{ROBOT}/results/k") is not None)
            assert place.code("k") == str(StepTakenElsewhere.code)
            place.put("k", "again")
            assert json.loads((await heard).text) == home("again")

    run_story(story)
    assert place.get(place.session)["claims"] == {"k": "two"}


def test_claims_stay_few_while_more_commands_wait_than_one_query_returns(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(firestore, "MOST_AT_ONCE", 10)
    monkeypatch.setattr(rtdb, "MOST_AT_ONCE", 10)
    for number in range(100):
        place.put(f"{number:03}")

    async def story() -> None:
        async with place.transport().connected("MAYA", "journal") as channel:
            for _ in range(95):
                await channel.send(result(await channel.receive()))

    run_story(story)
    assert len(place.get(place.session)["claims"]) <= 20


def test_a_database_in_which_this_session_never_was_is_not_taken_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with realtime_database() as old, realtime_database() as new:
        monkeypatch.setenv("FIRESTORE_EMULATOR_HOST", f"127.0.0.1:{old.port}")
        new.set(f"{ROBOT}/session", {"id": "of last week", "host": "here"})
        transport = Firestore("firestore://demo", FixedToken(""))

        async def story() -> None:
            for database in (old, new, old):
                old.set_document(ROBOT, {"database_url": database.url})
                database.set(f"{ROBOT}/commands/k", home("id k"))
                async with transport.connected("MAYA", "journal") as channel:
                    assert (await channel.receive()).key == "k"
            new.set(f"{ROBOT}/session", {"id": "of another robot"})
            old.set_document(ROBOT, {"database_url": new.url})
            with pytest.raises(SessionTakenOver):
                async with transport.connected("MAYA", "journal"):
                    pass

        run_story(story)


def test_connection_ends_when_the_session_changes_all_the_time(place: Place) -> None:
    async def story() -> None:
        async with place.transport().connected("MAYA", "journal") as channel:
            place.put("k")
            with (
                changing(place),
                pytest.raises(SupervisorsNotReached, match="changes the robot's session all the time"),
            ):
                await channel.receive()
        with changing(place), pytest.raises(SupervisorsNotReached, match="changes the robot's session all the time"):
            async with place.transport().connected("MAYA", "journal"):
                pass
        async with place.transport().connected("MAYA", "journal") as channel:
            assert (await channel.receive()).key == "k"

    run_story(story)
