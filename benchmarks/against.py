"""Measures this checkout beside another one: `scripts/bench --against FOLDER [--rounds N] [--output FILE] [NAME...]`.

Each benchmark runs in both checkouts in turn, and the cases of the same name are compared by their best figures. A
benchmark runs again, at most `--rounds` times, while one of its figures is more than 5 % worse than in the other
checkout: a computer that did something else for a moment makes no figure worse for good. The checkouts change places
after each round.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from benchmarks.computer import computer
from scripts.performance_results import WORSE, Compared, Comparison, read_comparison, write_comparison

ROOT = Path(__file__).resolve().parent.parent
Figures = dict[str, dict[str, Any]]
"""The figures of a benchmark by the names of their cases: the fields of `harness.Figure`."""


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
    """Run a benchmark in both checkouts, again while a figure is worse, and return the cases of this one."""
    before: Figures = {}
    after: Figures = {}
    cases: list[Compared] = []
    for number in range(rounds):
        if number % 2 == 0:
            before = better(before, figures(folder, name))
        after = better(after, figures(ROOT, name))
        if number % 2 == 1:
            before = better(before, figures(folder, name))
        cases = list(paired(name, before, after))
        if not any(case.ratio is not None and case.ratio > WORSE for case in cases):
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


def better(first: Figures, second: Figures) -> Figures:
    """Return every case with the better of its two figures."""
    return {
        name: min((some[name] for some in (first, second) if name in some), key=lambda figure: float(figure["best"]))
        for name in {**first, **second}
    }


def paired(benchmark: str, before: Figures, after: Figures) -> Iterator[Compared]:
    """Yield the cases of `after` beside those of the same name."""
    for name, figure in after.items():
        old = before.get(name, {})
        yield Compared(
            benchmark, name, figure["unit"], old.get("best"), figure["best"],
            figure["goal"], figure["goal_is"], old.get("compared"), figure["compared"],
        )  # fmt: skip


def line(case: Compared) -> str:
    """Return the row of the table."""
    before = "" if case.before is None else f"{case.before:.3f}"
    ratio = "" if case.ratio is None else f"{case.ratio:.2f}{'  WORSE' if case.ratio > WORSE else ''}"
    goal = "" if case.goal is None else f"  {case.reached:.2f} {case.goal_is} (at most {case.goal:g})"
    return f"{case.name:60} {before:>12} {case.after:12.3f} {case.unit:2} {ratio}{goal}{'  MISSED' * case.missed}"


def joined(path: Path, newer: Comparison) -> Comparison:
    """Return a comparison with the cases of the other benchmarks that a file has of the same two commits."""
    if not path.exists():
        return newer
    older = read_comparison(path)
    if (older.before, older.after) != (newer.before, newer.after):
        return newer
    measured = {case.benchmark for case in newer.cases}
    kept = [case for case in older.cases if case.benchmark not in measured]
    return replace(newer, cases=sorted([*kept, *newer.cases], key=lambda case: case.benchmark))


if __name__ == "__main__":
    main()
