"""The bench that stands in for mechanics in tests of the machine."""

from __future__ import annotations

from dmc41x3.twin.plant import BenchPlant
from dmc41x3.twin.timeline import TimelinePiece


def test_ideal_bench_is_at_its_reference() -> None:
    bench = BenchPlant(2)
    bench.timelines[1].plan(0.0, (TimelinePiece(0.0, 0.0, 100.0, 0.0),))
    bench.advance(2.0)
    assert (bench.position(0), bench.position(1)) == (0.0, 200.0)
    assert bench.velocity(1) == 100.0
    assert bench.torque(1) == 0.0
    assert bench.next_event(9.0) is None


def test_its_inputs_idle_high_and_can_be_set() -> None:
    bench = BenchPlant()
    assert bench.inputs(0) == (True, True, True)
    bench.set_inputs(0, reverse=False)
    assert bench.inputs(0) == (True, False, True)


def test_a_held_shaft_stays_while_its_motor_pushes() -> None:
    bench = BenchPlant(1)
    bench.power(0, True)
    bench.timelines[0].plan(0.0, (TimelinePiece(0.0, 0.0, 100.0, 0.0),))
    bench.advance(1.0)
    bench.hold(0)
    bench.advance(2.0)
    assert (bench.position(0), bench.velocity(0)) == (100.0, 0.0)
    assert bench.torque(0) > 9.0
    assert bench.next_event(9.0) == 2.002
    bench.release(0)
    assert bench.position(0) == 200.0
