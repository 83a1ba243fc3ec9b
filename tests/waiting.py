"""Waiting in real time for a condition, with a pause between two looks: a busy test would slow what it waits for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Event
from time import monotonic

PAUSE = 0.05
"""Between two looks [s]."""


def eventually(
    fact: Callable[[], object],
    what: str,
    within: float = 120.0,
    told: Callable[[], str] = str,
    *,
    pause: float = PAUSE,
) -> None:
    """Return as soon as something is so, looking again after each `pause`; fails where that takes longer [s]."""
    end = monotonic() + within
    never = Event()
    while not fact():
        assert monotonic() < end, f"never came: {what}\n{told()}"
        never.wait(pause)


async def until(fact: Callable[[], object]) -> None:
    """Wait in a loop of real time until something is so."""
    loop = asyncio.get_running_loop()
    while not fact():
        over: asyncio.Future[None] = loop.create_future()
        loop.call_later(PAUSE / 10, over.set_result, None)
        await over
