"""Long lists are made a slice at a time, so that nobody who reads holds the robot's loop."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import TypeVar

S = TypeVar("S")
T = TypeVar("T")

SLICE = 100
"""Number of entries that are made at a time: about 1 ms of work."""


class Slices:
    """Gives one reader after the other a `turn`: those that come together hold the loop no longer than one alone."""

    def __init__(self) -> None:
        self.turn = asyncio.Lock()

    async def each(self, make: Callable[[S], T], things: Sequence[S]) -> list[T]:
        """Return what `make` returns for each of some things, made in a turn."""
        async with self.turn:
            return await made(make, things)


async def made(make: Callable[[S], T], things: Sequence[S]) -> list[T]:
    """Return what `make` returns for each of some things; others use the loop between two slices."""
    found: list[T] = []
    for begin in range(0, len(things), SLICE):
        if begin:
            await asyncio.sleep(0)
        found += map(make, things[begin : begin + SLICE])
    return found
