from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest

from maya_un.config.files import parse
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    Faulted,
    FollowingError,
    InternalError,
    MachineError,
    MotorOff,
    NotHomed,
    PositionChanged,
    RegisterChanged,
)
from maya_un.testing import Rig, rig
from maya_un.values import Mode
from tests.unit.controller.bench import FAR, HERE, OWN, commands_in, far_away, foreign, homed, kinds, when_sent
from tests.virtual_time import elapse


@pytest.mark.parametrize("rate", [5.0, 50.0])
async def test_the_record_is_read_at_the_configured_rate(rate: float) -> None:
    async with rig(parse({"controller": {"stream_rate": rate}}), live=True) as bench:
        del bench.sent[:]
        await elapse(10.0)
        assert bench.sent.count(b"QR") == pytest.approx(10 * rate, abs=1)
        assert {command for command in commands_in(bytes(bench.sent)) if not command.startswith(OWN)} == {"QR"}


async def test_without_a_stream_nothing_is_polled_at_rest() -> None:
    async with rig() as bench:
        del bench.sent[:]
        await elapse(1000.0)
        assert bench.sent == b""


async def unplug(bench: Rig) -> None:
    await foreign(bench, "MOB")


async def burn(bench: Rig) -> None:
    bench.virtual.amplifier_fault(0x04000000)


async def press(bench: Rig) -> None:
    bench.virtual.abort_input(True)


@pytest.mark.parametrize(("cause", "error"), [(unplug, MotorOff), (burn, AmplifierFault), (press, AbortInput)])
async def test_cause_of_motors_off_at_rest_is_named(
    cause: Callable[[Rig], Awaitable[None]], error: type[MachineError]
) -> None:
    async with homed(live=True) as bench:
        await cause(bench)
        await elapse(0.2)
        assert type(bench.controller._monitor.fault) is error
        with pytest.raises(Faulted):
            await bench.controller.move(FAR)


async def test_the_first_cause_stays() -> None:
    async with homed(live=True) as bench:
        await press(bench)
        await elapse(0.2)
        seen = len(bench.controller.events)
        await burn(bench)
        await unplug(bench)
        await elapse(1.0)
        assert type(bench.controller._monitor.fault) is AbortInput
        assert kinds(bench, seen) == []


async def test_motors_that_were_never_switched_on_are_no_fault() -> None:
    async with rig(live=True) as bench:
        await elapse(1.0)
        assert bench.controller.state.motors_on == (False, False, False)
        assert bench.controller.state.mode is Mode.NOT_HOMED
        with pytest.raises(NotHomed):
            await bench.controller.move(FAR)


async def test_stop_codes_of_an_earlier_fault_do_not_end_the_next_move() -> None:
    async with far_away(latency=0.004, rate=50.0) as bench:
        for wait in range(20):
            bench.virtual.abort_input(True)
            await elapse(0.1)
            bench.virtual.abort_input(False)
            await bench.controller.recover()
            await elapse(0.001 * wait)
            await bench.controller.move(HERE._replace(a=HERE.a + 0.001 * (wait % 2)))


async def test_motor_without_torque_in_motion_is_a_fault() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "TLC=0")  # the line stays where it is
        with pytest.raises((FollowingError, RegisterChanged)):
            await move


async def test_following_error_names_its_axis() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "ERC=5")
        with pytest.raises(FollowingError) as failure:
            await move
        assert failure.value.details == {"axis": "c"}


async def test_following_error_by_a_foreign_error_limit_names_the_register() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "ERC=5")
        with pytest.raises(RegisterChanged) as failure:
            await move
        assert failure.value.details == {"register": "ERC", "found": "5", "wanted": "8000"}


async def test_recover_after_a_defect_restarts_the_monitor(monkeypatch: pytest.MonkeyPatch) -> None:
    async with homed(live=True) as bench:
        fault_monitor = bench.controller._fault_monitor

        async def broken(_: object) -> None:
            raise ValueError("a defect")

        with monkeypatch.context() as patch:
            patch.setattr(fault_monitor, "_judge", broken)
            await elapse(0.5)
        assert fault_monitor._looking is not None
        assert isinstance(fault_monitor._looking.exception(), ValueError)
        await bench.controller.recover()
        await foreign(bench, "DPB=1000")
        await elapse(0.5)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == PositionChanged.code


async def test_a_fault_that_ends_a_pause_begins_no_motion_that_waited_in_it() -> None:
    async with homed(live=True) as bench:
        await bench.controller.pause(ahead=True)
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(1.0)
        bench.controller._monitor.enter_fault(InternalError(reason="a defect"))
        with pytest.raises(Faulted):
            await move
        await elapse(1.0)
        assert b"BGS" not in bench.sent.replace(b"_BGS", b"")
        assert await foreign(bench, "MG _TLB,_TLC,mayamove") == ["0.1248 0.1248 0.0000"]


def configuring(bench: Rig) -> asyncio.Task[None]:
    """Begin a homing, which writes and reads all registers before it begins."""
    return asyncio.create_task(bench.controller.home())


@pytest.mark.parametrize("at", ["VF 10.4", "MG3,", "MG9,"])
async def test_registers_are_checked_after_a_cancel_while_they_were_written(at: str) -> None:
    async with homed(live=True) as bench:
        await elapse(0.5)
        home = configuring(bench)
        when_sent(bench, at, home.cancel)
        await asyncio.wait({home})
        assert home.cancelled()
        assert bench.controller.state.homed
        await foreign(bench, "ERB=2000000", "OEB=0", "LDB=3")
        with pytest.raises((RegisterChanged, Faulted)):
            await bench.controller.move(FAR)
        assert bench.controller.state.mode is Mode.FAULT


async def test_registers_are_checked_after_a_link_that_was_lost_while_they_were_written() -> None:
    async with homed(live=True) as bench:
        await elapse(0.5)
        home = configuring(bench)
        when_sent(bench, "VF 10.4", bench.virtual.cut)
        await asyncio.wait({home})
        assert isinstance(home.exception(), MachineError)
        assert not bench.controller._monitor.registers.known
        await elapse(5.0)
        await bench.controller.recover()
        await foreign(bench, "ERB=2000000")
        with pytest.raises((RegisterChanged, Faulted)):
            await bench.controller.move(FAR)


async def test_no_motion_begins_without_values_to_compare_registers_with() -> None:
    async with homed(live=True) as bench:
        bench.controller._monitor.registers.forget()
        with pytest.raises(InternalError):
            await bench.controller.move(FAR)
        assert "BGS" not in commands_in(bytes(bench.sent))
        await bench.controller.recover()
        await bench.controller.move(HERE._replace(a=HERE.a + 0.01))
