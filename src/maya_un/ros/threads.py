"""Work that blocks, in threads of its own; what threads tell goes to the loop.

A thread per piece of work rather than a pool of them: a stop must not wait until a place is free, and a thread that
hangs in somebody else's answer must not keep the program from ending.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

T = TypeVar("T")


class LoopCalls:
    """Has calls made in a loop, in the order they are asked for, from any thread; once the loop is closed, none."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop

    def __call__(self, call: Callable[..., object], *args: object) -> None:
        """Have `call` made soon."""
        with suppress(RuntimeError):  # the loop is closed: nobody is there to be told
            self._loop.call_soon_threadsafe(call, *args)


async def in_thread(work: Callable[[], T], name: str = "maya-ros") -> T:
    """Do `work` in a thread and return its result; being cancelled, this no longer waits for it."""
    loop = asyncio.get_running_loop()
    future: asyncio.Future[T] = loop.create_future()
    post = LoopCalls(loop)

    def run() -> None:
        try:
            result = work()
        except BaseException as error:  # noqa: BLE001 - whatever it is, it is raised where somebody waits
            post(_fail, future, error)
        else:
            post(_settle, future, result)

    threading.Thread(target=run, name=name, daemon=True).start()
    return await future


def _settle(future: asyncio.Future[T], result: T) -> None:
    if not future.done():
        future.set_result(result)


def _fail(future: asyncio.Future[T], error: BaseException) -> None:
    if not future.done():
        future.set_exception(error)
