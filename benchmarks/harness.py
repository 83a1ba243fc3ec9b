"""The parts that all benchmarks share: cases measured in turn, compared with a baseline of the same run, one table.

A case is a function that takes one sample: seconds, bytes, or metres. All cases are sampled once a round, so that what
the machine does beside us hits every one of them alike. Comparisons take the best of all rounds (least
disturbed) unless a benchmark asks for another, as one about a longest wait must; nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from threading import Event
from typing import Literal

Sample = Callable[[], float]
"""Takes one sample [s, bytes or m]."""

Kind = Literal["ratio", "over"]
"""How a case compares with its baseline: as a multiple of it, or by how much it lies over it."""

SCALES = {"s": 1.0, "ms": 1e3, "µs": 1e6, "B": 1.0, "MB": 1e-6, "mm": 1e3}
"""From seconds, bytes or metres to what the table shows."""


@dataclass(frozen=True, slots=True)
class Goal:
    """The most that a case may cost: of itself, or against the case named `to` (`most` in units, or a ratio)."""

    most: float
    to: str | None = None
    kind: Kind = "ratio"


@dataclass(frozen=True, slots=True)
class Case:
    """Something to measure; `unit` is what the table shows, a goal's `most` is in it unless it is a ratio."""

    name: str
    sample: Sample
    unit: str = "µs"
    goal: Goal | None = None


@dataclass(frozen=True, slots=True)
class Figure:
    """The result of a case: best, median and worst in `unit`, and the number that its goal is about.

    `samples` has all of them, in `unit`; `by` is the name of the function that picks the one to compare.
    """

    name: str
    unit: str
    best: float
    median: float
    worst: float
    rounds: int
    compared: float | None
    goal: float | None
    goal_is: str | None
    met: bool | None
    samples: list[float]
    by: str


def timed(work: Callable[[], object], calls: int = 1) -> Sample:
    """Return a sample of the time that one call of `work` takes, the mean of `calls` in a row [s]."""

    def sample() -> float:
        start = time.perf_counter()
        for _ in range(calls):
            work()
        return (time.perf_counter() - start) / calls

    return sample


def cpu_time(pid: int) -> float:
    """Return the CPU time that a process has used [s], counted in nanoseconds (clock_getcpuclockid(3))."""
    clock = ctypes.c_int()
    if ctypes.CDLL(None).clock_getcpuclockid(pid, ctypes.byref(clock)):
        raise ProcessLookupError(pid)
    return time.clock_gettime(clock.value)


def in_a_second(pid: int, lasts: float) -> Sample:
    """Return a sample of the CPU time that a process uses in a second [s], the mean over `lasts` [s]."""

    def sample() -> float:
        before, began = cpu_time(pid), time.monotonic()
        Event().wait(lasts)
        return (cpu_time(pid) - before) / (time.monotonic() - began)

    return sample


def measure(
    cases: Sequence[Case], rounds: int, by: Callable[[list[float]], float] = min, *, paired: bool = False
) -> list[Figure]:
    """Sample all cases in turn, `rounds` times after one that does not count.

    `by` picks the sample to compare. If `paired`, the samples of each round are compared instead, and the median of
    these comparisons counts: then a load that changes between the rounds changes the comparison least.
    """
    for case in cases:
        case.sample()
    samples: dict[str, list[float]] = {case.name: [] for case in cases}
    for _ in range(rounds):
        for case in cases:
            samples[case.name].append(case.sample())
    together = list(zip(*samples.values(), strict=True)) if paired else [tuple(map(by, samples.values()))]
    picked = [dict(zip(samples, some, strict=True)) for some in together]
    return [_figure(case, samples[case.name], picked, by.__name__) for case in cases]


def _figure(case: Case, samples: list[float], picked: list[dict[str, float]], by: str) -> Figure:
    scale = SCALES[case.unit]
    goal = case.goal
    compared = None if goal is None else median(_compared(some[case.name], goal, some, scale) for some in picked)
    return Figure(
        name=case.name,
        unit=case.unit,
        best=min(samples) * scale,
        median=median(samples) * scale,
        worst=max(samples) * scale,
        rounds=len(samples),
        compared=compared,
        goal=None if goal is None else goal.most,
        goal_is=None if goal is None else _meaning(goal, case.unit),
        met=None if goal is None or compared is None else compared <= goal.most,
        samples=[sample * scale for sample in samples],
        by=by,
    )


def _compared(own: float, goal: Goal, picked: dict[str, float], scale: float) -> float:
    if goal.to is None:
        return own * scale
    return own / picked[goal.to] if goal.kind == "ratio" else (own - picked[goal.to]) * scale


def _meaning(goal: Goal, unit: str) -> str:
    if goal.to is None:
        return unit
    return f"× {goal.to}" if goal.kind == "ratio" else f"{unit} over {goal.to}"


def report(figures: Sequence[Figure]) -> None:
    """Print the figures as one table, or with `--json` on the command line as one line of JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", action="store_true", help="one line of JSON instead of a table")
    if parser.parse_args().json:
        print(json.dumps([asdict(figure) for figure in figures]))
        return
    width = max(len(figure.name) for figure in figures)
    print(f"{'':{width}}  {'best':>10} {'median':>10} {'worst':>10}")
    for figure in figures:
        numbers = f"{figure.best:10.3f} {figure.median:10.3f} {figure.worst:10.3f} {figure.unit:2}"
        print(f"{figure.name:{width}}  {numbers} {_verdict(figure)}".rstrip())


def _verdict(figure: Figure) -> str:
    if figure.goal is None or figure.compared is None:
        return ""
    mark = "" if figure.met else "  MISSED"
    return f"  {figure.compared:.2f} {figure.goal_is} (at most {figure.goal:g}){mark}"
