"""Measures this checkout beside another one: `scripts/bench --against FOLDER [--rounds N] [--output FILE] [NAME...]`.

Each benchmark runs in both checkouts in turn, and the cases of the same name are compared by the samples of all
rounds: by the best, or by the median if the benchmark compares medians. A benchmark runs again, at most `--rounds`
times, while one of its figures is more than 5 % greater than in the other checkout. At the end, such a figure is worse
unless a rank test finds that the difference is due to chance. The test takes its values for independent, but samples
of one round resemble each other. So it has one value of each round. Fewer than five rounds are too few for that: then
it takes all samples, and some figures that it finds worse are so by chance. The checkouts change places after each
round.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from statistics import median
from typing import Any

from scipy.stats import mannwhitneyu

from benchmarks.computer import computer
from scripts.performance_results import Compared, Comparison, read_comparison, write_comparison

ROOT = Path(__file__).resolve().parent.parent
Figures = dict[str, dict[str, Any]]
"""The figures of a benchmark by the names of their cases: the fields of `harness.Figure`."""

PICKED: dict[str, Callable[[Iterable[float]], float]] = {"min": min, "median": median, "max": max}
"""The functions that pick the sample to compare, by their names in a figure."""

ENOUGH = 5
"""With fewer rounds no order of their values has a chance below `CHANCE`: 1 of 70 with four, 1 of 252 with five."""


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/bench --against", description=__doc__)
    parser.add_argument("folder", type=Path, help="another checkout of this project")
    parser.add_argument("names", nargs="*", metavar="NAME", help="benchmarks/bench_NAME.py (all)")
    parser.add_argument("--rounds", type=int, default=3, help="how often a benchmark runs at most (3)")
    parser.add_argument("--output", type=Path, help="store the figures here; those of other benchmarks stay")
    asked = parser.parse_intermixed_args()
    other = asked.folder.resolve()
    comparison = Comparison(datetime.now(UTC).date().isoformat(), computer(), commit(other), commit(ROOT), [])
    for name in asked.names or everything():
        print(f"== {name}", flush=True)
        cases = compared(other, name, asked.rounds)
        print("\n".join(map(line, cases)), flush=True)
        comparison.cases.extend(cases)
    if asked.output is not None:
        write_comparison(joined(asked.output, comparison), asked.output)


def everything() -> list[str]:
    """Return the names of all benchmarks."""
    return sorted(file.stem.removeprefix("bench_") for file in (ROOT / "benchmarks").glob("bench_*.py"))


def commit(folder: Path) -> str:
    """Return the commit of a checkout."""
    said = subprocess.run(
        ["git", "rev-parse", "--short=8", "HEAD"], cwd=folder, capture_output=True, text=True, check=True
    )
    return said.stdout.strip()


def compared(folder: Path, name: str, rounds: int) -> list[Compared]:
    """Run a benchmark in both checkouts, again while a figure is greater, and return the cases of this one."""
    before: list[Figures] = []
    after: list[Figures] = []
    cases: list[Compared] = []
    for number in range(rounds):
        if number % 2 == 0:
            before.append(figures(folder, name))
        after.append(figures(ROOT, name))
        if number % 2 == 1:
            before.append(figures(folder, name))
        cases = list(paired(name, before, after))
        if not any(case.greater for case in cases):
            break
    return cases


def figures(folder: Path, name: str) -> Figures:
    """Run a benchmark of a checkout in a program of its own; none if the checkout lacks it or cannot run it."""
    run = subprocess.run(
        [folder / "scripts" / "bench", "--json", name], capture_output=True, text=True, check=False, cwd=folder
    )
    if run.returncode != 0:
        print(f"{folder}: {name} failed:\n{run.stderr}", file=sys.stderr)
        return {}
    return {figure["name"]: figure for text in run.stdout.splitlines() for figure in json.loads(text)}


def paired(benchmark: str, before: Sequence[Figures], after: Sequence[Figures]) -> Iterator[Compared]:
    """Yield the cases of `after` beside those of the same name, each with the samples of all its rounds.

    Another checkout may be too old to tell its samples; then the best ones are compared.
    """
    for name in dict.fromkeys(name for figures in after for name in figures):
        figure, samples = pooled(name, after)
        old, old_samples = pooled(name, before)
        ours, theirs, by_chance = figure["best"], old.get("best"), None
        if old_samples:
            picked = PICKED[figure["by"]]
            ours, theirs = picked(chain(*samples)), picked(chain(*old_samples))
            by_chance = chance(old_samples, samples, picked)
        yield Compared(
            benchmark, name, figure["unit"], theirs, ours,
            figure["goal"], figure["goal_is"], old.get("compared"), figure["compared"], by_chance,
        )  # fmt: skip


def pooled(name: str, rounds: Sequence[Figures]) -> tuple[dict[str, Any], list[list[float]]]:
    """Return the best figure of a case, {} without one, and the samples of each round that has some."""
    found = [figures[name] for figures in rounds if name in figures]
    best = min(found, key=lambda figure: float(figure["best"]), default={})
    return best, [figure["samples"] for figure in found if figure.get("samples")]


def chance(
    before: Sequence[list[float]], after: Sequence[list[float]], picked: Callable[[Iterable[float]], float]
) -> float:
    """Return the probability that samples of equal checkouts differ as much, `after` being greater.

    The samples are those of each round. Of `ENOUGH` rounds or more, the samples that are `picked` are compared.

    Mann and Whitney: On a test of whether one of two random variables is stochastically larger than the other, 1947.
    """
    enough = min(len(before), len(after)) >= ENOUGH
    old, new = ([picked(each) for each in rounds] if enough else list(chain(*rounds)) for rounds in (before, after))
    return float(mannwhitneyu(new, old, alternative="greater").pvalue)


def line(case: Compared) -> str:
    """Return the row of the table."""
    before = "" if case.before is None else f"{case.before:.3f}"
    mark = "  WORSE" if case.worse else f"  by chance, {case.chance:.0%}" if case.greater else ""
    ratio = "" if case.ratio is None else f"{case.ratio:.2f}{mark}"
    goal = "" if case.goal is None else f"  {case.reached:.2f} {case.goal_is} (at most {case.goal:g})"
    return f"{case.name:60} {before:>12} {case.after:12.3f} {case.unit:2} {ratio}{goal}{'  MISSED' * case.missed}"


def joined(path: Path, newer: Comparison) -> Comparison:
    """Return a comparison with the cases of the other benchmarks that a file has of the same two commits.

    The computer is that of the file: its load is that at the first benchmark, which no benchmark before it caused.
    """
    if not path.exists():
        return newer
    older = read_comparison(path)
    if (older.before, older.after) != (newer.before, newer.after):
        return newer
    measured = {case.benchmark for case in newer.cases}
    kept = [case for case in older.cases if case.benchmark not in measured]
    return replace(newer, computer=older.computer, cases=sorted([*kept, *newer.cases], key=lambda case: case.benchmark))


if __name__ == "__main__":
    main()
