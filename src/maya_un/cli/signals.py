"""Ctrl-C and SIGTERM as something a coroutine can wait for."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def on_end(wish: Callable[[], object], *kinds: signal.Signals) -> Iterator[None]:
    """Call `wish` in the running loop when one of the signals comes, while the block runs.

    Must run in the main thread, as signals do.
    """
    loop = asyncio.get_running_loop()
    for kind in kinds:
        loop.add_signal_handler(kind, wish)
    try:
        yield
    finally:
        for kind in kinds:
            loop.remove_signal_handler(kind)


async def asked_to_end() -> None:
    """Wait for Ctrl-C or SIGTERM."""
    asked = asyncio.Event()
    with on_end(asked.set, signal.SIGINT, signal.SIGTERM):
        await asked.wait()
