"""A hundred readers of the stream of which some are slow, some dead, some stopped by the system: nobody else notices.

Delays are measured in events, not in seconds: no event comes before all healthy readers have the one before it, while
the others are not read at all.
"""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import AsyncExitStack, ExitStack, contextmanager
from pathlib import Path

import pytest

from dmc41x3.loops import run
from tests.campaign import Campaign
from tests.streaming import Client, SlowReader, Watched, connected, streamed
from tests.system.processes import Process, done, running

pytestmark = pytest.mark.system

ROOT = Path(__file__).resolve().parents[2]

TEXT = "x" * 2000
"""Makes events long, so that what the system keeps for a reader is soon full."""

BEHIND = 150
"""Readers may be so many events behind in these tests."""

READER = """
import sys
sys.path.insert(0, sys.argv[2])
from tests.streaming import SlowReader
reader = SlowReader(sys.argv[1])
reader.say(type="subscribe", state={"rate": 100}, events={})
print(reader.read()[0]["type"], flush=True)
while True:
    reader.read()
"""


@contextmanager
def stopped_process(url: str) -> Iterator[None]:
    """Let a process read the stream that the system stops before it has read much."""
    command = [sys.executable, "-c", READER, url, str(ROOT)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "hello\n"
            process.send_signal(signal.SIGSTOP)
            yield
        finally:
            process.kill()


def sluggards(stack: ExitStack, url: str, count: int) -> list[SlowReader]:
    """Return readers that want everything and read nothing."""
    readers = [SlowReader(url) for _ in range(count)]
    for reader in readers:
        stack.callback(reader.close)
        reader.say(type="subscribe", state={"rate": 100}, events={"since": 0})
    return readers


async def all_well(stack: AsyncExitStack, url: str, count: int) -> list[Client]:
    """Return clients that read all that comes."""
    clients = [await stack.enter_async_context(connected(url)) for _ in range(count)]
    for client in clients:
        await client.ask("subscribe", state={"rate": 100}, events={"since": 0})
    return clients


async def see(client: Client, event: int, count: int) -> None:
    """Read on until this event and this state have come."""
    while True:
        message = await client.hear()
        if message["type"] == "event" and message["event"]["seq"] >= event:
            break
    while not any(one["type"] == "state" and one["state"]["counts"][0] >= count for one in client.got[-50:]):
        await client.hear()


def test_slow_and_dead_readers_among_a_hundred_disturb_none_and_miss_nothing(campaign: Campaign) -> None:
    rounds = campaign.size(ci=30, long=300)

    async def main() -> None:
        watched, loop = Watched(), asyncio.get_running_loop()
        async with streamed(watched, most_behind=BEHIND) as url, AsyncExitStack() as well:
            clients = await all_well(well, url, 92)
            with ExitStack() as ill:
                slow = await loop.run_in_executor(None, sluggards, ill, url, 7)
                await loop.run_in_executor(None, ill.enter_context, stopped_process(url))
                for round_ in range(1, rounds + 1):
                    watched.happen(20, text=TEXT)
                    count = watched.count()
                    await asyncio.gather(*(see(client, 20 * round_, count) for client in clients))
                last = 20 * rounds
                for client in clients:
                    assert client.numbers == list(range(1, last + 1))
                for reader in slow[:3]:
                    await resumed(url, await loop.run_in_executor(None, reader.read_on), last)

    run(main())


async def resumed(url: str, got: list[dict[str, object]], last: int) -> None:
    """Go on where a reader that was cut off had come to, and look whether anything is missing or came twice."""
    first = [message["event"]["seq"] for message in got if message["type"] == "event"]  # type: ignore[index]
    assert first == list(range(1, len(first) + 1))
    assert len(first) < last, "it was to be cut off"
    told = [message for message in got if message["type"] == "error"]
    assert [message["code"] for message in told] in ([], [4016])
    async with connected(url) as client:
        await client.say("subscribe", events={"since": len(first), "run": 1})
        assert await client.events_to(last) == list(range(len(first) + 1, last + 1))


def test_one_that_reads_slowly_but_steadily_is_not_cut_off_and_sees_new_states_only() -> None:
    async def main() -> None:
        watched, loop = Watched(), asyncio.get_running_loop()
        async with streamed(watched) as url:
            reader = await loop.run_in_executor(None, SlowReader, url)
            reader.say(type="subscribe", state={"rate": 100}, events={"since": 0})
            got: list[dict[str, object]] = []
            while not any(message["type"] == "subscribed" for message in got):
                got += await loop.run_in_executor(None, reader.read)
            for _ in range(300):
                watched.happen(10, text=TEXT)
                watched.count()
                got += await loop.run_in_executor(None, reader.read, 8192)
            while numbers(got)[-1:] != [3000]:
                got += await loop.run_in_executor(None, reader.read, 65_536)
            assert numbers(got) == list(range(1, 3001))
            states = [message["state"]["counts"][0] for message in got if message["type"] == "state"]  # type: ignore[index]
            assert states == sorted(states)
            reader.close()

    run(main())


def numbers(got: list[dict[str, object]]) -> list[int]:
    """Return the numbers of the events among messages."""
    return [message["event"]["seq"] for message in got if message["type"] == "event"]  # type: ignore[index]


def test_client_resumes_over_a_restart_of_the_service_and_is_notified() -> None:
    async def main() -> None:
        before = Watched(run=1)
        before.happen(30)
        async with streamed(before) as url, connected(url) as client:
            await client.ask("subscribe", events={"since": 10, "run": 1})
            assert await client.events_to(30) == list(range(11, 31))
        after = Watched(run=2)
        after.happen(5)
        async with streamed(after) as url, connected(url) as client:
            assert (client.got[0]["run"], client.got[0]["last_event"]) == (2, 5)
            await client.say("subscribe", events={"since": 30, "run": 1})
            assert await client.until("restart") == {"type": "restart", "run": 2}
            after.happen()
            assert await client.events_to(6) == [1, 2, 3, 4, 5, 6]

    run(main())


def test_a_service_that_was_killed_and_started_again_is_another_run() -> None:
    """One client is there while the robot homes, and comes back to what the next start of the service offers."""
    Path("home.yaml").write_text("name: home\nsteps: [home]\n", encoding="utf-8")
    with running("up --port 0 --speed 5") as up:
        seen = asyncio.run(homing(service_url(up)))
        up.kill()
    assert seen == list(range(1, len(seen) + 1))
    with running("up --port 0 --speed 50") as up:
        asyncio.run(taken_up(service_url(up), since=len(seen)))


def service_url(up: Process) -> str:
    """Return the address of the stream of a service that has begun."""
    return up.until("Service:").rpartition("http://")[2].join(("ws://", "/v1/stream"))


async def homing(url: str) -> list[int]:
    """Have the robot home, and return the numbers of the events that come until it does."""
    async with connected(url) as client:
        await client.ask("subscribe", state={"rate": 20}, events={"since": 0}, queue=True)
        asked = asyncio.get_running_loop().run_in_executor(None, done, "job submit home.yaml")
        while (await client.until("state"))["state"]["mode"] != "homing":
            pass
        assert (await asked)[0] == 0
        while not any(one["type"] == "event" and one["event"]["kind"] == "homing" for one in client.got):
            await client.hear()
        return client.numbers


async def taken_up(url: str, since: int) -> None:
    """Go on behind the last event of the run before."""
    async with connected(url) as client:
        assert client.got[0]["run"] == 2
        await client.say("subscribe", events={"since": since, "run": 1}, queue=True)
        assert (await client.until("restart"))["run"] == 2
        queue = next((one for one in client.got if one["type"] == "queue"), None) or await client.until("queue")
        assert (queue["queue"]["mode"], queue["queue"]["recovery"]["job"]) == ("paused", 1)
        assert client.numbers in ([], list(range(1, len(client.numbers) + 1)))
