"""Turns of the loop: shared alike, and never longer than others can wait for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from maya_ros.graph.protocol import Message
from maya_ros.rosbridge.client import MessageScheduler
from maya_ros.rosbridge.limits import AT_ONCE, LONGEST_TURN
from tests.rosbridge_clients import client_bus
from tests.virtual_time import turn

HOPS = 10
"""Number of times that a stop waits for the loop on its way through the gate and back, each time for two turns."""


def saying(said: list[str], name: str, count: int) -> Callable[[], bool]:
    """Return the steps of a client that has so much to say."""
    left = [count]

    def step() -> bool:
        said.append(name)
        left[0] -= 1
        return left[0] > 0

    return step


async def test_small_work_is_done_at_once() -> None:
    said = list[str]()
    turns = MessageScheduler()
    turns.give(saying(said, "a", 2))
    turns.give(saying(said, "b", 1))
    assert said == ["a", "a", "b"]


async def by_turn(said: list[str], count: int) -> list[list[str]]:
    """Return the messages of each of the loop's turns from the next on, until there are enough."""
    loop, begun, found = asyncio.get_running_loop(), len(said), list[list[str]]()

    def look() -> None:
        found.append(said[begun + sum(map(len, found)) :])
        if len(said) < count:
            loop.call_soon(look)

    look()
    while len(said) < count:
        await turn()
    return found[1:]


async def test_clients_are_in_line_and_no_turn_does_more_than_it_can() -> None:
    said = list[str]()
    turns = MessageScheduler()
    for name in "abc":
        turns.give(saying(said, name, 2 * AT_ONCE))
    assert said == ["a"] * AT_ONCE
    done = await by_turn(said, 6 * AT_ONCE)
    assert [len(one) for one in done] == [AT_ONCE] * 5
    assert done[0][:6] == list("abcabc")


async def test_a_turn_that_takes_long_does_one_thing_only() -> None:
    said, now = list[str](), [0.0]
    turns = MessageScheduler(clock=lambda: now[0])
    slowly = saying(said, "slow", 3)

    def slow() -> bool:
        now[0] += 2.0 * LONGEST_TURN
        return slowly()

    turns.give(slow)
    turns.give(saying(said, "quick", 2))
    assert said == ["slow"]
    assert await by_turn(said, 5) == [["slow"], ["quick", "slow"], ["quick"]]


@pytest.mark.parametrize("flooding", [5, 50])
async def test_stop_overtakes_messages_of_other_clients(flooding: int) -> None:
    async def stop(_request: Message) -> Message:
        for _ in range(HOPS):
            await turn()
        return {"success": True}

    async def nothing(_: Message) -> Message:
        return {"success": True}

    async with client_bus() as one:
        one.robot.serve("/controller/stop", "std_srvs/Trigger", stop)
        one.robot.serve("/nothing", "std_srvs/Trigger", nothing)
        loud, other = [one.talker() for _ in range(flooding)], one.talker()
        each = 2000 // flooding
        for talker in loud:
            say = [f'{{"op": "call_service", "service": "/nothing", "id": {number}}}' for number in range(each)]
            talker.session.take(*say)
        await turn()
        other.say("call_service", service="/controller/stop", id="stop")
        while not other.mouth.said:
            await turn()
        assert sum(len(talker.mouth.said) for talker in loud) <= 2 * AT_ONCE * (HOPS + 5)
