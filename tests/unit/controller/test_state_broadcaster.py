from __future__ import annotations

import asyncio
from dataclasses import replace

from maya_un.controller.monitor import StateBroadcaster
from maya_un.values import Joints
from tests.fakes import state_of
from tests.virtual_time import turn

FIRST, SECOND, THIRD = (replace(state_of(Joints(0.0, 1.5, 1.3)), time=float(second)) for second in range(3))


async def test_a_watcher_gets_the_state_now_and_every_newer_one() -> None:
    latest = StateBroadcaster(FIRST)
    states = latest.watch()
    assert await anext(states) is FIRST
    waiting = asyncio.ensure_future(anext(states))
    await turn()
    assert not waiting.done()
    latest.show(SECOND)
    assert await waiting is SECOND


async def test_slow_watcher_skips_to_the_newest_and_blocks_no_other() -> None:
    latest = StateBroadcaster(FIRST)
    slow, quick = latest.watch(), latest.watch()
    assert (await anext(slow), await anext(quick)) == (FIRST, FIRST)
    latest.show(SECOND)
    assert await anext(quick) is SECOND
    latest.show(THIRD)
    assert (await anext(slow), await anext(quick)) == (THIRD, THIRD)


async def test_old_state_is_not_yielded_again() -> None:
    latest = StateBroadcaster(FIRST)
    waiting = asyncio.ensure_future(anext(latest.watch(FIRST)))
    await turn()
    assert not waiting.done()
    latest.show(SECOND)
    assert await waiting is SECOND


async def test_until_looks_now_and_at_every_newer_state() -> None:
    latest = StateBroadcaster(FIRST)
    await latest.until(lambda: latest.state is FIRST)
    waiting = asyncio.ensure_future(latest.until(lambda: latest.state is THIRD))
    latest.show(SECOND)
    await turn()
    assert not waiting.done()
    latest.show(THIRD)
    await waiting
