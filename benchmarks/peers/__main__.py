"""Measures everything and stores it: `scripts/bench --peers [--quick] [--output FILE]`."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TypeVar

from benchmarks.computer import computer
from benchmarks.peers import commands, kinematics, queues, streams, timing, work
from benchmarks.peers.contest import Contest, rounded, rows
from scripts.performance_results import RESULTS, Growth, Motion, Row, Run, read, write

PACKAGES = (
    "maya-un", "numpy", "bluesky-queueserver", "ikpy", "persist-queue", "pin", "roboticstoolbox-python", "ruckig",
    "toppra", "uvicorn", "websockets",
)  # fmt: skip
"""The packages whose versions are stored."""

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Sizes:
    """How much is measured: rounds of every contest, readers of the stream's, and the sizes of growth."""

    rounds: int
    readers: int
    tasks: tuple[int, ...]
    waiting: tuple[int, ...]
    streams: tuple[int, ...]
    axes: tuple[int, ...]


FULL = Sizes(
    rounds=15,
    readers=100,
    tasks=(2, 20, 200, 500, 2_500),
    waiting=(1, 10, 100, 1_000, 10_000, 100_000),
    streams=(1, 10, 30, 100, 300),
    axes=(1, 2, 3, 4, 6, 8),
)
QUICK = Sizes(rounds=3, readers=10, tasks=(2, 20), waiting=(1, 100, 1_000), streams=(1, 10), axes=(1, 3, 8))


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/bench --peers", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer sizes and rounds")
    parser.add_argument("--output", type=Path, default=RESULTS, help="the file to add the run to")
    asked = parser.parse_args()
    run = measured(QUICK if asked.quick else FULL, quick=asked.quick)
    kept = read(asked.output) if asked.output.exists() else []
    write([*kept, run], asked.output)
    for program, reason in run.left_out.items():
        print(f"{program} is left out: {reason}")
    print(f"stored in {asked.output}; scripts/docs makes the page and its pictures")
    sys.exit(1 if any(row.error for row in run.rows) else 0)


def measured(sizes: Sizes, *, quick: bool) -> Run:
    """Measure everything and return it; every figure is told once it is there."""
    blank = Run(datetime.now(UTC).date().isoformat(), quick, computer(), versions())
    found = list(told(row for contest in _contests(sizes, blank.left_out) for row in rows(*contest)))
    with tempfile.TemporaryDirectory() as folder:
        growth = list(told(map(_short, _growth(sizes, Path(folder), blank.left_out))))
    motions = list(told(map(_rounded, work.motions())))
    return replace(blank, rows=found, growth=growth, motions=motions)


def told(found: Iterable[T]) -> Iterator[T]:
    """Yield what was found, and say it."""
    for one in found:
        print(_text(one), file=sys.stderr, flush=True)
        yield one


def _text(found: object) -> str:
    match found:
        case Row(error=""):
            return f"{found.work}: {found.program}: {found.best:g} {found.unit}, {found.ratio:g} × Maya"
        case Row():
            return f"{found.work}: {found.program}: ERROR: {found.error}"
        case Growth():
            return f"{found.size} {found.subject}: {found.program}: {found.cost:g} {found.unit}"
        case Motion():
            return f"{found.name}: {found.carried_out:g} s, {found.carried_out / found.least:.4f} × the least time"
        case _:
            return str(found)


def _contests(sizes: Sizes, left_out: dict[str, str]) -> Iterator[tuple[Contest, int]]:
    for contest in (*kinematics.contests(left_out), *timing.contests(left_out)):
        yield contest, 3 * sizes.rounds
    readers = streams.Readers(sizes.readers)
    try:
        yield readers.contest(), sizes.rounds
    finally:
        readers.close()
    with tempfile.TemporaryDirectory() as folder, queues.stores(Path(folder), left_out) as opened:
        for contest in queues.contests(opened):
            yield contest, 3 * sizes.rounds
    with commands.contests(left_out) as contests:
        for contest in contests:
            yield contest, sizes.rounds


def _growth(sizes: Sizes, folder: Path, left_out: dict[str, str]) -> Iterator[Growth]:
    yield from work.tasks(sizes.tasks)
    yield from queues.growth(folder, sizes.waiting, left_out)
    yield from streams.growth(sizes.streams)
    yield from work.axes(sizes.axes)


def _short(growth: Growth) -> Growth:
    (cost,) = rounded([growth.cost])
    return replace(growth, cost=cost)


def _rounded(motion: Motion) -> Motion:
    least, carried_out, alone, off = rounded([motion.least, motion.carried_out, motion.alone, motion.off])
    return Motion(motion.name, least, carried_out, alone, off)


def versions() -> dict[str, str]:
    """Return the versions of the packages that are installed here."""
    found: dict[str, str] = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


if __name__ == "__main__":
    main()
