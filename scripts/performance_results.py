"""The results of `scripts/bench --peers` and `scripts/bench --against`, as they are stored in benchmarks/results.

The page docs/explanation/performance.md and its pictures are made from these files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import TypeAdapter

FOLDER = Path(__file__).resolve().parent.parent / "benchmarks" / "results"

RESULTS = FOLDER / "peers.json"

GOALS = FOLDER / "goals.json"
"""This checkout beside an older one."""

SERVICES = FOLDER / "services.json"
"""The same for the benchmarks that start programs which serve others."""

COMPILED = FOLDER / "compiled.json"
"""Compiled modules beside the same ones as source."""

WORSE = 1.05
"""A figure is worse than the one before if it is more than this multiple of it, and not by chance."""

CHANCE = 0.01
"""A difference is due to chance if it would come up with this probability or more in two equal checkouts."""

KEPT = 2
"""Number of runs that are kept: the page compares their ratios."""

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


@dataclass(frozen=True, slots=True)
class Compared:
    """A case of a benchmark in two checkouts, in `unit`; `before` is None if it is a new case.

    Compared are the best of all samples, or their medians if the benchmark asks for it. `chance` is the probability
    that measurements of two equal checkouts differ as much (Mann-Whitney test, one-sided), None if unknown.

    A `goal` is the most that `goal_is` may be: this figure, or what becomes of it beside another case ("× NAME", "ms
    over NAME"), which is `reached` now and was `reached_before`.
    """

    benchmark: str
    name: str
    unit: str
    before: float | None
    after: float
    goal: float | None = None
    goal_is: str | None = None
    reached_before: float | None = None
    reached: float | None = None
    chance: float | None = None

    @property
    def ratio(self) -> float | None:
        """This figure divided by the one before."""
        return self.after / self.before if self.before else None

    @property
    def greater(self) -> bool:
        """Whether this figure is more than `WORSE` times the one before."""
        return self.ratio is not None and self.ratio > WORSE

    @property
    def worse(self) -> bool:
        """Whether this figure is greater, and not by chance."""
        return self.greater and (self.chance is None or self.chance < CHANCE)

    @property
    def missed(self) -> bool:
        """Whether there is a goal that is not reached."""
        return self.goal is not None and self.reached is not None and self.reached > self.goal


@dataclass(frozen=True, slots=True)
class Comparison:
    """One run of benchmarks in two checkouts in turn: its date (ISO 8601), the computer, the commits, the cases."""

    date: str
    computer: Computer
    before: str
    after: str
    cases: list[Compared]


_RUNS = TypeAdapter(list[Run])


_COMPARISON = TypeAdapter(Comparison)


def read_comparison(path: Path) -> Comparison:
    """Return a stored comparison; raises pydantic's `ValidationError` for a file of another form."""
    return _COMPARISON.validate_json(path.read_bytes())


def write_comparison(comparison: Comparison, path: Path) -> None:
    """Store a comparison."""
    path.write_bytes(_COMPARISON.dump_json(comparison, indent=1) + b"\n")


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
