from __future__ import annotations

import asyncio

import pytest

from maya_un.errors import (
    ControllerReset,
    Faulted,
    LinkLost,
    NotConnected,
)
from maya_un.events import Connected, Disconnected, FaultCleared, FaultEntered
from maya_un.testing import rig
from maya_un.values import Mode, State
from tests.unit.controller.bench import FAR, HERE, OWN, commands_in, foreign, homed, kinds
from tests.virtual_time import elapse

QUESTIONS = ("\x12\x16", "QR", "MG ", "TC1")


async def test_a_watcher_gets_the_state_now_and_then_every_newer_one() -> None:
    async with rig() as bench:
        states = bench.controller.watch()
        first = await anext(states)
        assert first is bench.controller.state
        second = asyncio.ensure_future(anext(states))
        await elapse(5.0)
        assert not second.done()
        await bench.controller.gripper(True)
        assert (await second).time > first.time


async def test_a_slow_watcher_skips_to_the_newest() -> None:
    async with rig(live=True) as bench:
        states = bench.controller.watch()
        times: list[float] = []
        for pause in (0.0, 10.0, 0.0, 33.0):
            await elapse(pause)
            times.append((await anext(states)).time)
        assert times[1] >= 9.9
        assert times[2] == pytest.approx(times[1] + 0.05, abs=0.01)
        assert times[3] >= 42.9


async def test_watchers_do_not_disturb_one_another() -> None:
    async with rig(live=True) as bench:
        seen: list[State] = []

        async def watch() -> None:
            async for state in bench.controller.watch():
                seen.append(state)

        watchers = [asyncio.create_task(watch()) for _ in range(3)]
        await elapse(1.01)
        for watcher in watchers:
            watcher.cancel()
        await asyncio.wait(watchers)
        assert len(seen) >= 3 * 20
        assert all(seen.count(state) == 3 for state in seen[3:-3])


async def test_modes_and_progress_of_a_move() -> None:
    async with homed(live=True) as bench:
        controller = bench.controller
        assert (controller.state.mode, controller.progress()) == (Mode.IDLE, None)
        move = asyncio.create_task(controller.move(FAR))
        await elapse(10.02)
        progress = controller.progress()
        assert progress is not None
        assert (controller.state.mode, progress.phase) == (Mode.MOVING, "move")
        assert progress.elapsed == pytest.approx(10.0, abs=0.05)
        assert progress.duration == pytest.approx(controller.preview([HERE, FAR]).duration, abs=0.1)
        assert controller.state.moving
        assert controller.state.progress is not None
        await move
        assert (controller.state.mode, controller.progress(), controller.state.progress) == (Mode.IDLE, None, None)


async def test_a_lost_link_is_one_event_and_a_fault_that_a_person_clears() -> None:
    async with homed(live=True) as bench:
        seen = len(bench.controller.events)
        bench.virtual.cut()
        await elapse(0.1)
        assert bench.controller.state.mode is Mode.DISCONNECTED
        with pytest.raises(NotConnected):
            await bench.controller.move(FAR)
        with pytest.raises(NotConnected):
            await bench.controller.stop()
        await elapse(10.0)
        assert kinds(bench, seen) == [Disconnected, Connected]
        assert bench.controller.state.mode is Mode.FAULT
        with pytest.raises(Faulted):
            await bench.controller.move(FAR)
        await bench.controller.recover()
        assert kinds(bench, seen)[2:] == [FaultCleared]
        assert (bench.controller.state.mode, bench.controller.state.homed) == (Mode.IDLE, True)


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("live", [False, True])
async def test_after_a_reconnect_only_questions_go_over_the_wire(moving: bool, live: bool) -> None:
    async with homed(live=live) as bench:
        move = asyncio.create_task(bench.controller.move(FAR)) if moving else None
        await elapse(8.0)
        del bench.sent[:]
        bench.virtual.refuse(True)
        bench.virtual.cut()
        await elapse(5.0)
        bench.virtual.refuse(False)
        await elapse(100.0)
        commands = commands_in(bytes(bench.sent))
        assert "\x12\x16" in commands
        assert [command for command in commands if not command.startswith(QUESTIONS + OWN)] == []
        if move is not None:
            assert isinstance(move.exception(), LinkLost)


async def test_a_controller_that_was_switched_off_and_on_is_noticed_when_it_is_back() -> None:
    async with homed() as bench:
        seen = len(bench.controller.events)
        bench.virtual.cut()
        await foreign(bench, "RS")
        await elapse(10.0)
        assert kinds(bench, seen) == [Disconnected, Connected, FaultEntered]
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == ControllerReset.code
        assert not bench.controller.state.homed


async def test_a_reset_in_motion_ends_the_motion_by_name() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "RS")
        with pytest.raises(LinkLost):  # a reset ends all connections
            await move
        await elapse(2.0)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == ControllerReset.code
        assert (bench.controller.state.mode, bench.controller.state.homed) == (Mode.FAULT, False)
