"""Random campaigns: how many cases, drawn from which seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random
from typing import TypeVar

Drawn = TypeVar("Drawn")


@dataclass(slots=True)
class Ledger:
    """The size of every campaign that ran, by test, for the summary."""

    sizes: dict[str, int] = field(default_factory=dict[str, int])


@dataclass(frozen=True, slots=True)
class Campaign:
    """Size and seed of one test's campaign: few cases in CI, all of them with `./test --long`.

    `seed` is the whole run's.
    """

    name: str
    seed: int
    long: bool
    ledger: Ledger

    def size(self, *, ci: int, long: int) -> int:
        """Return how many cases to run, and note it for the summary."""
        chosen = long if self.long else ci
        self.ledger.sizes[self.name] = chosen
        return chosen

    def some(self, cases: Sequence[Drawn], *, ci: int) -> list[Drawn]:
        """Return `ci` of the cases, drawn, and with `./test --long` all of them in a drawn order."""
        return self.rng().sample(cases, self.size(ci=ci, long=len(cases)))

    def rng(self, case: int = 0) -> Random:
        """Return a generator that depends on the run's seed, the test and the case, and on nothing else.

        So no two tests draw the same numbers, and a test run alone draws what it draws in the whole run.
        """
        return Random(f"{self.seed} {self.name} {case}")
