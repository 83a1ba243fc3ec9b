"""Generators run to their end, as a worker runs them."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

T = TypeVar("T")


def finished(work: Generator[Any, None, T]) -> T:
    """Return what work returns."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value
