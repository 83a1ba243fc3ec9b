"""Ctrl-C, SIGTERM and a closed terminal: for coroutines to wait for, and for what is said in one breath."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def on_end(callback: Callable[[], object], *kinds: signal.Signals) -> Iterator[None]:
    """Call `callback` in the running loop when one of the signals comes, while the block runs.

    Must run in the main thread, as signals do.
    """
    loop = asyncio.get_running_loop()
    for kind in kinds:
        loop.add_signal_handler(kind, callback)
    try:
        yield
    finally:
        for kind in kinds:
            loop.remove_signal_handler(kind)


@contextmanager
def as_ctrl_c() -> Iterator[None]:
    """Have SIGTERM and a closed terminal do what Ctrl-C does, in the thread that signals come to.

    A person who sends "pick" and leaves before its end does not watch it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    kinds = (signal.SIGTERM, signal.SIGHUP)
    before = [(kind, signal.signal(kind, _interrupt)) for kind in kinds if signal.getsignal(kind) != signal.SIG_IGN]
    try:
        yield
    finally:
        for kind, handler in before:
            signal.signal(kind, handler)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


async def asked_to_end() -> None:
    """Wait for Ctrl-C or SIGTERM."""
    asked = asyncio.Event()
    with on_end(asked.set, signal.SIGINT, signal.SIGTERM):
        await asked.wait()
