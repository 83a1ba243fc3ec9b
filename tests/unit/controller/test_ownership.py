from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest

from dmc41x3.driver import Driver
from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.commands import LINE_LIMIT
from dmc41x3.wire.transport import Transport
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.ownership import SILENT, Ownership
from maya_un.controller.watchdog import Watchdog
from maya_un.errors import (
    CommandRejected,
    ControllerMoves,
    ControllerOwned,
    GuardNotRunning,
    MayaError,
    NothingToRecover,
    OwnerErased,
    OwnershipLost,
)
from maya_un.events import FaultEntered
from maya_un.testing import Rig, rig
from maya_un.values import Mode
from tests.unit.controller.bench import FAR, HERE, commands_in, foreign, homed, kinds, when_sent
from tests.virtual_time import elapse

GUARD_TIME = 0.5
BRAKING = 1.5
"""A stop takes less than this [s]."""


def another(bench: Rig) -> tuple[GalilController, bytearray]:
    """Return another host's controller on the same box, and its pending commands."""

    async def dial() -> Transport:
        return bench.virtual.loopback()

    sent = bytearray()
    found = GalilController(dial, "twin", bench.controller.config, live=True)
    found.tap(lambda way, data: sent.extend(data) if way == "tx" else None)
    return found, sent


@asynccontextmanager
async def opened(bench: Rig, *, take_over: bool = False) -> AsyncIterator[GalilController]:
    other, _ = another(bench)
    await other.open(take_over=take_over)
    try:
        yield other
    finally:
        await other.close()


def guard_of(controller: GalilController) -> Watchdog:
    guard = controller._fault_monitor._guard
    assert guard is not None
    return guard


async def token(bench: Rig) -> float:
    return float((await foreign(bench, "MG _ZAB{F10.0}"))[0])


async def fall_silent(controller: GalilController) -> None:
    """Stop a host where it stands: it sends nothing more, and its connection stays."""
    await guard_of(controller)._stop_beating()
    looking = controller._fault_monitor._looking
    assert looking is not None
    looking.cancel()
    await asyncio.wait({looking})


async def wake(controller: GalilController) -> None:
    """Let it go on as if nothing had been."""
    guard_of(controller)._begin_beating(controller._monitor.link.driver)
    controller._fault_monitor.begin()
    await elapse(0.1)


async def test_the_first_host_owns_the_controller_until_it_leaves() -> None:
    async with rig(live=True) as bench:
        assert await token(bench) == guard_of(bench.controller).owner.token
        await bench.controller.close()
        assert await token(bench) == 0.0


async def test_second_host_learns_the_owner_and_writes_nothing() -> None:
    async with homed(live=True) as bench:
        other, sent = another(bench)
        before = await foreign(bench, "LV", "MG _XQ7>0,_CF,_SPA,_ERA,_MOA")
        with pytest.raises(ControllerOwned, match=f"process {os.getpid()}"):
            await other.open()
        await other.close()
        assert {command[:2] for command in commands_in(bytes(sent))} <= {"\x12\x16", "QR", "MG"}
        after = await foreign(bench, "LV", "MG _XQ7>0,_CF,_SPA,_ERA,_MOA")
        assert after[1] == before[1]
        await bench.controller.move(FAR)


async def test_a_dry_run_asks_for_no_owner() -> None:
    async with rig() as bench:
        assert await token(bench) == 0.0
        assert b"ZAB" not in bench.sent


async def test_without_a_watchdog_the_controller_still_has_one_owner() -> None:
    async with rig(parse({"safety": {"guard_time": 0.0}}), live=True) as bench:
        await elapse(10.0)
        with pytest.raises(ControllerOwned):
            await another(bench)[0].open()
        await bench.controller.gripper(False)


async def test_a_host_that_died_leaves_the_controller_to_the_next_once_its_axes_rest() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        bench.virtual.tap = None
        await fall_silent(bench.controller)
        silent = bench.virtual.machine.now
        async with opened(bench) as other:
            assert not other.state.moving
            assert bench.virtual.machine.now - silent <= SILENT + BRAKING
            lines = bench.mechanics.timelines
            assert max(line.pieces[-1].t for line in lines) - silent <= GUARD_TIME + BRAKING
            await asyncio.wait({move})
            assert move.exception() is not None


async def test_two_hosts_that_claim_at_the_same_instant_make_one_owner() -> None:
    async with rig() as bench:
        await bench.controller.close()
        for _ in range(20):
            hosts = [another(bench)[0] for _ in range(3)]
            results = await asyncio.gather(*(host.open() for host in hosts), return_exceptions=True)
            owners = [host for host, result in zip(hosts, results, strict=True) if result is None]
            assert len(owners) == 1
            assert await token(bench) == guard_of(owners[0]).owner.token
            assert all(isinstance(result, ControllerOwned) for result in results if result is not None)
            await asyncio.gather(*(host.close() for host in hosts))


async def test_claim_fails_when_the_owner_has_changed() -> None:
    async with rig(live=True) as bench:
        driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
        late = Ownership(SILENT)
        held = await late.look(driver)
        await elapse(0.1)
        assert not await late._swapped(driver, held, alive=False)  # the owner has beaten since
        assert not await late._swapped(driver, held._replace(token=0), alive=True)
        assert await token(bench) == guard_of(bench.controller).owner.token
        await driver.close()


async def test_beat_of_one_host_does_not_feed_the_watchdog_of_another() -> None:
    async with homed(live=True) as bench:
        driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
        late = Ownership(SILENT)
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        await fall_silent(bench.controller)
        for _ in range(30):
            await driver.batch([late.beat, *late.arm])
            await elapse(0.025)
        assert await foreign(bench, "MG mayaout") == ["1.0000"]
        await elapse(BRAKING)
        assert await foreign(bench, "MG _BGS") == ["0.0000"]
        await driver.close()
        await wake(bench.controller)
        with pytest.raises(MayaError):
            await move


@pytest.mark.parametrize("when", ["at rest", "before BGS"])
async def test_a_host_that_slept_finds_its_connection_ended_and_moves_nothing(when: str) -> None:
    async with homed(live=True) as bench:
        move, late = None, asyncio.Event()
        if when == "before BGS":
            move, late = await stopped_before_begin(bench)
        await fall_silent(bench.controller)
        await elapse(2.0)
        async with opened(bench) as other:
            await foreign(bench, "mayapid=4711")  # both hosts are this process: let them differ
            rest = bench.mechanics.true_joints()
            if move is not None:
                late.set()
            await elapse(5.0)
            assert bench.mechanics.true_joints() == pytest.approx(rest, abs=5e-5)
            assert await token(bench) == guard_of(other).owner.token
            fault = bench.controller.state.fault
            assert fault is not None
            assert fault.code == OwnershipLost.code
            assert "process 4711" in str(fault)
            with pytest.raises(ControllerOwned):
                await bench.controller.recover()
            if move is not None:
                with pytest.raises(MayaError):
                    await move


async def test_a_host_that_slept_before_it_signed_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its connection is not known yet, so the next owner cannot close it."""
    async with rig(live=True) as bench:
        await fall_silent(bench.controller)
        asleep, awake, fence = asyncio.Event(), asyncio.Event(), Ownership._fence

        async def slow(ownership: Ownership, driver: Driver) -> None:
            asleep.set()
            await awake.wait()
            await fence(ownership, driver)

        with monkeypatch.context() as patch:
            patch.setattr(Ownership, "_fence", slow)
            late, sent = another(bench)
            opening = asyncio.create_task(late.open())
            await asleep.wait()
        await elapse(2.0 * SILENT)
        async with opened(bench) as other:
            del sent[:]
            awake.set()
            with pytest.raises(ControllerOwned):
                await opening
            assert await token(bench) == guard_of(other).owner.token
            assert all(command.startswith(("MG", "maya")) for command in commands_in(bytes(sent)))
            await other.gripper(False)
        await late.close()


async def test_a_connection_that_ends_before_it_is_closed_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(live=True) as bench:
        await fall_silent(bench.controller)
        former, send = bench.controller._monitor.link.driver, Driver.send
        refused: list[int] = []

        async def late(driver: Driver, command: str, *, timeout: float | None = None) -> str:
            if command.startswith("IH"):
                await former.close()
                await elapse(0.1)
            try:
                return await send(driver, command, timeout=timeout)
            except CommandRejected as rejected:
                refused.append(int(str(rejected.details["tc"])))
                raise

        with monkeypatch.context() as patch:
            patch.setattr(Driver, "send", late)
            async with opened(bench) as other:
                assert await token(bench) == guard_of(other).owner.token
        assert ErrorCode.HANDLE_CLOSED in refused


async def test_a_connection_that_cannot_be_closed_ends_the_take_over(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(live=True) as bench:
        await fall_silent(bench.controller)
        send = Driver.send

        async def wrong(driver: Driver, command: str, *, timeout: float | None = None) -> str:
            return await send(driver, "IHA=>-9" if command.startswith("IH") else command, timeout=timeout)

        with monkeypatch.context() as patch:
            patch.setattr(Driver, "send", wrong)
            late, _ = another(bench)
            with pytest.raises(CommandRejected):
                await late.open()
        await late.close()


async def stopped_before_begin(bench: Rig) -> tuple[asyncio.Task[None], asyncio.Event]:
    """Have a host sleep between its proof and its BGS; the event wakes it."""
    driver = bench.controller._monitor.link.driver
    asleep, awake = asyncio.Event(), asyncio.Event()
    send: Callable[..., Awaitable[str]] = driver.send

    async def slow(command: str, *, timeout: float | None = None) -> str:
        if command == "BGS":
            asleep.set()
            await awake.wait()
        return await send(command, timeout=timeout)

    driver.send = slow  # type: ignore[method-assign]
    move = asyncio.create_task(bench.controller.move(FAR))
    await asleep.wait()
    return move, awake


@pytest.mark.parametrize("action", ["move", "home", "skip_home", "gripper", "output"])
async def test_nothing_moves_from_the_instant_at_which_the_token_is_another(action: str) -> None:
    """The token goes to another before the proof, and this host has had no beat to learn of it."""
    async with homed(parse({"controller": {"outputs": [2]}}), live=True) as bench:
        guard = guard_of(bench.controller)
        await guard._stop_beating()
        guard._beat = asyncio.create_task(elapse(1000.0))
        await foreign(bench, "ZAB=77")
        rest, outputs = bench.mechanics.true_joints(), await foreign(bench, "MG _OP0,_MOA,_MOB,_MOC")
        layer = bench.controller
        actions = {
            "move": lambda: layer.move(FAR),
            "home": layer.home,
            "skip_home": layer.skip_home,
            "gripper": lambda: layer.gripper(True),
            "output": lambda: layer.output(2, on=True),
        }
        with pytest.raises(OwnershipLost):
            await actions[action]()
        await elapse(5.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=5e-5)
        assert await foreign(bench, "MG _OP0,_MOA,_MOB,_MOC") == outputs


async def test_an_owner_that_lost_the_controller_in_motion_learns_it_within_a_beat_and_its_motion_ends() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.01)
        await foreign(bench, "ZAB=77")
        lost = bench.virtual.machine.now
        del bench.sent[:]
        with pytest.raises(OwnershipLost):
            await move
        assert bench.virtual.machine.now - lost <= 0.03
        assert bench.controller.state.mode is Mode.FAULT
        await elapse(GUARD_TIME + BRAKING)
        assert await foreign(bench, "MG _BGS") == ["0.0000"]
        assert not {"ST S", "BGS"} & set(commands_in(bytes(bench.sent)))


async def test_living_owner_is_taken_over_at_rest_only_and_notified() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        other, _ = another(bench)
        with pytest.raises(ControllerMoves) as refused:
            await other.open(take_over=True)
        assert f"maya stop --address {refused.value.details['address']}" in str(refused.value)
        await other.close()
        await move
        seen = len(bench.controller.events)
        async with opened(bench, take_over=True) as other:
            assert await token(bench) == guard_of(other).owner.token
            await elapse(3.0)
            assert bench.controller.state.mode is Mode.FAULT
            assert bench.controller.state.fault is not None
            assert bench.controller.state.fault.code == OwnershipLost.code
            assert FaultEntered in kinds(bench, seen)
            await other.skip_home()
            await other.move(HERE)


async def test_replaced_owner_returns_by_command_of_a_person() -> None:
    async with homed(live=True) as bench:
        other, _ = another(bench)
        await other.open(take_over=True)
        await elapse(3.0)
        await bench.controller.recover(take_over=True)
        assert await token(bench) == guard_of(bench.controller).owner.token
        await elapse(3.0)
        assert other.state.mode is Mode.FAULT
        await other.close()
        await bench.controller.move(FAR)
        with pytest.raises(NothingToRecover):
            await bench.controller.recover(take_over=True)


async def test_replaced_owner_leaves_without_a_trace() -> None:
    async with homed(live=True) as bench, opened(bench, take_over=True) as other:
        await elapse(3.0)
        await other.skip_home()
        move = asyncio.create_task(other.move(FAR))
        await elapse(3.0)
        await bench.controller.close()
        await move
        assert await token(bench) == guard_of(other).owner.token


@pytest.mark.parametrize("seconds", [0.2, 3.0])
async def test_restored_link_finds_its_own_controller(seconds: float) -> None:
    async with homed(live=True) as bench:
        bench.virtual.refuse(True)
        bench.virtual.cut()
        await elapse(seconds)
        bench.virtual.refuse(False)
        await elapse(6.0)
        with pytest.raises(ControllerOwned):
            await another(bench)[0].open()
        await bench.controller.recover()
        await bench.controller.move(FAR)


async def test_link_restored_in_motion_leaves_it_to_the_watchdog() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        bench.virtual.cut()
        cut = bench.virtual.machine.now
        with pytest.raises(MayaError):
            await move
        await elapse(GUARD_TIME + BRAKING)
        assert await foreign(bench, "MG _BGS,mayaout") == ["0.0000 1.0000"]
        assert max(line.pieces[-1].t for line in bench.mechanics.timelines) - cut <= GUARD_TIME + BRAKING


async def test_returning_link_names_the_other_owner() -> None:
    async with homed(live=True) as bench:
        bench.virtual.refuse(True)
        bench.virtual.cut("A")
        await elapse(1.0)
        bench.virtual.refuse(False)
        async with opened(bench):
            await elapse(5.0)
            assert bench.controller.state.fault is not None
            assert bench.controller.state.fault.code == OwnershipLost.code
            with pytest.raises(ControllerOwned):
                await bench.controller.recover()
        await bench.controller.recover()


async def test_reset_clears_the_owner_whatever_was_burned() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "BV")
        await bench.controller.close()
        await foreign(bench, "ZAB=77", "mayabeat=TIME")  # as if it had died now
        await foreign(bench, "BV", "RS")
        await elapse(1.0)
        began = bench.virtual.machine.now
        async with opened(bench):
            assert bench.virtual.machine.now - began < 0.1


@pytest.mark.parametrize("beat", ["2147483647", "-2147483648", "0", "TIME-1100", "TIME+40"])
async def test_remains_of_a_dead_owner_keep_no_host_out(beat: str) -> None:
    async with rig() as bench:
        await bench.controller.close()
        await foreign(bench, "ZAB=77", f"mayabeat={beat}")
        began = bench.virtual.machine.now
        async with opened(bench):
            assert bench.virtual.machine.now - began < SILENT + 0.3


async def test_a_living_owner_is_recognised_while_time_wraps() -> None:
    async with rig() as bench:
        await bench.controller.close()
        driver = await Driver.open(bench.virtual.loopback(), timeout=2.0)
        watcher = Ownership(SILENT)
        await driver.batch(["ZAB=77", "mayabeat=2147483640"])
        held = (await watcher.look(driver))._replace(time=-2147483640)
        assert 0.0 < held.age < 0.02
        await driver.close()


async def test_owner_without_variables_is_considered_dead() -> None:
    async with rig() as bench:
        await bench.controller.close()
        await foreign(bench, "ZAB=77")
        async with opened(bench) as other:
            assert await token(bench) == guard_of(other).owner.token


@pytest.mark.parametrize(
    ("commands", "error"),
    [(["ZAB=0"], OwnerErased), (["HX7", "ZAB=0"], GuardNotRunning)],
)
async def test_erased_token_is_named_while_the_watchdog_runs(commands: list[str], error: type[MayaError]) -> None:
    async with homed(live=True) as bench:
        await foreign(bench, *commands)
        await elapse(0.2)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == error.code
        await bench.controller.recover()
        await bench.controller.move(FAR)


async def test_token_erased_in_motion_ends_the_motion_at_once() -> None:
    async with homed(live=True) as bench:
        moving = asyncio.create_task(bench.controller.move(FAR))
        await elapse(1.0)
        assert bench.controller.state.moving
        await foreign(bench, "ZAB=0")
        began = asyncio.get_running_loop().time()
        with pytest.raises(OwnerErased):
            await moving
        assert asyncio.get_running_loop().time() - began < BRAKING
        await bench.controller.recover()
        await bench.controller.move(FAR)


async def test_recovery_while_a_link_that_returned_waits_for_rest_leaves_one_beat() -> None:
    async with homed(live=True) as bench:
        guard, driver = guard_of(bench.controller), bench.controller._monitor.link.driver
        rest = asyncio.Event()

        async def until_rest() -> bool:
            await rest.wait()
            return False

        async def at_rest() -> bool:
            return False

        resuming = asyncio.create_task(guard.resume(driver, until_rest))
        await elapse(0.01)
        claiming = asyncio.create_task(guard.claim(driver, "twin", at_rest))
        await elapse(0.1)
        rest.set()
        await asyncio.gather(resuming, claiming)
        beats = [task for task in asyncio.all_tasks() if task.get_name() == "beat of the guard"]
        assert len(beats) == 1


@pytest.mark.parametrize("form", ["VF -4.0", "VF 4.0", "VF 10.4"])
async def test_how_numbers_are_printed_does_not_hide_the_owner(form: str) -> None:
    async with rig(live=True) as bench:
        await foreign(bench, form)
        with pytest.raises(ControllerOwned, match=f"process {os.getpid()}"):
            await another(bench)[0].open()


async def test_a_take_over_in_the_instant_before_a_motion_begins_ends_it() -> None:
    """The old owner's BGS arrives behind the swap: the new owner stops the motion before it feeds any guard."""
    async with homed(live=True) as bench:
        other, _ = another(bench)
        begun: list[asyncio.Task[None]] = []
        when_sent(bench, "ZAB=(", lambda: begun.append(asyncio.create_task(bench.controller.move(FAR))))
        await other.open(take_over=True)
        assert begun
        assert not other.state.moving
        await asyncio.wait(begun)
        assert begun[0].exception() is not None
        rest = bench.mechanics.true_joints()
        await elapse(5.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=1e-3)
        await other.close()


def test_every_command_fits_a_line_of_the_controller() -> None:
    owner = Ownership(SILENT)
    owner.token = 999_999_999
    owner.ours, owner.theirs = f"(_ZAB={owner.token})", f"(_ZAB<>{owner.token})"
    kept = owner._kept("mayawho1", "$7E7E7E7E.7E7E")
    assert max(map(len, (*owner.arm, *owner.first_arm, owner.output(80, high=True), kept))) <= LINE_LIMIT
