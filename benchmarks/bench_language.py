"""The time of the twin for a command: received as bytes, executed, answered, hundreds in a row without a wire.

The goal is 100 000 simple commands a second. "new each time" commands have other numbers in every line, so that
nothing prepared for one serves the next.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import count

from harness import Case, Goal, Sample, measure, report

from dmc41x3.twin.machine import VirtualDmc
from dmc41x3.twin.plant import BenchPlant

COMMANDS = 500
"""As many as there is room for segments."""

SIMPLE = ("x=5", "x=x+1", "MG _TPA", "MG x", "PRA=100", "SP 1000", "a[0]=x*2", "TPA", "TC")
OTHERS = ("TP", "PR 1,2,3", "a[a[0]+1]=@ABS[x-(3*2)]", 'MG "x is ",x{F4.2},_TPA', "QR", "TV;TE;TS")
NEW = ("x={}", "PA {},{}", "LI {},1,1", "MG x+{}")


def sampled(lines: Callable[[], bytes]) -> Sample:
    """Return a sample of the time of one of the commands that `lines` makes [s], on a controller of three axes."""
    machine = VirtualDmc(BenchPlant())
    handle = machine.connect()
    assert handle is not None
    machine.receive(handle, b"SH;x=1;DM a[9];LM ABC\r", 0.0)

    def sample() -> float:
        data = lines()
        start = time.perf_counter()
        machine.receive(handle, data, 0.0)
        took = time.perf_counter() - start
        assert machine.unit.error_code == 0, data[:40]
        machine.receive(handle, b"CS S\r", 0.0)
        return took / COMMANDS

    return sample


def case(command: str, goal: Goal | None = None) -> Case:
    """Measure the same command over and over."""
    data = f"{command}\r".encode() * COMMANDS
    return Case(command, sampled(lambda: data), goal=goal)


def fresh(command: str) -> Case:
    """Measure a command whose numbers are new in every line."""
    numbers = count(1)

    def lines() -> bytes:
        return b"".join(f"{command}\r".replace("{}", str(next(numbers))).encode() for _ in range(COMMANDS))

    return Case(f"{command}, new each time", sampled(lines))


def main() -> None:
    ten = Goal(10.0)
    report(measure([*(case(command, ten) for command in SIMPLE), *map(case, OTHERS), *map(fresh, NEW)], rounds=9))


if __name__ == "__main__":
    main()
