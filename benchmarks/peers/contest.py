"""The same work for Maya and for others: answers that must agree, then cost in turn."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness import Case, Figure, Goal, Sample, measure
from scripts.performance_results import OURS, Row

Floats = NDArray[np.float64]

DIGITS = 4
"""Number of significant digits of a stored figure."""


class LeftOut(Exception):
    """A program cannot be measured here; the text is a sentence that says why."""


@dataclass(frozen=True, slots=True)
class Side:
    """A program that does the work: `answer` returns what it finds, `sample` takes one sample of its cost [s]."""

    program: str
    answer: Callable[[], Floats]
    sample: Sample


@dataclass(frozen=True, slots=True)
class Contest:
    """One piece of work and those who do it, Maya first.

    Answers may differ by `tolerance`, in `answered_in`. Costs are shown in `unit`.
    """

    subject: str
    work: str
    unit: str
    answered_in: str
    tolerance: float
    sides: Sequence[Side]


def spent(work: Callable[[], object], calls: int = 1) -> Sample:
    """Return a sample of the CPU time that one call of `work` takes, the mean of `calls` in a row [s]."""

    def sample() -> float:
        start = time.process_time()
        for _ in range(calls):
            work()
        return (time.process_time() - start) / calls

    return sample


def peer(module: str, package: str) -> Any:
    """Return a module of a peer; raises `LeftOut` where it is not installed."""
    try:
        return import_module(module)
    except ImportError as error:
        raise LeftOut(f"{package} cannot be imported here: {error}") from error


def sides_of(makers: Mapping[str, Callable[[], Side]], left_out: dict[str, str]) -> list[Side]:
    """Return the sides that can be measured here; `left_out` gets a sentence for every other one."""
    found: list[Side] = []
    for program, make in makers.items():
        try:
            found.append(make())
        except LeftOut as reason:
            left_out[program] = str(reason)
    return found


def rows(contest: Contest, rounds: int) -> list[Row]:
    """Return a row for every side; one whose answer is not Maya's, or that fails, gets an error instead of figures."""
    ours, *_ = contest.sides
    assert ours.program == OURS
    try:
        expected = ours.answer()
    except AssertionError as error:
        return [replace(_blank(contest, side), error=f"Maya's answer is wrong: {error}") for side in contest.sides]
    blanks = {side.program: _answered(contest, side, expected) for side in contest.sides}
    agreed = [side for side in contest.sides if not blanks[side.program].error]
    to = Goal(inf, to=OURS)  # only to compare: every ratio is below it
    figures = measure([Case(side.program, side.sample, contest.unit, to) for side in agreed], rounds, paired=True)
    filled = {figure.name: _filled(blanks[figure.name], figure) for figure in figures}
    return [filled.get(program, blank) for program, blank in blanks.items()]


def _answered(contest: Contest, side: Side, expected: Floats) -> Row:
    blank = _blank(contest, side)
    try:
        found = side.answer()
    except Exception as error:  # noqa: BLE001 - whatever a peer raises is reported in its row
        return replace(blank, error=f"{type(error).__name__}: {error}")
    if found.shape != expected.shape:
        return replace(blank, error=f"it gives {found.shape} numbers, Maya gives {expected.shape}")
    difference = float(np.abs(found - expected).max())
    if not difference <= contest.tolerance:
        unit = contest.answered_in
        return replace(blank, error=f"its answer differs by {difference:.3g} {unit} from Maya's")
    return replace(blank, difference=_rounded(difference))


def _blank(contest: Contest, side: Side) -> Row:
    return Row(contest.subject, contest.work, side.program, contest.unit, contest.answered_in, contest.tolerance)


def _filled(blank: Row, figure: Figure) -> Row:
    best, middle, worst = map(_rounded, (figure.best, figure.median, figure.worst))
    assert figure.compared is not None
    ratio = _rounded(figure.compared)
    return replace(blank, best=best, median=middle, worst=worst, rounds=figure.rounds, ratio=ratio)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def rounded(values: Iterable[float]) -> list[float]:
    """Return values with as many digits as are stored."""
    return list(map(_rounded, values))
