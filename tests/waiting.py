"""Waiting in real time for a condition, with a pause between two looks: a busy test would slow what it waits for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Event
from time import monotonic

PAUSE = 0.05
"""Between two looks [s]."""


def eventually(fact: Callable[[], object], what: str, within: float = 120.0, told: Callable[[], str] = str) -> None:
    """Return as soon as something is so, looking again and again; fails where that takes longer [s]."""
    end = monotonic() + within
    pause = Event()
    while not fact():
        assert monotonic() < end, f"never came: {what}\n{told()}"
        pause.wait(PAUSE)


async def until(fact: Callable[[], object]) -> None:
    """Wait in a loop of real time until something is so."""
    loop = asyncio.get_running_loop()
    while not fact():
        over: asyncio.Future[None] = loop.create_future()
        loop.call_later(PAUSE / 10, over.set_result, None)
        await over
