"""The benchmarks' harness compares within one run, and reports without judging."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from itertools import count
from statistics import median

import pytest

from benchmarks.harness import Case, Figure, Goal, Sample, measure, report, timed


def samples(*values: float) -> Sample:
    """Return a sample that gives the first value twice: the first round does not count."""
    left: Iterator[float] = iter((values[0], *values))
    return lambda: next(left)


def figure(goal: Goal | None, *values: float, unit: str = "ms") -> Figure:
    cases = [Case("base", samples(*[0.010] * len(values)), unit), Case("ours", samples(*values), unit, goal)]
    return measure(cases, rounds=len(values))[1]


def test_cases_are_sampled_in_turn() -> None:
    order, number = list[str](), count()

    def noting(name: str) -> Sample:
        return lambda: order.append(name) or float(next(number))

    measure([Case("a", noting("a")), Case("b", noting("b"))], rounds=2)
    assert order == ["a", "b"] * 3


def test_a_figure_is_in_the_unit_of_its_case() -> None:
    found = figure(None, 0.030, 0.020, 0.025)
    assert (found.best, found.median, found.rounds, found.met) == (pytest.approx(20.0), pytest.approx(25.0), 3, None)


@pytest.mark.parametrize(
    ("goal", "compared", "met"),
    [
        (Goal(20.0), 20.0, True),
        (Goal(19.0), 20.0, False),
        (Goal(2.0, to="base"), 2.0, True),
        (Goal(1.9, to="base"), 2.0, False),
        (Goal(10.0, to="base", kind="over"), 10.0, True),
        (Goal(9.0, to="base", kind="over"), 10.0, False),
    ],
)
def test_a_goal_is_about_the_value_a_ratio_or_a_difference(goal: Goal, compared: float, met: bool) -> None:
    found = figure(goal, 0.020, 0.040)
    assert (found.compared, found.met) == (pytest.approx(compared), met)


def test_the_sample_to_compare_can_be_the_median() -> None:
    cases = [Case("base", samples(1.0, 1.0, 1.0), "s"), Case("ours", samples(9.0, 2.0, 3.0), "s", Goal(2.0, to="base"))]
    assert measure(cases, rounds=3, by=median)[1].compared == 3.0


@pytest.mark.parametrize(("paired", "compared"), [(False, 3.0), (True, 2.0)])
def test_samples_of_a_round_can_be_compared_with_each_other(paired: bool, compared: float) -> None:
    base, ours = samples(4.0, 1.0, 2.0), samples(8.0, 3.0, 4.0)
    found = measure([Case("base", base), Case("ours", ours, goal=Goal(2.0, "base"))], rounds=3, paired=paired)
    assert found[1].compared == compared


def test_a_sample_is_the_mean_of_its_calls() -> None:
    calls: list[int] = []
    assert timed(lambda: calls.append(1), 50)() > 0.0
    assert len(calls) == 50


def test_the_table_marks_a_goal_that_was_missed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["bench"])
    report([figure(Goal(1.5, to="base"), 0.020)])
    assert capsys.readouterr().out.splitlines()[1].endswith("2.00 × base (at most 1.5)  MISSED")


def test_json_holds_the_same_figures(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["bench", "--json"])
    report([figure(Goal(3.0, to="base"), 0.020)])
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["name"], found["goal_is"], found["met"]) == ("ours", "× base", True)
