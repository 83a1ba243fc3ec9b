"""A share of the loop: turns come one after the other, and what they take is a part of the time."""

from __future__ import annotations

import asyncio

import pytest

from maya_un.http.bridge import LONGEST_PAUSE, LoopShare
from tests.virtual_time import elapse


async def test_turns_are_given_in_order_and_one_at_a_time() -> None:
    share, said = LoopShare(), list[str]()

    async def one(name: str) -> None:
        async with share.turn():
            said.append(f"{name} begins")
            await elapse(0.01)
            said.append(f"{name} ends")

    await asyncio.gather(*(one(name) for name in "abc"))
    assert said == ["a begins", "a ends", "b begins", "b ends", "c begins", "c ends"]


@pytest.mark.parametrize(("readers", "seconds"), [(1, 0.004), (40, 0.004), (40, 0.02)])
async def test_all_readers_together_have_their_share_of_the_time(readers: int, seconds: float) -> None:
    share, used, loop = LoopShare(0.2), list[float](), asyncio.get_running_loop()

    async def greedy() -> None:
        while loop.time() < end:
            async with share.turn():
                await elapse(seconds)
                used.append(seconds)

    end = loop.time() + 20.0
    await asyncio.gather(*(greedy() for _ in range(readers)))
    assert sum(used) == pytest.approx(0.2 * 20.0, rel=0.25)


async def test_first_comer_waits_for_nothing() -> None:
    share, loop = LoopShare(), asyncio.get_running_loop()
    async with share.turn():
        await elapse(0.1)
    await elapse(10.0)
    before = loop.time()
    async with share.turn():
        assert loop.time() == before


async def test_a_turn_that_took_long_is_not_held_against_the_next_for_long() -> None:
    share, loop = LoopShare(0.1), asyncio.get_running_loop()
    async with share.turn():
        await elapse(60.0)
    before = loop.time()
    async with share.turn():
        assert loop.time() == pytest.approx(before + LONGEST_PAUSE)


async def test_a_turn_that_fails_or_is_given_up_is_over() -> None:
    share = LoopShare()
    with pytest.raises(ValueError, match="no"):
        async with share.turn():
            raise ValueError("no")
    held = share.turn()
    await held.__aenter__()
    waiting = asyncio.ensure_future(share.turn().__aenter__())
    await elapse(0.1)
    waiting.cancel()
    await held.__aexit__(None, None, None)
    async with asyncio.timeout(1.0), share.turn():
        pass
