from __future__ import annotations

from collections.abc import Callable
from math import inf

import pytest

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.memory import ArrayRecorder, Arrays

SAMPLE = 1.0 / 1024.0


class Bench:
    """A recorder, an array of four elements, and a source that counts how often it was asked."""

    def __init__(self) -> None:
        self.arrays = Arrays()
        self.arrays.dimension("a", 4)
        self.recorder = ArrayRecorder(self.arrays)
        self.asked = 0
        self.recorder.choose_arrays(["a"])
        self.recorder.choose_sources([self.count])

    def count(self) -> int:
        self.asked += 1
        return self.asked

    def begin(self, now: float = 0.0, *, every: int = 2, count: int = 0, started: float = 0.0) -> None:
        self.recorder.begin(now, started, SAMPLE, every, count)

    @property
    def row(self) -> list[int]:
        return self.arrays.row("a")


def code(act: Callable[[], object]) -> ErrorCode:
    with pytest.raises(Rejection) as refused:
        act()
    return refused.value.code


def test_the_first_record_is_of_the_next_sample() -> None:
    bench = Bench()
    bench.begin(2.5 * SAMPLE)
    assert bench.recorder.next_event() == 3 * SAMPLE
    bench.recorder.look(2.9 * SAMPLE)
    assert bench.asked == 0
    bench.recorder.look(3 * SAMPLE)
    assert bench.row == [1, 0, 0, 0]
    assert bench.recorder.next_event() == 5 * SAMPLE


def test_samples_count_from_power_up() -> None:
    bench = Bench()
    bench.begin(1.0, started=0.25 * SAMPLE)
    assert bench.recorder.next_event() == pytest.approx(1.0 + 0.25 * SAMPLE, abs=1e-12)


def test_it_ends_with_the_array() -> None:
    bench = Bench()
    bench.begin()
    bench.recorder.look(1.0)
    assert bench.row == [1, 2, 3, 4]
    assert not bench.recorder.recording
    assert bench.recorder.next_index == 4
    assert bench.recorder.next_event() == inf


def test_it_ends_after_so_many() -> None:
    bench = Bench()
    bench.begin(count=2)
    bench.recorder.look(1.0)
    assert bench.row == [1, 2, 0, 0]


def test_a_circular_one_goes_round_until_it_is_stopped() -> None:
    bench = Bench()
    bench.begin(count=-3)
    bench.recorder.look(9 * SAMPLE)  # samples 1, 3, 5, 7, 9
    assert bench.row == [4, 5, 3, 0]
    assert (bench.recorder.recording, bench.recorder.next_index) == (True, 2)
    bench.recorder.stop()
    bench.recorder.look(1.0)
    assert bench.asked == 5


def test_nothing_changes_while_it_records() -> None:
    bench = Bench()
    bench.begin()
    assert bench.recorder.uses("a")
    assert code(bench.begin) is ErrorCode.RECORDING
    assert code(lambda: bench.recorder.choose_arrays(["a"])) is ErrorCode.RECORDING
    assert code(lambda: bench.recorder.choose_sources([bench.count])) is ErrorCode.RECORDING


def test_each_array_needs_a_source_and_each_source_an_array() -> None:
    bench = Bench()
    bench.recorder.choose_sources([bench.count, bench.count])
    assert code(bench.begin) is ErrorCode.NO_RECORDING_SOURCE
    bench.recorder.reset()
    assert code(bench.begin) is ErrorCode.NO_RECORDING_SOURCE


def test_more_records_than_the_array_holds() -> None:
    bench = Bench()
    assert code(lambda: bench.begin(count=5)) is ErrorCode.TOO_MANY_ELEMENTS
    assert code(lambda: bench.begin(count=-5)) is ErrorCode.TOO_MANY_ELEMENTS


def test_an_array_that_is_not_there() -> None:
    bench = Bench()
    assert code(lambda: bench.recorder.choose_arrays(["b"])) is ErrorCode.UNDEFINED_ARRAY
    bench.arrays.release("a")
    assert code(bench.begin) is ErrorCode.UNDEFINED_ARRAY
