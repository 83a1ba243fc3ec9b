from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest

from dmc41x3.language.record import AxisRecord, AxisStatus, AxisSwitches
from maya_un.config import Config, Units
from maya_un.config.files import parse
from maya_un.controller import state_builder
from maya_un.controller.state_builder import ControllerStatus, StateBuilder
from maya_un.errors import FollowingError, MayaError
from maya_un.kinematics.closed import tension
from maya_un.kinematics.mechanism import Mechanism
from maya_un.values import Joints, Mode, Progress
from tests.unit.controller.bench import record_of

HERE = Joints(0.3, 1.5, 1.3)
PERMUTED = parse({"axes": {"a": {"letter": "B"}, "b": {"letter": "C"}, "c": {"letter": "A"}}})


def state_builder_of(config: Config) -> StateBuilder:
    return StateBuilder(config, Units.of(config), Mechanism.of(config), state_builder.indices(config))


def standing(*, homed: bool = True, fault: MayaError | None = None) -> ControllerStatus:
    return ControllerStatus(12.5, Mode.IDLE, homed, Progress("move", 1.0, 4.0), fault)


def at(joints: Joints) -> list[AxisRecord]:
    return [AxisRecord(position=counts) for counts in Units.of(Config()).to_counts(joints)]


def test_homed_robot_is_at_the_position_of_its_encoders() -> None:
    state = state_builder_of(Config()).state(record_of(*at(HERE)), standing())
    assert state.joints == pytest.approx(HERE, abs=5e-5)
    assert state.point is not None
    assert state.point == pytest.approx(Mechanism.of(Config()).fk(HERE), abs=2e-4)
    assert state.counts == Units.of(Config()).to_counts(HERE)
    assert (state.time, state.mode, state.homed, state.progress) == (12.5, Mode.IDLE, True, Progress("move", 1.0, 4.0))


def test_before_homing_there_are_counts_and_no_lengths() -> None:
    state = state_builder_of(Config()).state(record_of(*at(HERE)), standing(homed=False))
    assert (state.joints, state.point, state.homed) == (None, None, False)
    assert state.counts == Units.of(Config()).to_counts(HERE)


def test_lines_that_cannot_meet_have_no_gripper_point() -> None:
    state = state_builder_of(Config()).state(record_of(*at(Joints(0.3, 0.6, 0.6))), standing())
    assert state.joints is not None
    assert state.point is None


@pytest.mark.parametrize(
    ("config", "place"), [(Config(), (0, 1, 2)), (PERMUTED, (1, 2, 0))], ids=["as ever", "permuted"]
)
def test_every_value_is_of_the_axis_it_is_named_for(config: Config, place: tuple[int, int, int]) -> None:
    axes = [AxisRecord()] * 3
    axes[place[0]] = AxisRecord(position=1, stop_code=11, velocity_raw=round(64 * 371.06), status=AxisStatus.MOTOR_OFF)
    axes[place[1]] = AxisRecord(position=2, stop_code=12, velocity_raw=-64 * 45_000, status=AxisStatus.MOVING)
    axes[place[2]] = AxisRecord(position=3, stop_code=13, switches=AxisSwitches.FORWARD_INACTIVE)
    state = state_builder_of(config).state(record_of(*axes), standing())
    assert state.counts == (1, 2, 3)
    assert state.stop_code == (11, 12, 13)
    assert state.velocity == pytest.approx((pi / 180, -0.045, 0.0), rel=1e-3)
    assert state.motors_on == (False, True, True)
    assert state.moving
    assert state.forward_limit == (False, False, False)
    assert state.reverse_limit == (False, False, True)


@pytest.mark.parametrize(
    ("closed_by", "output", "outputs", "closed"),
    [
        ("clear", 1, 0b0000_0000, True),
        ("clear", 1, 0b0000_0001, False),
        ("set", 1, 0b0000_0001, True),
        ("set", 1, 0b1111_1110, False),
        ("set", 8, 0b1000_0000, True),
        ("clear", 3, 0b1111_1011, True),
    ],
)
def test_the_gripper_is_known_by_its_bit(closed_by: str, output: int, outputs: int, closed: bool) -> None:
    config = parse({"gripper": {"closed_by": closed_by, "output": output}})
    state = state_builder_of(config).state(record_of(*at(HERE), outputs=outputs), standing())
    assert state.gripper_closed is closed


def test_fault_has_its_code_and_sentence() -> None:
    error = FollowingError(axis="c")
    state = state_builder_of(Config()).state(record_of(*at(HERE)), standing(fault=error))
    assert state.fault is not None
    assert (state.fault.code, state.fault.message) == (2302, str(error))


def test_before_the_first_record_nothing_is_claimed() -> None:
    state = state_builder_of(Config()).state(None, standing(fault=FollowingError(axis="c")))
    assert (state.homed, state.joints, state.point, state.moving) == (False, None, None, False)
    assert state.motors_on == (False, False, False)
    assert state.fault is not None
    assert (state.time, state.mode) == (12.5, Mode.IDLE)


def test_signals_are_those_of_the_axes_in_si_units() -> None:
    builder, units = state_builder_of(PERMUTED), Units.of(Config())
    counts = units.to_counts(HERE)
    ours = [AxisRecord(position=counts[i], error=10 * (i + 1), torque_raw=3276 * (i + 1)) for i in range(3)]
    record = replace(record_of(ours[2], ours[0], ours[1]), inputs=(0b101,) + (0,) * 9, outputs=(0b10,) + (0,) * 9)
    state = builder.state(record, standing())
    found = builder.signals(record, state)
    assert found.time == 12.5
    assert found.following_error == pytest.approx([10 * (i + 1) / units.per_unit[i] for i in range(3)])
    assert found.torque == pytest.approx((1.0, 2.0, 3.0), rel=1e-3)
    assert found.tension == pytest.approx(tension(*Mechanism.of(Config()).section(HERE), 2.0), abs=1e-3)
    assert found.inputs == (True, False, True, False, False, False, False, False)
    assert found.outputs == (False, True, False, False, False, False, False, False)
    assert builder.signals(record, builder.state(record, standing(homed=False))).tension is None


def test_lines_that_cannot_meet_have_no_tension() -> None:
    builder, record = state_builder_of(Config()), record_of(*at(Joints(0.3, 0.6, 0.6)))
    assert builder.signals(record, builder.state(record, standing())).tension is None
