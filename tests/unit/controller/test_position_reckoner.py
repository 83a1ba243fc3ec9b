from __future__ import annotations

import asyncio

import numpy as np
import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus, DataRecord
from maya_un.config import Config
from maya_un.controller.monitor import SETTLED, PositionReckoner
from maya_un.errors import Faulted, ForeignMotion, MachineError, NotHomed, PositionChanged, PositionNotKept
from maya_un.events import FaultEntered
from maya_un.motion.polyline import Polyline
from maya_un.testing import faults
from maya_un.values import Mode
from tests.calm import SELDOM_BEATING
from tests.unit.controller.bench import FAR, HERE, foreign, homed, kinds, record_of
from tests.virtual_time import elapse

STILL = AxisRecord(reference=1_000, position=1_000)


def records(*axes: AxisRecord) -> MachineError | None:
    """Return what is found in the second of two records, which differ in axis b."""
    reckoning = PositionReckoner(Config(), (0, 1, 2))
    found: MachineError | None = None
    for axis in axes:
        found = reckoning.compare(_with(axis))
    return found


def _with(axis: AxisRecord) -> DataRecord:
    return record_of(STILL, axis, STILL)


def test_axes_that_stay_are_ours() -> None:
    assert records(STILL, STILL, STILL) is None


@pytest.mark.parametrize("by", [-5_000, -1, 1, 3_000])
def test_reference_that_changes_at_rest_is_found(by: int) -> None:
    found = records(STILL, AxisRecord(reference=1_000 + by, position=1_000 + by))
    if abs(by) > SETTLED:
        assert isinstance(found, PositionChanged)
        assert found.details == {"axis": "b", "distance": f"{abs(by) / 1000.0:.2f} mm"}
    else:
        assert found is None  # SH may do that


def test_servo_on_resets_the_reference_without_a_finding() -> None:
    pushed = AxisRecord(status=AxisStatus.MOTOR_OFF, reference=1_000, position=9_000)
    assert records(STILL, pushed, AxisRecord(reference=9_000, position=9_000)) is None


def test_position_defined_with_the_motor_off_is_found() -> None:
    off = AxisRecord(status=AxisStatus.MOTOR_OFF, reference=1_000, position=1_000)
    defined = AxisRecord(status=AxisStatus.MOTOR_OFF, reference=7_000, position=7_000)
    assert isinstance(records(off, defined), PositionChanged)


def test_axis_that_is_pushed_from_its_reference_is_found() -> None:
    assert isinstance(records(STILL, AxisRecord(reference=1_000, position=3_001)), PositionChanged)
    assert records(STILL, AxisRecord(reference=1_000, position=2_900)) is None


def test_moving_axis_is_found_unless_it_moved_from_the_start() -> None:
    moving = AxisRecord(status=AxisStatus.MOVING, reference=1_010, position=1_000)
    assert isinstance(records(STILL, moving), ForeignMotion)
    assert records(moving, moving, STILL) is None


def test_reference_off_its_path_is_found() -> None:
    reckoning = PositionReckoner(Config(), (0, 1, 2))
    path = Polyline(np.array([[0.0, 0.0, 0.0], [0.0, 10_000.0, -10_000.0], [100.0, 20_000.0, -10_000.0]]))
    for here in ([0, 5_000, -5_000], [50, 15_000, -10_000], [100, 20_400, -10_000]):
        assert reckoning.astray(path, here) is None
    for here in ([0, 5_000, -7_000], [100, 20_600, -10_000], [120, 5_000, -5_000]):
        assert isinstance(reckoning.astray(path, here), PositionChanged)


async def test_position_defined_at_rest_makes_the_homing_void() -> None:
    async with homed(live=True) as bench:
        seen = len(bench.controller.events)
        await foreign(bench, "DPB=1400000")
        await elapse(0.2)
        assert bench.controller.state.mode is Mode.FAULT
        assert not bench.controller.state.homed
        assert [event.code for event in bench.controller.events.since(seen)] == [PositionChanged.code]
        with pytest.raises(Faulted):
            await bench.controller.move(FAR)
        await bench.controller.recover()
        with pytest.raises(NotHomed):
            await bench.controller.move(FAR)
        assert await foreign(bench, "MG mayahome") == ["0.0000"]


async def test_position_redefined_at_rest_is_found_before_the_next_motion() -> None:
    async with homed() as bench:
        await foreign(bench, "DPB=1400000")
        with pytest.raises(PositionChanged):
            await bench.controller.move(FAR)
        assert kinds(bench)[-1] is FaultEntered


async def test_position_defined_in_a_fault_makes_the_homing_void() -> None:
    async with homed(live=True) as bench:
        await foreign(bench, "MOB")
        await elapse(0.2)
        await foreign(bench, "DPC=1400000")
        await elapse(0.2)
        await bench.controller.recover()
        assert not bench.controller.state.homed


async def test_position_defined_while_the_link_is_lost_makes_the_homing_void() -> None:
    async with homed(live=True) as bench:
        with faults.cut(bench.virtual):
            machine = bench.virtual.machine
            await elapse(1.0)
            handle = machine.connect()
            assert handle is not None
            machine.receive(handle, b"DPC=1400000\r", machine.now)
        await elapse(5.0)
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == PositionChanged.code
        await bench.controller.recover()
        assert not bench.controller.state.homed


async def test_foreign_motion_is_stopped_and_the_robot_can_be_homed_again() -> None:
    async with homed(SELDOM_BEATING, live=True) as bench:
        await foreign(bench, "JGA=1000", "BGA")
        await elapse(0.5)
        assert not bench.controller.state.moving
        assert bench.controller.state.fault is not None
        assert bench.controller.state.fault.code == ForeignMotion.code
        await bench.controller.recover()
        await bench.controller.home()
        assert bench.controller.state.homed


async def test_line_that_another_program_moves_at_rest_stays_and_can_be_homed_again() -> None:
    async with homed(SELDOM_BEATING, live=True) as bench:
        before = bench.mechanics.true_joints()
        await foreign(bench, "JGB=-45000", "BGB")
        await elapse(2.0)
        assert bench.mechanics.true_joints() == pytest.approx(before, abs=2e-6)
        assert bench.mechanics.record.stall_time == 0.0
        await bench.controller.recover()
        await bench.controller.home()
        assert bench.controller.state.homed


async def test_skip_home_is_refused_when_the_axes_were_moved_meanwhile() -> None:
    async with homed(live=True) as bench:
        await bench.controller.move(HERE._replace(a=0.4))
        await bench.controller.skip_home()
        bench.controller._monitor.homed = False  # as another program of ours would find it
        await foreign(bench, "DPC=1310000")
        await elapse(0.2)
        with pytest.raises(PositionNotKept) as refused:
            await bench.controller.skip_home()
        assert refused.value.details == {"axis": "c", "distance": "10.00 mm"}


async def test_a_stopped_motion_leaves_its_place_in_the_controller() -> None:
    async with homed(live=True) as bench:
        move = asyncio.create_task(bench.controller.move(FAR))
        await elapse(5.0)
        assert await foreign(bench, "MG mayamove") == ["1.0000"]
        await bench.controller.stop()
        await asyncio.wait({move})
        assert move.exception() is not None
        a, b, c = bench.controller._monitor.standing()
        answers = await foreign(bench, "MG mayamove,mayaata-_RPA,mayaatb-_RPB,mayaatc-_RPC", "MG _RPA,_RPB,_RPC")
        assert answers[0] == "0.0000 0.0000 0.0000 0.0000"
        assert [float(word) for word in answers[1].split()] == [a, b, c]
