"""Known values of the following error of an axis."""

from __future__ import annotations

import pytest

from dmc41x3.twin.motion import independent
from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize(
    ("gain", "peak", "limit", "near"),
    [(None, 0.0, 100, False), (None, 1.0, 100, True), (0.01, 7_900.0, 100, False), (0.01, 8_000.0, 100, True)],
)
def test_error_is_near_if_speed_could_reach_it(gain: float | None, peak: float, limit: int, near: bool) -> None:
    bench = Bench()
    bench.do(f"ERA={limit}")
    axis = bench.axis(0)
    axis.error_gain, axis.peak = gain, peak
    assert independent.near_error_limit(axis) is near
    bench.do("ERA=-1")
    assert not independent.near_error_limit(axis)


@pytest.mark.parametrize(
    ("wanted", "actual", "gain"),
    [(1000.0, 1000.0, 0.02), (-1000.0, -900.0, 20 / 900), (1000.0, 700.0, None), (1000.0, -1000.0, None)],
)
def test_it_is_learned_only_from_an_axis_that_runs_with_its_reference(
    wanted: float, actual: float, gain: float | None
) -> None:
    axis = Bench().axis(0)
    axis.error_gain = None
    independent.learn_error(axis, 20.0, wanted, actual)
    assert axis.error_gain == gain
