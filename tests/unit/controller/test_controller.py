from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from math import inf, nan
from typing import Literal

import pytest

from dmc41x3.driver import Driver
from dmc41x3.wire.transport import Transport
from maya_un.config.files import parse
from maya_un.controller.controller import GalilController
from maya_un.controller.seek import SETTLE
from maya_un.errors import (
    AbortInput,
    Busy,
    CommandRejected,
    ConnectFailed,
    EndNotReached,
    Faulted,
    InvalidValue,
    LimitReached,
    LinkLost,
    MarkerMissing,
    MayaError,
    MotorOff,
    NothingToRecover,
    NotHomed,
    PathRefused,
    PositionChanged,
    Stopped,
    SwitchBlocks,
    TrajectoryRefused,
    UnknownName,
    Unreachable,
)
from maya_un.events import (
    Connected,
    FaultCleared,
    GripperClosed,
    GripperOpened,
    HomingNeeded,
    MotionBegun,
    MotionEnded,
    MotionStopped,
    OutputCleared,
    OutputSet,
)
from maya_un.testing import Rig, faults, rig
from maya_un.values import Joints, Mode
from tests.unit.controller.bench import FAR, HERE, commands_in, foreign, homed, kinds, now, still_moving, when_sent
from tests.virtual_time import elapse

Act = Callable[[GalilController], Awaitable[None]]

ABOVE = Joints(0.3, 1.0, 1.001)
"""The lines would be straight there."""


def command(name: str, *arguments: object, **options: object) -> Act:
    def act(controller: GalilController) -> Awaitable[None]:
        return getattr(controller, name)(*arguments, **options)

    return act


REFUSED: list[tuple[Act, type[MayaError]]] = [
    (command("move", ABOVE), Unreachable),
    (command("move", Joints(0.3, 0.4, 1.9)), Unreachable),
    (command("move", Joints(-0.1, 1.5, 1.3)), Unreachable),
    (command("move", Joints(nan, 1.5, 1.3)), InvalidValue),
    (command("move", Joints(0.3, inf, 1.3)), InvalidValue),
    (command("move", FAR, speed=0.0), InvalidValue),
    (command("move", FAR, speed=-0.5), InvalidValue),
    (command("move", FAR, speed=1.2e-223), InvalidValue),
    (command("move", FAR, speed=0.00099), InvalidValue),
    (command("move", FAR, speed=1.0001), InvalidValue),
    (command("move", FAR, speed=nan), InvalidValue),
    (command("follow", []), TrajectoryRefused),
    (command("follow", [HERE]), TrajectoryRefused),
    (command("follow", [FAR, HERE]), TrajectoryRefused),
    (command("follow", [HERE._replace(b=1.5002), FAR]), TrajectoryRefused),
    (command("follow", [Joints(nan, nan, nan), FAR]), InvalidValue),
    (command("follow", [HERE, FAR, Joints(0.3, nan, 1.3)]), InvalidValue),
    (command("follow", [HERE, FAR, ABOVE]), Unreachable),
    (command("follow", [HERE] * 512), TrajectoryRefused),
    (command("follow", [HERE, FAR, HERE] + [HERE, FAR] * 20), TrajectoryRefused),
    (command("follow", [HERE, FAR], speed=2.0), InvalidValue),
    (command("jog", "d", 0.1), UnknownName),
    (command("jog", "A", 0.1), UnknownName),
    (command("jog", "a", -0.5), Unreachable),
    (command("jog", "b", nan), InvalidValue),
    (command("jog", "b", 0.01, speed=0.0), InvalidValue),
    (command("recover"), NothingToRecover),
]


@pytest.mark.parametrize(("act", "error"), REFUSED)
async def test_refused_command_sends_nothing_and_disturbs_nothing(act: Act, error: type[MayaError]) -> None:
    async with homed() as bench:
        sent, seen = len(bench.sent), len(bench.controller.events)
        with pytest.raises(error):
            await act(bench.controller)
        assert len(bench.sent) == sent
        assert len(bench.controller.events) == seen
        assert bench.controller.state.mode is Mode.IDLE
        await bench.controller.jog("a", 0.01)


@pytest.mark.parametrize("act", [command("move", FAR), command("follow", [HERE, FAR]), command("jog", "a", 0.1)])
async def test_before_homing_nothing_moves(act: Act) -> None:
    async with rig() as bench:
        sent = len(bench.sent)
        with pytest.raises(NotHomed):
            await act(bench.controller)
        assert len(bench.sent) == sent


@pytest.mark.parametrize(
    "act",
    [
        command("move", FAR),
        command("follow", [HERE, FAR]),
        command("jog", "a", 0.1),
        command("home"),
        command("gripper", True),
        command("skip_home"),
    ],
)
async def test_in_a_fault_nothing_moves(act: Act) -> None:
    async with homed() as bench:
        await bench.controller.abort()
        sent = len(bench.sent)
        with pytest.raises(Faulted):
            await act(bench.controller)
        assert len(bench.sent) == sent


@pytest.mark.parametrize("first", [command("move", FAR), command("home"), command("gripper", True)])
@pytest.mark.parametrize(
    "second",
    [command("move", FAR), command("jog", "a", 0.1), command("home"), command("gripper", False), command("skip_home")],
)
async def test_second_command_is_refused_while_one_runs(first: Act, second: Act) -> None:
    async with homed() as bench:
        running = asyncio.ensure_future(first(bench.controller))
        await elapse(0.2)
        sent = len(bench.sent)
        with pytest.raises(Busy):
            await second(bench.controller)
        assert len(bench.sent) == sent
        await bench.controller.stop()
        await asyncio.wait({running})
        assert isinstance(running.exception(), Stopped)


async def test_skip_home_needs_a_mark() -> None:
    async with rig() as bench:
        with pytest.raises(MarkerMissing):
            await bench.controller.skip_home()
        assert bench.controller.state.mode is Mode.NOT_HOMED


async def test_skip_home_needs_a_place_inside_the_workspace() -> None:
    async with rig() as bench:
        await foreign(bench, "DP 0,684000,1320000", "mayaendb=2260000", "mayaendc=2300000", "ZAA=7", "mayahome=7")
        with pytest.raises(MarkerMissing):
            await bench.controller.skip_home()
        assert not bench.controller.state.homed


async def test_skip_home_takes_nothing_over_from_a_machine_that_moves() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        async with second(bench) as other:
            with pytest.raises(Busy):
                await other.skip_home()
        await move


async def test_registers_left_alone_because_axes_moved_are_written_before_the_first_motion() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "ERB=12345")
        async with second(bench) as other:
            assert await foreign(bench, "MG _ERB") == ["12345.0000"]
            await move
            await other.skip_home()
            assert await foreign(bench, "MG _ERB") == ["8000.0000"]


class second:  # noqa: N801 - used as a context
    """Another controller on the same machine, as after a restart of ours."""

    def __init__(self, bench: Rig) -> None:
        async def dial() -> Transport:
            return bench.virtual.loopback()

        self._controller = GalilController(dial, "twin", bench.controller.config, live=False)

    async def __aenter__(self) -> GalilController:
        await self._controller.open()
        return self._controller

    async def __aexit__(self, *_: object) -> None:
        await self._controller.close()


async def test_opening_names_the_owner() -> None:
    async with rig() as bench:
        assert kinds(bench) == [Connected, HomingNeeded]
        assert bench.controller.events.since(0)[0].detail == {"address": "twin", "firmware": "DMC4133 Rev 1.3k"}
        assert (bench.controller.address, bench.controller.firmware) == ("twin", "DMC4133 Rev 1.3k")


async def test_controller_that_failed_to_open_can_be_closed() -> None:
    async def dial() -> Transport:
        raise ConnectFailed(address="box", reason="refused")

    controller = GalilController(dial, "box", parse({}), live=True)
    with pytest.raises(ConnectFailed):
        await controller.open()
    assert controller.state.mode is Mode.DISCONNECTED
    await controller.close()


@pytest.mark.parametrize("speed", [1.0, 0.5, 0.1])
async def test_move_takes_the_time_and_ends_at_the_point_of_its_preview(speed: float) -> None:
    async with homed() as bench:
        controller = bench.controller
        here = controller.state.joints
        assert here is not None
        sent = len(bench.sent)
        preview = controller.preview([here, FAR], speed=speed)
        assert len(bench.sent) == sent
        began = now()
        await controller.move(FAR, speed=speed)
        assert now() - began == pytest.approx(preview.duration, abs=0.02)
        assert controller.state.joints == pytest.approx(preview.end, abs=2e-6)
        assert preview.end == pytest.approx(FAR, abs=5e-5)
        assert kinds(bench)[-2:] == [MotionBegun, MotionEnded]
        assert bench.mechanics.record.lowest >= preview.lowest - 1e-4


async def test_move_to_the_current_position_sends_no_motion() -> None:
    async with homed() as bench:
        seen = len(bench.controller.events)
        del bench.sent[:]
        await bench.controller.move(HERE)
        assert commands_in(bytes(bench.sent)) == ["QR"]
        assert kinds(bench, seen) == []
        assert bench.controller.preview([HERE, HERE]).duration == 0.0


async def test_a_line_between_two_places_may_leave_the_workspace() -> None:
    async with homed() as bench:
        await bench.controller.move(Joints(0.3, 0.60, 1.4095))
        sent = len(bench.sent)
        with pytest.raises(PathRefused):
            await bench.controller.move(Joints(0.3, 1.4095, 0.60))
        assert len(bench.sent) == sent


async def test_follow_goes_through_its_points() -> None:
    async with homed() as bench:
        path = [HERE._replace(b=1.50008), Joints(0.4, 1.4, 1.4), Joints(0.4, 1.4, 1.6), Joints(0.3, 1.5, 1.5)]
        corner = 0.0
        follow = asyncio.create_task(bench.controller.follow(path))
        while not follow.done():
            await elapse(0.1)
            bench.virtual.sync()
            _, b, c = bench.mechanics.true_joints()
            corner = max(corner, 1.4 - abs(b - 1.4) - abs(c - 1.4))
        await follow
        assert corner == pytest.approx(1.4, abs=0.005)
        assert bench.controller.state.joints == pytest.approx(path[-1], abs=5e-5)


@pytest.mark.parametrize(("axis", "distance"), [("a", 0.2), ("b", -0.05), ("c", 0.1)])
async def test_a_jog_moves_one_axis_by_its_distance(axis: str, distance: float) -> None:
    async with homed() as bench:
        before = bench.controller.state.joints
        await bench.controller.jog(axis, distance)
        after = bench.controller.state.joints
        assert before is not None
        assert after is not None
        ways = [there - here for here, there in zip(before, after, strict=True)]
        wanted = [distance if name == axis else 0.0 for name in "abc"]
        assert ways == pytest.approx(wanted, abs=5e-5)


@pytest.mark.parametrize(
    ("closed_by", "output", "opening", "closing"),
    [("clear", 1, "SB 1", "CB 1"), ("set", 1, "CB 1", "SB 1"), ("set", 4, "CB 4", "SB 4")],
)
async def test_the_gripper_is_wired_as_configured(closed_by: str, output: int, opening: str, closing: str) -> None:
    config = parse({"gripper": {"closed_by": closed_by, "output": output, "settle_time": 0.8}})
    async with rig(config) as bench:
        for open_, command, kind in ((True, opening, GripperOpened), (False, closing, GripperClosed)):
            del bench.sent[:]
            began = now()
            await bench.controller.gripper(open_)
            assert commands_in(bytes(bench.sent)) == [command, "QR"]
            assert now() - began == pytest.approx(0.8)
            assert bench.controller.state.gripper_closed is not open_
            assert kinds(bench)[-1] is kind


async def test_an_output_of_the_configuration_is_switched() -> None:
    config = parse({"controller": {"outputs": [2, 8]}})
    async with rig(config) as bench:
        for on, command, kind in ((True, "SB 8", OutputSet), (False, "CB 8", OutputCleared)):
            del bench.sent[:]
            await bench.controller.output(8, on=on)
            assert commands_in(bytes(bench.sent)) == [command, "QR"]
            assert kinds(bench)[-1] is kind


@pytest.mark.parametrize("number", [1, 3, 0, 9, -1])
async def test_no_other_output_is_switched(number: int) -> None:
    async with rig(parse({"controller": {"outputs": [2]}})) as bench:
        del bench.sent[:]
        with pytest.raises(InvalidValue, match=r"controller\.outputs"):
            await bench.controller.output(number, on=True)
        assert not bench.sent


async def test_a_motor_that_is_off_is_named_when_a_motion_cannot_begin() -> None:
    async with homed() as bench:
        await foreign(bench, "MOC")
        with pytest.raises(MotorOff) as failure:
            await bench.controller.move(FAR)
        assert failure.value.details == {"axis": "c"}
        assert bench.controller.state.mode is Mode.FAULT
        await bench.controller.recover()
        await bench.controller.jog("a", 0.01)


async def test_a_motion_that_the_controller_refuses_is_a_fault() -> None:
    async with homed() as bench:
        machine = bench.virtual.machine
        handle = machine.connect()
        assert handle is not None
        when_sent(bench, "BGS", lambda: machine.receive(handle, b"CS S\r", machine.now))
        with pytest.raises(CommandRejected) as failure:
            await bench.controller.move(FAR)
        assert (failure.value.details["command"], failure.value.details["tc"]) == ("BGS", 24)
        assert bench.controller.state.mode is Mode.FAULT


@pytest.mark.parametrize(("axis", "side"), [("B", "reverse"), ("C", "forward")])
async def test_move_towards_a_stuck_switch_names_the_switch(axis: str, side: Literal["forward", "reverse"]) -> None:
    async with homed(live=True) as bench:
        with faults.stuck_limit(bench.virtual, axis, side), pytest.raises(SwitchBlocks) as failure:
            await bench.controller.move(FAR)
        assert failure.value.details == {"axis": axis.lower(), "side": side}
        await bench.controller.recover()
        await bench.controller.move(FAR)


async def test_slowed_motion_takes_longer() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "VR 0.5")
        with pytest.raises(EndNotReached):
            await move
        assert (bench.controller.state.mode, bench.controller.state.moving) == (Mode.FAULT, False)


async def test_a_motion_that_begins_late_ends_late(monkeypatch: pytest.MonkeyPatch) -> None:
    send = Driver.send

    async def sent(driver: Driver, command: str) -> str:
        await elapse(5.0 if command == "BGS" else 0.0)
        return await send(driver, command)

    monkeypatch.setattr(Driver, "send", sent)
    async with homed() as bench:
        await bench.controller.move(FAR)
        assert bench.controller.state.mode is Mode.IDLE


async def test_a_place_that_is_not_the_commanded_one_is_a_fault() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(bench.controller.preview([HERE, FAR]).duration - SETTLE / 2)
        await foreign(bench, f"DPB={round(FAR.b * 1e6) + 3}")
        with pytest.raises(PositionChanged) as failure:
            await move
        assert failure.value.details == {"axis": "b", "distance": "0.00 mm"}
        assert not bench.controller.state.homed


async def test_after_a_limit_only_homing_helps() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await foreign(bench, "CN 1")
        with pytest.raises(LimitReached):
            await move
        await bench.controller.recover()
        assert kinds(bench)[-2:] == [FaultCleared, HomingNeeded]
        assert await foreign(bench, "MG mayahome", "MG _ZAA", "MG _CN0") == ["0.0000", "0.0000", "-1.0000"]
        with pytest.raises(MarkerMissing):
            await bench.controller.skip_home()


async def test_recover_waits_for_axes_that_are_still_moving() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        bench.virtual.cut()
        with pytest.raises(LinkLost):
            await move
        await elapse(2.0)
        with pytest.raises(Busy):
            await bench.controller.recover()
        assert bench.controller.state.mode is Mode.FAULT
        await elapse(still_moving(bench))
        await bench.controller.recover()
        assert bench.controller.state.joints == pytest.approx(FAR, abs=5e-5)


async def test_closing_in_motion_brakes_and_reports_the_stop() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        await bench.controller.close()
        await elapse(2.0)
        assert still_moving(bench) == 0.0
        assert bench.mechanics.true_joints() != pytest.approx(FAR, abs=1e-2)
        await asyncio.wait({move})
        assert isinstance(move.exception(), Stopped)


async def test_the_end_of_a_move_that_was_cancelled_is_at_rest() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        move.cancel()
        await asyncio.wait({move})
        assert move.cancelled()
        assert still_moving(bench) == 0.0
        assert (bench.controller.state.mode, bench.controller.state.moving) == (Mode.IDLE, False)
        assert kinds(bench)[-1] is MotionStopped
        await bench.controller.jog("a", 0.01)


@pytest.mark.parametrize("later", [0.0, 0.02, 0.05])
async def test_cancelling_a_move_while_its_stop_brakes_reports_the_stop(later: float) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        before = len(bench.controller.events)
        assert (await bench.controller.stop()).was_moving
        await elapse(later)
        move.cancel()
        await asyncio.wait({move})
        assert move.cancelled()
        assert still_moving(bench) == 0.0
        assert kinds(bench, before) == [MotionStopped]
        await bench.controller.jog("a", 0.01)


async def test_move_cancelled_twice_is_reported() -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        move.cancel()
        await elapse(0.02)
        move.cancel()
        await asyncio.wait({move})
        assert still_moving(bench) == 0.0
        assert kinds(bench)[-1] is MotionStopped


async def test_fault_of_a_move_cancelled_while_braking_is_a_fault() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(8.0)
        when_sent(bench, "ST S", move.cancel)
        bench.virtual.abort_input(True)
        await asyncio.wait({move})
        assert move.cancelled()
        assert still_moving(bench) == 0.0
        fault = bench.controller.state.fault
        assert fault is not None
        assert fault.code == AbortInput.code
        assert AbortInput.code in [event.code for event in bench.controller.events.since(0)]


@pytest.mark.parametrize("at", ["CS S", "LE", "BGS"])
async def test_a_cancel_while_a_move_is_sent_leaves_nothing_moving(at: str) -> None:
    async with homed() as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        when_sent(bench, at, move.cancel)
        await asyncio.wait({move})
        assert move.cancelled()
        assert bench.controller.state.joints == pytest.approx(HERE, abs=1e-4)
        await elapse(10.0)
        assert bench.mechanics.true_joints() == pytest.approx(HERE, abs=1e-4)
