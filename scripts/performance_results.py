"""The results of `scripts/bench --peers`, as they are stored in benchmarks/results/peers.json.

The page docs/explanation/performance.md and its pictures are made from this file.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import TypeAdapter

RESULTS = Path(__file__).resolve().parent.parent / "benchmarks" / "results" / "peers.json"

KEPT = 2
"""So many runs are kept: the page compares their ratios."""

OURS = "Maya"
"""The program that all others are compared with."""

BARE = "python -c pass"
"""Stands beside a command line for a Python that does nothing; a user picks it for no work."""


@dataclass(frozen=True, slots=True)
class Computer:
    """The computer of a run.

    `load` is the mean number of processes that wanted to run in the last 1, 5 and 15 minutes before it. `compiled` is
    whether Maya's hot modules ran as compiled code.
    """

    processor: str
    cores: int
    system: str
    python: str
    load: tuple[float, float, float]
    compiled: bool


@dataclass(frozen=True, slots=True)
class Row:
    """The cost of one piece of work with one program: `best`, `median` and `worst` of `rounds` samples, in `unit`.

    `ratio` is this cost over Maya's in the same run. `difference` is the greatest difference from Maya's answer, in
    `answered_in`, and at most `tolerance`. With an `error` there are no figures.
    """

    subject: str
    work: str
    program: str
    unit: str
    answered_in: str
    tolerance: float
    best: float | None = None
    median: float | None = None
    worst: float | None = None
    rounds: int = 0
    ratio: float | None = None
    difference: float | None = None
    error: str = ""


@dataclass(frozen=True, slots=True)
class Growth:
    """The cost of a program for work of the size `size`: `cost` in `unit`."""

    subject: str
    program: str
    size: int
    cost: float
    unit: str


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion: the least time that the axes allow, the time of the twin, each axis alone [s]; `off` its way [m]."""

    name: str
    least: float
    carried_out: float
    alone: float
    off: float


@dataclass(frozen=True, slots=True)
class Run:
    """One run: its date (ISO 8601), the computer, the versions of all programs, and what it found.

    `left_out` has a sentence for every program that could not be measured. `quick` runs have fewer sizes and rounds.
    """

    date: str
    quick: bool
    computer: Computer
    versions: dict[str, str]
    rows: list[Row] = field(default_factory=list)
    growth: list[Growth] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)


_RUNS = TypeAdapter(list[Run])


def read(path: Path = RESULTS) -> list[Run]:
    """Return the stored runs, the newest last; raises pydantic's `ValidationError` for a file of another form."""
    return _RUNS.validate_json(path.read_bytes())


def write(runs: Sequence[Run], path: Path = RESULTS) -> None:
    """Store the newest runs."""
    path.write_bytes(_RUNS.dump_json(list(runs)[-KEPT:], indent=1) + b"\n")


def number(value: float | None) -> str:
    """Return a figure with three digits, and more where it is greater than 1000."""
    assert value is not None
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:,.0f}".replace(",", " ")
