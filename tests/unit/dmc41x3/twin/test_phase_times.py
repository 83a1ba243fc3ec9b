"""BX and BZ with their times, and without an axis."""

from __future__ import annotations

import pytest

from tests.unit.dmc41x3.twin.bench import Bench


@pytest.mark.parametrize("command", ["BZ <1000>1500", "BZ <20>10", "BX <500", "BZ >500"])
def test_times_alone_are_kept_and_find_nothing(command: str) -> None:
    bench = Bench(servo=False)
    bench.do("BAA", command)
    assert bench.value("_MOA") == 1.0
    assert bench.value("_BZA") == 0.0


def test_times_next_to_volts_are_accepted() -> None:
    bench = Bench(servo=False)
    bench.do("BAA", "BZA=3<200>100")
    assert (bench.value("_MOA"), bench.value("_BZA")) == (0.0, 1.0)


@pytest.mark.parametrize("command", ["BZ <-1>10", "BZ <20>40000"])
def test_a_time_out_of_range_is_refused(command: str) -> None:
    assert Bench().code(command) == 6
