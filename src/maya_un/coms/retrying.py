"""Keep a connection: connect, use it from several coroutines, and connect again after a pause that grows."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from random import Random
from typing import Any

from maya_un.errors import MayaError, SessionTakenOver

FIRST_PAUSE = 0.1
"""Pause after the first failure [s]."""

LONGEST_PAUSE = 10.0
"""[s]"""

_AGAIN = 0.5
"""A task that does not end after its cancellation is cancelled again after this time [s]."""

GOOD = 5.0
"""After a connection of this duration, the pauses start again from the shortest [s]."""


async def keep(use: Callable[[], Awaitable[None]], failed: Callable[[MayaError], None], rng: Random) -> None:
    """Call `use` again and again, and `failed` with each `MayaError` that it raises; ends only by being cancelled.

    After `SessionTakenOver` it does not call `use` again: two programs with the same name would take the session from
    each other for ever, and both would carry out commands.

    The pauses double, and each is drawn from its upper half, so that many clients of a server do not come together.
    """
    loop, pause = asyncio.get_running_loop(), FIRST_PAUSE
    while True:
        began = loop.time()
        try:
            await use()
        except MayaError as error:
            if being_cancelled():  # the error of closing the connection stands before the cancellation
                raise asyncio.CancelledError from error
            failed(error)
            if isinstance(error, SessionTakenOver):  # the other program would lose the session to this one in turn
                await asyncio.Event().wait()
        if loop.time() - began > GOOD:
            pause = FIRST_PAUSE
        await asyncio.sleep(pause * rng.uniform(0.5, 1.0))
        pause = min(2.0 * pause, LONGEST_PAUSE)


def being_cancelled() -> bool:
    """Tell whether somebody cancelled the task that runs now."""
    task = asyncio.current_task()
    return task is not None and task.cancelling() > 0


async def first_to_end(*work: Awaitable[Any]) -> None:
    """Run coroutines beside each other until one ends, then cancel the others; raises what it raises."""
    tasks = [asyncio.ensure_future(one) for one in work]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        left = set(tasks)
        while left:  # wait_for of Python 3.11 loses a cancellation that comes together with its result
            for task in left:
                task.cancel()
            _, left = await asyncio.wait(left, timeout=_AGAIN)
        await asyncio.gather(*tasks, return_exceptions=True)
