"""Work for a worker in the tests: quick, endless, greedy, deadly."""

from __future__ import annotations

import os
import signal
from collections.abc import Generator
from typing import Any

from maya_un.errors import InvalidJob

_prepared: list[int] = []


def prepare(number: int) -> None:
    """Keep a number."""
    _prepared.append(number)


def add(one: int, other: int) -> Generator[None, None, int]:
    """Return a sum, and what was prepared."""
    yield
    return one + other + sum(_prepared)


def pieces(count: int) -> Generator[Any, None, str]:
    """Hand over so many pieces."""
    for number in range(count):
        yield [number]
    return "end"


def refused() -> Generator[None, None, None]:
    """Be refused."""
    yield
    raise InvalidJob(key="steps.3", reason="no")


def broken() -> Generator[None, None, None]:
    """Have a defect."""
    yield
    raise ZeroDivisionError


def endless() -> Generator[None, None, None]:
    """Never end, but let others have their turn."""
    while True:
        sum(range(10_000))
        yield


def greedy() -> Generator[None, None, int]:
    """Want more memory than there may be."""
    yield
    return len(bytearray(1 << 31))


def deadly() -> Generator[None, None, None]:
    """End the worker."""
    yield
    os.kill(os.getpid(), signal.SIGKILL)


def number() -> Generator[None, None, int]:
    """Return the number of the process."""
    yield
    return os.getpid()
