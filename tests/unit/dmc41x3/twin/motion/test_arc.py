from __future__ import annotations

from math import cos, pi, radians, sin, sqrt

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dmc41x3.twin.motion.path import TOLERANCE, Arc, X, Y

SPEEDS = st.just(0.0) | st.floats(0.01, 15e6)
RATES = st.just(0.0) | st.floats(1024.0, 1.1e9) | st.floats(-1.1e9, -1024.0)
RADII = st.floats(10.0, 6_000_000.0)
TURNS = st.floats(-400.0, 400.0).filter(lambda turn: abs(turn) > 0.1)


def test_an_arc_is_given_in_degrees() -> None:
    arc = Arc.of(1000.0, 90.0, -180.0)
    assert arc.length == pytest.approx(1000 * pi)
    assert arc.heading == pytest.approx(0.0)
    assert (arc.offset(X, arc.length), arc.offset(Y, arc.length)) == pytest.approx((0.0, -2000.0))
    assert arc.bend * arc.length == pytest.approx(-180.0)


def test_at_rest_an_arc_is_one_piece() -> None:
    arc = Arc.of(1000.0, 0.0, 90.0)
    assert list(arc.pieces(Y, 0.0, 0.0, 0.0, 5.0)) == [(0.0, 0.0, 0.0, 0.0)]


@given(RADII, st.floats(-360.0, 360.0), TURNS, SPEEDS, RATES, st.sampled_from([X, Y]))
def test_the_pieces_follow_the_circle(
    radius: float, start: float, turn: float, speed: float, rate: float, coordinate: int
) -> None:
    arc = Arc.of(radius, start, turn)
    # The time to the end of the arc, or to rest.
    square = speed * speed + 2.0 * rate * arc.length
    assume(square != 0.0)
    span = 2.0 * arc.length / (speed + sqrt(square)) if square > 0.0 else -speed / rate
    assume(span > 0.0)
    pieces = list(arc.pieces(coordinate, 0.0, speed, rate, span))
    assert len(pieces) <= arc.quadratics(speed, rate, span) + 1.0
    wave = cos if coordinate == X else sin
    ends = [t for t, *_ in pieces[1:]] + [span]
    for (t, p, v, a), end in zip(pieces, ends, strict=True):
        for share in (0.0, 0.21, 0.5, 0.79, 1.0):
            after = share * (end - t)
            s = speed * (t + after) + 0.5 * rate * (t + after) ** 2
            angle = radians(start) + (1.0 if turn > 0.0 else -1.0) * s / radius
            exact = radius * (wave(angle) - wave(radians(start)))
            assert abs(p + v * after + 0.5 * a * after * after - exact) <= TOLERANCE + 1e-6 * radius


def test_pieces_are_few() -> None:
    turn = Arc.of(10_000.0, 0.0, 360.0)
    # Chords within 0.15 counts of this circle would be 574.
    assert len(list(turn.pieces(X, 0.0, 20_000.0, 0.0, pi))) <= 75
