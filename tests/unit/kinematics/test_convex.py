"""The least of a convex function from below, for what is round, what is bent and what is both."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from maya_un.kinematics import Floats
from maya_un.kinematics.zones import Tangents, least

ACCURACY = 1e-7
SAMPLES = 500
Shape = Callable[[float], tuple[float, float]]


def bound(shapes: list[Shape], enough: float = 1e9) -> Floats:
    """The lower bounds for functions that return value and slope."""

    def probe(rows: NDArray[np.intp], places: Floats) -> Tangents:
        found = [shapes[row](float(place)) for row, place in zip(rows, places, strict=True)]
        value, slope = np.array(found).T
        return Tangents(value, slope)

    every, zeros = np.arange(len(shapes)), np.zeros(len(shapes))
    return least(probe, probe(every, zeros), probe(every, zeros + 1.0), zeros + enough, ACCURACY)


def bowl(at: float, lowest: float, curve: float) -> Shape:
    return lambda t: (lowest + curve * (t - at) ** 2, 2.0 * curve * (t - at))


def notch(at: float, lowest: float, fall: float, rise: float) -> Shape:
    return lambda t: (lowest + (fall * (at - t) if t < at else rise * (t - at)), -fall if t < at else rise)


def passing(at: float, lowest: float) -> Shape:
    """The distance from a place beside a straight way."""
    return lambda t: (hypot(t - at, lowest), (t - at) / hypot(t - at, lowest))


SHARES = st.floats(-0.5, 1.5)
SLOPES = st.floats(1e-3, 1e3)
SHAPES = st.one_of(
    st.builds(bowl, SHARES, st.floats(-1.0, 1.0), SLOPES),
    st.builds(notch, SHARES, st.floats(-1.0, 1.0), SLOPES, SLOPES),
    st.builds(passing, SHARES, st.floats(1e-6, 2.0)),
)


@given(st.lists(SHAPES, min_size=1, max_size=6))
def test_bound_is_below_and_near(shapes: list[Shape]) -> None:
    for shape, below in zip(shapes, bound(shapes), strict=True):
        lowest = min(shape(t)[0] for t in np.linspace(0.0, 1.0, SAMPLES + 1).tolist())
        # The sampled value is above the least one by at most half a step up the steepest slope.
        steepest = max(abs(shape(0.0)[1]), abs(shape(1.0)[1]))
        assert lowest - 0.5 * steepest / SAMPLES - ACCURACY - 1e-9 <= below <= lowest + 1e-9


@pytest.mark.parametrize("shape", [bowl(0.3, 0.7, 5.0), notch(0.3, 0.7, 1.0, 40.0), passing(0.3, 0.7)])
def test_the_least_value_inside(shape: Shape) -> None:
    assert 0.7 - ACCURACY <= bound([shape])[0] <= 0.7 + 1e-12


@pytest.mark.parametrize("at", [-0.2, 0.0, 1.0, 1.4])
def test_at_an_end_the_value_itself_is_the_bound(at: float) -> None:
    shape = bowl(at, 0.2, 3.0)
    assert bound([shape])[0] == min(shape(0.0)[0], shape(1.0)[0])


def test_sufficient_bound_is_not_refined() -> None:
    asked: list[float] = []

    def counted(t: float) -> tuple[float, float]:
        asked.append(t)
        return bowl(0.4, 5.0, 1.0)(t)

    rough = bound([counted], enough=4.0)[0]
    assert 4.0 <= rough <= 5.0
    few = len(asked)
    assert few <= 3
    bound([counted])
    assert len(asked) > 2 * few
