"""A figure beside another program counts only if both give the same answer."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.peers.contest import Contest, Floats, LeftOut, Side, peer, rows, sides_of, spent
from scripts.performance_results import OURS


def side(program: str, answer: object, seconds: float = 0.001) -> Side:
    def answered() -> Floats:
        if isinstance(answer, Exception):
            raise answer
        return np.array(answer, dtype=np.float64)

    return Side(program, answered, lambda: seconds)


def contest(*sides: Side) -> Contest:
    return Contest("kinematics", "a place", "ms", "m", 0.01, sides)


def test_a_program_that_agrees_is_compared_with_maya() -> None:
    ours, other = rows(contest(side(OURS, [1.0, 2.0]), side("other", [1.0, 2.005], 0.003)), rounds=2)
    assert (ours.best, ours.ratio, ours.difference) == (1.0, 1.0, 0.0)
    assert (other.best, other.ratio, other.rounds) == (3.0, 3.0, 2)
    assert other.difference == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        ([1.0, 2.5], "its answer differs by 0.5 m from Maya's"),
        ([1.0, float("nan")], "its answer differs by nan m from Maya's"),
        ([1.0], "it gives (1,) numbers, Maya gives (2,)"),
        (RuntimeError("no solution"), "RuntimeError: no solution"),
    ],
)
def test_a_program_that_does_not_agree_has_an_error_and_no_figure(answer: object, says: str) -> None:
    ours, other = rows(contest(side(OURS, [1.0, 2.0]), side("other", answer)), rounds=1)
    assert ours.best is not None
    assert (other.error, other.best, other.ratio) == (says, None, None)


def test_no_figure_counts_if_mayas_own_answer_is_wrong() -> None:
    found = rows(contest(side(OURS, AssertionError("a reader got 3 %")), side("other", [1.0])), rounds=1)
    assert {row.error for row in found} == {"Maya's answer is wrong: a reader got 3 %"}


def test_a_program_that_is_not_installed_is_left_out_with_a_sentence() -> None:
    def missing() -> Side:
        peer("no_such_module_anywhere", "no-such-package")
        raise AssertionError

    left_out: dict[str, str] = {}
    assert [one.program for one in sides_of({"a": missing, "b": lambda: side("b", [1.0])}, left_out)] == ["b"]
    assert left_out["a"].startswith("no-such-package cannot be imported here: ")
    with pytest.raises(LeftOut):
        missing()


def test_a_sample_is_cpu_time_of_this_process() -> None:
    assert 0.0 < spent(lambda: sum(range(10_000)), 20)() < 1.0
