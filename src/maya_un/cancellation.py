"""Cancellation of work that moves the robot: every cancel returns at rest, even after further cancels.

A second cancel must not end a coroutine that waits for moving axes. Otherwise its caller considers the robot idle
while the axes still brake. Every such wait goes through `run_to_rest` or `run_to_end`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, TypeVar

T = TypeVar("T")


async def run_to_rest(work: Awaitable[T], cancel: Callable[[], object] | None = None) -> T:
    """Return the result of `work`; raise what it raises.

    The first cancel of the caller cancels `work`, by `cancel` if given. Further cancels have no effect.
    In either case this returns only after the end of `work`, and then raises `asyncio.CancelledError`.
    """
    task = asyncio.ensure_future(work)
    if await wait_for_end(task, cancel or task.cancel):
        if not task.cancelled():
            task.exception()  # the caller gets the cancellation; the loop need not report the error
        raise asyncio.CancelledError
    return task.result()


async def run_to_end(work: Awaitable[T]) -> T:
    """Return the result of `work`, shielded from cancels of the caller; they take effect after its end.

    Raises what `work` raises, before any cancel.
    """
    task = asyncio.ensure_future(work)
    cancelled = await wait_for_end(task)
    result = task.result()
    if cancelled:
        raise asyncio.CancelledError
    return result


async def wait_for_end(task: asyncio.Future[Any], cancel: Callable[[], object] | None = None) -> bool:
    """Wait for the end of `task`, and return whether the caller was cancelled; call `cancel` at the first cancel.

    A task that is being cancelled already is not cancelled again.
    """
    cancelled = False
    while not task.done():
        try:
            await asyncio.wait({task})
        except asyncio.CancelledError:
            if cancel is not None and not cancelled and not is_cancelling(task):
                cancel()
            cancelled = True
    return cancelled


def cancel_once(task: asyncio.Future[Any] | None) -> None:
    """Cancel a task; a second cancel would cut short its wait for the axes to come to rest."""
    if task is not None and not is_cancelling(task):
        task.cancel()


def is_caller_cancelled() -> bool:
    """Return whether the running task was cancelled, and not only the awaited one."""
    this = asyncio.current_task()
    return this is not None and this.cancelling() > 0


def is_cancelling(task: asyncio.Future[Any]) -> bool:
    """Return whether a cancel of `task` is requested already."""
    return isinstance(task, asyncio.Task) and task.cancelling() > 0
