"""How long the command line takes to start, over a Python that does nothing, and `maya up` until it is ready."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from statistics import median

from harness import Case, Goal, Sample, measure, report, timed
from service import MAYA, alone, service

BARE = "python -c pass"


def command(environment: Mapping[str, str], *words: str) -> Callable[[], object]:
    """Return a run of a command; what it says, and whether it succeeds, is not looked at here."""
    return lambda: subprocess.run(words, env=environment, capture_output=True, check=False)


def maya(environment: Mapping[str, str], *words: str) -> Sample:
    """Return a sample of the time a `maya` command takes [s]."""
    return timed(command(environment, MAYA, *words))


def ready() -> float:
    """Return the time from the start of a `maya up` until it is ready [s]."""
    start = time.perf_counter()
    with service():
        return time.perf_counter() - start


def main() -> None:
    goal = Goal(100.0, to=BARE, kind="over")
    with service() as running, tempfile.TemporaryDirectory() as folder:
        nothing = alone(folder)
        cases = [
            Case(BARE, timed(command(nothing, sys.executable, "-c", "pass")), "ms"),
            Case("maya --help", maya(nothing, "--help"), "ms", goal),
            Case("maya status, nothing running", maya(nothing, "status"), "ms", goal),
            Case("maya status, robot running", maya(running.environment, "status"), "ms", goal),
            Case("maya stop, nothing running", maya(nothing, "stop"), "ms", goal),
            Case("maya stop, robot running", maya(running.environment, "stop"), "ms", goal),
            Case("maya run --help", maya(nothing, "run", "--help"), "ms"),
            Case("maya fk 0.5 1.5 1.5", maya(nothing, "fk", "0.5", "1.5", "1.5"), "ms", goal),
            Case("maya ik 0.5 1.1 0.9", maya(nothing, "ik", "0.5", "1.1", "0.9"), "ms", goal),
            Case("maya reach 0.5 1.1 0.9", maya(nothing, "reach", "0.5", "1.1", "0.9"), "ms", goal),
        ]
        figures = measure(cases, rounds=15, by=median)
    figures += measure([Case("maya up, ready", ready, "ms", Goal(1000.0))], rounds=5)
    report(figures)


if __name__ == "__main__":
    main()
