"""The bench of servo motors: late by a law, and with sensors that can fail."""

from __future__ import annotations

from math import exp

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import LagModel, ServoBench
from dmc41x3.twin.timeline import TimelinePiece


def ramp(bench: ServoBench, axis: int = 0, speed: float = 1000.0) -> None:
    bench.power(axis, True)
    bench.timelines[axis].plan(0.0, (TimelinePiece(0.0, 0.0, speed, 0.0),))


def test_a_first_order_lag_is_the_exponential_it_should_be() -> None:
    bench = ServoBench(1, lag=0.1)
    ramp(bench)
    bench.advance(0.25)
    late = 1000.0 * 0.1 * (1.0 - exp(-2.5))
    assert bench.position(0) == pytest.approx(250.0 - late)
    assert bench.velocity(0) == pytest.approx(1000.0 * (1.0 - exp(-2.5)))
    assert bench.torque(0) == pytest.approx(bench.stiffness * late)


@given(st.lists(st.floats(1e-4, 0.2), min_size=1, max_size=12))
def test_time_of_reading_does_not_matter(pauses: list[float]) -> None:
    looked_at, left_alone = ServoBench(1, lag=0.05), ServoBench(1, lag=0.05)
    pieces = (
        TimelinePiece(0.0, 0.0, 0.0, 4000.0),
        TimelinePiece(0.25, 125.0, 1000.0, -4000.0),
        TimelinePiece(0.5, 250.0, 0.0, 0.0),
    )
    for bench in (looked_at, left_alone):
        bench.power(0, True)
        bench.timelines[0].plan(0.0, pieces)
    now = 0.0
    for pause in pauses:
        now += pause
        looked_at.advance(now)
    left_alone.advance(now)
    assert looked_at.position(0) == pytest.approx(left_alone.position(0), abs=1e-6)


def test_delay_returns_the_earlier_reference() -> None:
    bench = ServoBench(2, lag=(0.1, 0.0), law=LagModel.DELAY)
    ramp(bench)
    ramp(bench, 1)
    bench.advance(0.05)
    assert (bench.position(0), bench.velocity(0)) == (0.0, 0.0)
    bench.advance(0.35)
    assert (bench.position(0), bench.velocity(0)) == (pytest.approx(250.0), 1000.0)
    assert bench.position(1) == pytest.approx(350.0)


@pytest.mark.parametrize("lag", [(0.1,), (0.1, -0.1), ()])
def test_there_is_a_lag_for_each_axis_and_none_is_negative(lag: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="lag"):
        ServoBench(2, lag=lag)


def test_motor_that_is_off_stays_and_can_be_turned() -> None:
    bench = ServoBench(1)
    ramp(bench)
    bench.advance(1.0)
    bench.power(0, False)
    here = bench.position(0)
    bench.advance(2.0)
    assert (bench.position(0), bench.velocity(0), bench.torque(0)) == (here, 0.0, 0.0)
    bench.turn(0, 50.0)
    assert bench.position(0) == here + 50.0


def test_a_held_shaft_pushes_harder_and_is_looked_at_often() -> None:
    bench = ServoBench(1, lag=0.01)
    ramp(bench)
    bench.advance(1.0)
    bench.hold(0)
    bench.advance(1.5)
    assert bench.position(0) == pytest.approx(990.0)
    assert bench.torque(0) == pytest.approx(bench.stiffness * 510.0)
    assert bench.next_event(9.0) == pytest.approx(1.502)
    bench.release(0)
    bench.advance(2.0)
    assert bench.position(0) == pytest.approx(1990.0, abs=1e-3)
    assert bench.next_event(9.0) is None


def test_the_command_is_limited() -> None:
    bench = ServoBench(1)
    ramp(bench, speed=1e6)
    bench.hold(0)
    bench.advance(1.0)
    assert bench.torque(0) == 9.9982


def test_lost_encoder_stops_while_the_shaft_continues() -> None:
    bench = ServoBench(1, lag=0.0)
    ramp(bench)
    bench.advance(1.0)
    bench.fail_encoder(0, True)
    bench.advance(2.0)
    assert (bench.position(0), bench.velocity(0)) == (1000.0, 0.0)
    assert bench.true_position(0) == 2000.0
    assert bench.torque(0) == pytest.approx(bench.stiffness * 1000.0)
    bench.fail_encoder(0, False)
    bench.advance(3.0)
    assert bench.position(0) == 2000.0
    assert bench.true_position(0) == 3000.0


def test_switching_on_with_a_wrong_encoder_moves_nothing() -> None:
    bench = ServoBench(1, lag=0.0)
    ramp(bench)
    bench.advance(1.0)
    bench.fail_encoder(0, True)
    bench.advance(2.0)
    bench.power(0, False)
    bench.timelines[0].plan(2.0, (TimelinePiece(2.0, 1000.0, 0.0, 0.0),))
    bench.power(0, True)
    bench.advance(3.0)
    assert bench.true_position(0) == 2000.0


def test_inputs_can_be_set_and_forced() -> None:
    bench = ServoBench(2)
    bench.set_inputs(1, home=False)
    bench.force_inputs(1, forward=False)
    bench.force_inputs(1, home=True)
    assert bench.inputs(1) == (False, True, True)
    bench.force_inputs(1, forward=None)
    assert bench.inputs(1) == (True, True, True)
    bench.force_inputs(1, home=None)
    assert bench.inputs(1) == (True, True, False)
    assert bench.inputs(0) == (True, True, True)
    with pytest.raises(ValueError, match="index"):
        bench.force_inputs(1, index=True)


def test_the_twin_on_a_bench_has_an_error_while_it_moves_and_none_afterwards() -> None:
    machine = VirtualDmc(ServoBench(2, lag=0.01), axes=2, motors_off=False)
    handle = machine.connect()
    assert handle is not None
    machine.receive(handle, b"AC*=102400;DC*=102400;PRB=102400;SPB=51200;BGB\r", 0.0)
    assert machine.receive(handle, b"TEB\r", 1.0) == b" 512\r\n:"
    assert machine.receive(handle, b"MG _BGB,_TEB,_TPB\r", 4.0) == b" 0.0000 0.0000 102400.0000\r\n:"
