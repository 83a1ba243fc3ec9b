"""Letting virtual time pass in a test."""

from __future__ import annotations

import asyncio

from dmc41x3.loops import JumpingLoop


async def elapse(seconds: float) -> None:
    """Let `seconds` of virtual time pass, everything due in between included; it takes no time.

    Fails in any other loop: a test never waits by the wall clock for something to settle.
    """
    loop = asyncio.get_running_loop()
    assert isinstance(loop, JumpingLoop), "elapse() is for virtual time"
    over: asyncio.Future[None] = loop.create_future()
    loop.call_later(seconds, lambda: over.done() or over.set_result(None))  # it may have been cancelled meanwhile
    await over


async def turn() -> None:
    """Let any loop do once what is ready; no time passes."""
    loop = asyncio.get_running_loop()
    over: asyncio.Future[None] = loop.create_future()
    loop.call_soon(over.set_result, None)
    await over
