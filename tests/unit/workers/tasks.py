"""Work for a worker in the tests: quick, endless, greedy, deadly."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Generator
from types import GeneratorType
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
    """Yield `count` pieces."""
    for number in range(count):
        yield [number]
    return "end"


def refused() -> Generator[None, None, None]:
    """Raise the error of a refused job."""
    yield
    raise InvalidJob(key="steps.3", reason="no")


def broken() -> Generator[None, None, None]:
    """Raise the error of a defect."""
    yield
    raise ZeroDivisionError


def endless(data: bytes = b"") -> Generator[None, None, None]:
    """Never end, but let others have their turn."""
    del data
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


def length(data: bytes) -> Generator[None, None, int]:
    """Return a length."""
    yield
    return len(data)


def under_way() -> Generator[None, None, int]:
    """Return how many requests for `endless` the process holds."""
    yield
    generators = (one for one in gc.get_objects() if isinstance(one, GeneratorType))
    return sum(one.gi_code is endless.__code__ for one in generators)


class Unreadable:
    """Can be read in the process that made it, and in no other."""

    def __reduce__(self) -> tuple[Any, ...]:
        return _only_in, (os.getpid(),)


def _only_in(process: int) -> None:
    if os.getpid() != process:
        raise ArithmeticError("it is unreadable")


def unreadable() -> Generator[None, None, Unreadable]:
    """Return what the other side cannot read."""
    yield
    return Unreadable()
