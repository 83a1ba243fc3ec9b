from __future__ import annotations

import asyncio
from math import inf

import pytest

from maya_un.controller.command_slot import ExclusiveSlot, RunningCommand
from maya_un.errors import AbortInput, Busy, LinkLost, NotHomed, Stopped
from tests.unit.controller.bench import now
from tests.virtual_time import elapse


async def test_second_command_is_refused_with_the_name_of_the_first() -> None:
    slot = ExclusiveSlot()
    with slot.take("home") as first:
        assert slot.current is first
        with pytest.raises(Busy) as refusal, slot.take("move"):
            pytest.fail("two commands at once")
        assert refusal.value.details == {"doing": "home"}
        assert slot.current is first
    assert slot.current is None


@pytest.mark.parametrize("error", [NotHomed(command="maya home"), AbortInput(), asyncio.CancelledError()])
async def test_failed_command_frees_the_slot(error: BaseException) -> None:
    slot = ExclusiveSlot()
    with pytest.raises(type(error)), slot.take("move"):
        raise error
    with slot.take("home") as command:
        assert command.name == "home"


async def test_the_first_interruption_decides() -> None:
    command = RunningCommand("move")
    command.check()
    command.interrupt(Stopped())
    command.interrupt(AbortInput())
    for _ in range(2):
        with pytest.raises(Stopped):
            command.check()


async def test_a_pause_lasts_until_its_time() -> None:
    command = RunningCommand("move")
    await command.wait(now() + 2.5)
    assert now() == 2.5
    await command.wait(1.0)
    assert now() == 2.5


async def test_an_interruption_ends_a_pause_at_once() -> None:
    command = RunningCommand("move")
    asyncio.get_running_loop().call_later(0.75, command.interrupt, LinkLost(address="box", reason="cut"))
    with pytest.raises(LinkLost):
        await command.wait(now() + 100.0)
    assert now() == 0.75


async def test_ended_pause_still_reports_an_interruption() -> None:
    command = RunningCommand("move")
    command.interrupt(Stopped())
    with pytest.raises(Stopped):
        await command.wait(now() - 1.0)


async def test_a_cancelled_pause_interrupts_nothing() -> None:
    command = RunningCommand("move")
    pause = asyncio.create_task(command.wait(now() + 9.0))
    asyncio.get_running_loop().call_later(1.0, pause.cancel)
    await asyncio.wait({pause})
    assert pause.cancelled()
    command.check()


async def test_news_end_a_wait_without_an_end() -> None:
    command = RunningCommand("move")
    news: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    waiting = asyncio.create_task(command.wait(inf, news))
    await elapse(1e6)
    assert not waiting.done()
    news.set_result(None)
    await waiting


async def test_an_interruption_ends_a_wait_for_news() -> None:
    command = RunningCommand("move")
    news: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    waiting = asyncio.create_task(command.wait(inf, news))
    await elapse(1.0)
    command.interrupt(Stopped())
    with pytest.raises(Stopped):
        await waiting
