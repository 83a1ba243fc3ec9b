"""Ctrl-C, SIGTERM and a closed terminal: for coroutines that wait for them, and for blocking requests."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def on_end(callback: Callable[[], object], *kinds: signal.Signals) -> Iterator[None]:
    """Call `callback` in the running loop when one of the signals arrives, during the block.

    It must run in the main thread, because Python handles signals there.
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
    """Handle SIGTERM and a closed terminal as Ctrl-C; does nothing outside the main thread.

    A user who sends "pick" and leaves before its end no longer watches the robot.
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
