"""PVT sequences (PV, BT) on the machine, against Hermite polynomials worked out by themselves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.record import AxisStatus
from tests.unit.dmc41x3.twin.bench import Bench

SAMPLE = 1 / 1024

Knot = tuple[int, int, int]


def begun(*records: str) -> Bench:
    """Return a bench whose axis A has begun a PVT sequence at time 0."""
    bench = Bench()
    bench.do(*(f"PVA={record}" for record in records), "BTA")
    return bench


def hermite(start: float, v: float, end: float, w: float, duration: float, share: float) -> tuple[float, float]:
    """Return position and velocity of the cubic through two states by the Hermite basis."""
    basis = np.polynomial.Polynomial
    h00, h10 = basis([1, 0, -3, 2]), basis([0, 1, -2, 1])
    h01, h11 = basis([0, 0, 3, -2]), basis([0, 0, -1, 1])
    cubic = start * h00 + duration * v * h10 + end * h01 + duration * w * h11
    return float(cubic(share)), float(cubic.deriv()(share)) / duration


def test_a_ramp_up_and_down() -> None:
    bench = begun("1024,4096,512", "1024,0,512", "0,0,0")
    assert bench.say("SCA") == " 30\r\n:"
    assert (bench.value("_PVA"), bench.value("_BTA")) == (253.0, 0.0)
    # The first half second is p = 4096 t²: constant acceleration.
    assert bench.at(0.25).axis(0).timeline.at(0.25) == pytest.approx((256.0, 2048.0))
    assert bench.at(0.5).axis(0).timeline.at(0.5) == pytest.approx((1024.0, 4096.0))
    assert (bench.value("_PVA"), bench.value("_BTA")) == (254.0, 1.0)
    assert bench.at(0.999).value("_BGA") == 1.0
    assert bench.at(1.0).value("_BGA") == 0.0
    assert bench.say("SCA") == " 31\r\n:"
    assert bench.positions()[0] == 2048
    assert (bench.value("_PVA"), bench.value("_BTA")) == (255.0, 3.0)
    assert bench.value("_MOA") == 0.0


KNOTS = st.lists(
    st.tuples(st.integers(-30_000, 30_000), st.integers(-50_000, 50_000), st.integers(1, 1024)), min_size=1, max_size=12
)


@given(KNOTS, st.lists(st.floats(0.0, 0.99), min_size=1, max_size=8))
def test_positions_and_speeds_are_those_of_the_hermite_cubics(knots: list[Knot], shares: list[float]) -> None:
    bench = begun(*(f"{way},{2 * speed},{2 * samples}" for way, speed, samples in knots), "0,0,0")
    states = [(0.0, 0.0, 0.0)]
    for way, speed, samples in knots:
        t, p, _ = states[-1]
        states.append((t + 2 * samples * SAMPLE, p + way, 2.0 * speed))
    for (t, p, v), (after, q, w) in pairwise(states):
        largest = max(abs(v), abs(w), 2.0 * abs(q - p) / (after - t))
        for share in sorted(shares):
            position, velocity = hermite(p, v, q, w, after - t, share)
            here = t + share * (after - t)
            got, speed = bench.at(here).axis(0).timeline.at(here)
            assert got == pytest.approx(position, abs=0.1)
            # A quadratic that misses the cubic by 0.05 counts has a speed that is off by 0.5 counts over its time.
            assert speed == pytest.approx(velocity, abs=0.06 * largest + 1.1 / (after - t))
    bench.at(states[-1][0])
    assert bench.positions()[0] == states[-1][1]
    assert (bench.value("_SCA"), bench.value("_BTA")) == (31.0, len(knots) + 1.0)


def test_a_time_left_out_is_that_of_the_record_before() -> None:
    bench = Bench()
    assert bench.code("PVA=100,0") == ErrorCode.NO_TIME
    bench.do("PVA=100,200,512", "PVA=50", "PVA=,,0", "BTA")
    assert bench.at(0.999).value("_BGA") == 1.0
    assert bench.at(1.0).value("_BGA") == 0.0
    assert bench.positions()[0] == 150


def test_records_may_follow_while_it_runs() -> None:
    bench = begun("1024,4096,512").at(0.25)
    bench.do("PVA=1024,0,512", "PVA=0,0,0")
    assert bench.at(0.75).axis(0).timeline.at(0.75) == pytest.approx((1792.0, 2048.0))
    assert bench.at(2.0).say("SCA") == " 31\r\n:"


def test_a_sequence_that_runs_out_of_records_stops_dead() -> None:
    bench = begun("1024,4096,512")
    assert bench.at(0.5 - 1e-6).value("_BGA") == 1.0
    bench.at(0.5)
    assert (bench.value("_BGA"), bench.value("_SCA"), bench.value("_BTA")) == (0.0, 32.0, 1.0)
    assert bench.at(3.0).positions()[0] == 1024


def test_axes_have_their_own_sequences() -> None:
    bench = Bench()
    bench.do("PVA=1024,0,512;PVA=0,0,0", "PVB=-300,0,1024;PVB=0,0,0", "BT AB")
    assert bench.at(0.6).say("SC") == " 31, 30, 1\r\n:"
    assert bench.at(2.0).positions() == [1024, -300, 0]


def test_bt_alone_begins_all_that_have_records() -> None:
    bench = Bench()
    bench.do("PVA=8,0,16;PVA=0,0,0", "PVC=8,0,16;PVC=0,0,0", "BT")
    assert bench.say("SC") == " 30, 1, 30\r\n:"


def test_a_record_for_all_axes() -> None:
    bench = Bench()
    bench.do("PV*=8,0,16", "PV*=0,0,0", "BT")
    assert bench.at(1.0).positions() == [8, 8, 8]


def test_minus_one_empties_the_buffer() -> None:
    bench = begun("1024,4096,512", "1024,0,512", "0,0,0")
    bench.do("PVB=5,0,2")
    bench.do("PVA=0,0,-1", "PVB=,,-1")
    assert (bench.value("_PVB"), bench.value("_PVA")) == (255.0, 254.0)
    # The records laid out are gone too, but for the one under way.
    bench.at(3.0)
    assert (bench.positions()[0], bench.value("_SCA")) == (1024, 32.0)


def test_the_buffer_holds_255_records() -> None:
    bench = Bench()
    bench.do(*["PVA=10,0,2"] * 255)
    assert bench.value("_PVA") == 0.0
    assert bench.code("PVA=10,0,2") == ErrorCode.SEGMENT_BUFFER_FULL
    bench.do("BTA")
    bench.at(3 * SAMPLE).do("PVA=10,0,2")
    assert bench.at(9.0).positions()[0] == 2560


def test_a_stop_brakes_at_dc_and_forgets_the_rest() -> None:
    bench = begun("1024,4096,512", "1024,0,512", "0,0,0")
    bench.do("DCA=8192")
    bench.at(0.5).do("STA")
    assert bench.say("SCA") == " 4\r\n:"
    assert bench.value("_PVA") == 255.0
    # 4096 counts/s take half a second and 1024 counts.
    assert bench.at(0.999).value("_BGA") == 1.0
    bench.at(1.001)
    assert (bench.value("_BGA"), bench.positions()[0], bench.value("_SCA")) == (0.0, 2048, 4.0)
    assert bench.code("BTA") == ErrorCode.NO_SEQUENCE


def test_a_limit_brakes_at_sd() -> None:
    bench = begun("1024,4096,512", "1024,0,512", "0,0,0")
    bench.do("SDA=16384", "PRB=500;BGB")
    bench.at(0.5)
    bench.switch(0, forward=False)
    assert bench.say("SC") == " 2, 1, 1\r\n:"
    assert bench.at(2.0).positions() == [1024 + 512, 500, 0]
    assert bench.value("_SCA") == 2.0


def test_soft_limit_is_met_by_an_overshoot_within_a_record() -> None:
    # From 0 to 0 with 8192 counts/s inward at the end: the cubic swings out to 8192 4/27 = 1213.6 counts below 0.
    bench = begun("0,8192,1024", "0,0,0")
    bench.do("BLA=-1000", "SDA=1024000")
    bench.at(2.0)
    assert (bench.value("_SCA"), bench.positions()[0]) == (3.0, pytest.approx(-1003, abs=3))


def test_status_of_an_axis_in_pvt() -> None:
    bench = begun("-1024,-4096,512", "0,0,0").at(0.1)
    status = bench.record().axes[0].status
    assert status & AxisStatus.MOVING
    assert status & AxisStatus.NEGATIVE
    assert not status & (AxisStatus.COORDINATED | AxisStatus.CONTOUR | AxisStatus.POSITION_MODE)


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("PVA=30000001,0,2", ErrorCode.OUT_OF_RANGE),
        ("PVA=-30000001,0,2", ErrorCode.OUT_OF_RANGE),
        ("PVA=0,15000002,2", ErrorCode.OUT_OF_RANGE),
        ("PVA=0,0,2050", ErrorCode.OUT_OF_RANGE),
        ("PVA=0,0,1", ErrorCode.OUT_OF_RANGE),
        ("PVA=0,0,-2", ErrorCode.OUT_OF_RANGE),
        ("PVA=1,2,3,4", ErrorCode.OPERAND_ERROR),
        ("PVA=?", ErrorCode.QUESTION_MARK_INVALID),
        ("PV 1,2,3", ErrorCode.OPERAND_ERROR),
        ("PVD=1,2,4", ErrorCode.INVALID_AXIS),
        ("BTA", ErrorCode.NO_SEQUENCE),
        ("BT", ErrorCode.NO_SEQUENCE),
        ("BT AD", ErrorCode.INVALID_AXIS),
        ("MG _PVS", ErrorCode.BAD_OPERAND),
    ],
)
def test_misuse_has_its_code(command: str, code: ErrorCode) -> None:
    assert Bench().code(command) == code


@pytest.mark.parametrize(
    ("setup", "code"),
    [
        ("MOA", ErrorCode.BEGIN_MOTOR_OFF),
        ("JGA=100;BGA", ErrorCode.BEGIN_WHILE_RUNNING),
        ("FLA=-5", ErrorCode.BEGIN_AT_LIMIT),
        ("LM A;LI 9999;BGS", ErrorCode.BEGIN_WHILE_RUNNING),
        ("CM A;DT 8;CD 5", ErrorCode.NOT_WHILE_CONTOURING),
    ],
)
def test_begin_needs_an_axis_that_may(setup: str, code: ErrorCode) -> None:
    bench = Bench()
    bench.do(setup, "PVA=10,0,2;PVB=10,0,2")
    assert bench.code("BT AB") == code
    assert bench.value("_BGB") == 0.0


def test_running_sequence_refuses_commands() -> None:
    bench = begun("1024,4096,512").at(0.1)
    assert bench.code("BTA") == ErrorCode.BEGIN_WHILE_RUNNING
    assert bench.code("BGA") == ErrorCode.BEGIN_WHILE_RUNNING
    assert bench.code("PAA=5") == ErrorCode.NOT_WHILE_RUNNING
    assert bench.code("MOA") == ErrorCode.NOT_WHILE_RUNNING


def test_a_slower_sample_makes_records_longer() -> None:
    bench = Bench()
    bench.do("TM 2000", "PVA=1024,0,512", "PVA=0,0,0", "BTA")
    assert bench.at(0.999).value("_BGA") == 1.0
    assert bench.at(1.0).value("_BGA") == 0.0


def test_the_limit_in_the_way_is_the_one_of_the_first_instant() -> None:
    # 100 counts ahead in a second, but with 1000 counts/s there: the cubic begins backwards.
    bench = Bench()
    bench.do("PVA=100,1000,1024", "PVA=0,0,0")
    bench.switch(0, reverse=False)
    assert bench.code("BTA") == ErrorCode.BEGIN_AT_LIMIT
    bench.switch(0, forward=False)
    bench.do("BTA")
