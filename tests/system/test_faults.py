"""Spontaneous faults of the machine end the motion, have a name, and are cleared only by a person."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from math import inf

import pytest

from dmc41x3.wire.transport import Transport
from maya_un.controller.controller import GalilController
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    ControllerReset,
    Faulted,
    FollowingError,
    LimitReached,
    MachineError,
    MarkerMissing,
    MotorOff,
    NothingToRecover,
    NotHomed,
    Stopped,
)
from maya_un.events import EmergencyStopped, Event, FaultEntered, LimitHit
from maya_un.testing import Rig, rig
from maya_un.values import Joints, Mode
from tests.unit.controller.bench import FAR, foreign, homed
from tests.virtual_time import elapse

COUNT = 5e-5
"""A count of the boom [rad], more than one of a line [m]: SH takes the reference to a whole count."""


@asynccontextmanager
async def after_homing() -> AsyncIterator[Rig]:
    """Give a robot that has homed, for tests of what homing leaves; `homed` costs less."""
    async with rig() as bench:
        await bench.controller.home()
        yield bench


async def press_abort(bench: Rig) -> None:
    bench.virtual.abort_input(True)


async def break_amplifier(bench: Rig) -> None:
    bench.virtual.amplifier_fault(1 << 24)


async def block_a_line(bench: Rig) -> None:
    bench.mechanics.limit_torque(1, 0.01)


async def fake_a_limit(bench: Rig) -> None:
    bench.virtual.faults.inject("stuck_limit", {"axis": "C", "side": "forward"}, seconds=inf)


async def heal(bench: Rig) -> None:
    bench.virtual.abort_input(False)
    bench.virtual.amplifier_fault(0)
    for fault in bench.virtual.faults.active:
        bench.virtual.faults.end(fault)


Cause = Callable[[Rig], Awaitable[None]]
FAULTS = [
    (press_abort, AbortInput, EmergencyStopped),
    (break_amplifier, AmplifierFault, FaultEntered),
    (block_a_line, FollowingError, FaultEntered),
    (fake_a_limit, LimitReached, LimitHit),
]


@pytest.mark.parametrize("live", [True, False])
@pytest.mark.parametrize(("cause", "error", "kind"), FAULTS)
async def test_a_fault_in_motion_is_named_and_waits_for_a_person(
    cause: Cause, error: type[MachineError], kind: type[Event], live: bool
) -> None:
    async with homed(live=live) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        seen = len(bench.controller.events)
        await cause(bench)
        with pytest.raises(error):
            await move
        assert bench.controller.state.mode is Mode.FAULT
        assert [type(event) for event in bench.controller.events.since(seen) if event.code] == [kind]
        with pytest.raises(Faulted):
            await bench.controller.move(FAR)
        await heal(bench)
        await elapse(0.1)
        rest = bench.mechanics.true_joints()
        await bench.controller.recover()
        assert bench.controller.state.mode in {Mode.IDLE, Mode.NOT_HOMED}
        assert all(bench.controller.state.motors_on)
        await elapse(60.0)
        assert bench.mechanics.true_joints() == pytest.approx(rest, abs=COUNT)


async def test_recover_is_refused_while_the_abort_input_lasts() -> None:
    async with homed(live=True) as bench:
        await press_abort(bench)
        await elapse(1.0)
        assert bench.controller.state.mode is Mode.FAULT
        with pytest.raises(AbortInput):
            await bench.controller.recover()
        assert bench.controller.state.mode is Mode.FAULT


async def test_a_motor_switched_off_at_rest_is_noticed() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "MOC")
        await elapse(1.0)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == MotorOff.code


async def test_nothing_to_recover_from() -> None:
    async with rig() as bench:
        with pytest.raises(NothingToRecover):
            await bench.controller.recover()


async def test_a_foreign_stop_ends_the_motion_as_a_stop() -> None:
    async with homed(live=False) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "ST S")
        with pytest.raises(Stopped):
            await move
        assert bench.controller.state.mode is Mode.IDLE


async def test_abort_stops_at_once_and_waits_for_a_person() -> None:
    async with homed(live=False) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await bench.controller.abort()
        with pytest.raises(Stopped):
            await move
        assert bench.controller.state.mode is Mode.FAULT
        await bench.controller.recover()
        assert bench.controller.state.homed


@asynccontextmanager
async def second_controller(bench: Rig) -> AsyncIterator[GalilController]:
    """Open another controller on the same machine, as after a restart of ours."""

    async def dial() -> Transport:
        return bench.virtual.loopback()

    controller = GalilController(dial, "twin", bench.controller.config, live=False)
    await controller.open()
    try:
        yield controller
    finally:
        await controller.close()


async def test_restart_may_skip_homing_with_a_valid_mark() -> None:
    async with after_homing() as bench, second_controller(bench) as again:
        with pytest.raises(NotHomed):
            await again.move(FAR)
        await again.skip_home()
        await again.move(FAR)
        assert again.workspace.line_c == pytest.approx(bench.controller.workspace.line_c, abs=COUNT)


@pytest.mark.parametrize("burn", [False, True])
async def test_reset_loses_even_a_burned_mark(burn: bool) -> None:
    async with after_homing() as bench:
        if burn:
            await foreign(bench, "BV", "BN")
        await foreign(bench, "RS")
        async with second_controller(bench) as again:
            with pytest.raises(MarkerMissing):
                await again.skip_home()
            with pytest.raises(NotHomed):
                await again.move(FAR)


async def test_a_reset_under_our_feet_is_named() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "RS")
        await elapse(10.0)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == ControllerReset.code
        await bench.controller.recover()
        assert bench.controller.state.mode is Mode.NOT_HOMED


async def test_places_at_a_short_end_are_reached_without_tripping_its_switch() -> None:
    async with after_homing() as bench:
        for target in (Joints(0.0, 1.5, 1.3), Joints(0.0, 0.575, 1.9), Joints(0.0, 1.9, 0.565)):
            await bench.controller.move(target)
            assert not any(bench.controller.state.reverse_limit)
            await bench.controller.jog("a", 0.01)


async def test_second_cancel_still_waits_for_rest() -> None:
    async with homed(live=False) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        move.cancel()
        await elapse(0.05)
        move.cancel()
        await asyncio.wait({move})
        assert move.cancelled()
        assert not bench.controller.state.moving
        await bench.controller.move(FAR)
