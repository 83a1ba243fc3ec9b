"""Connections end when they are cancelled."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from maya_un.coms.transport import first_to_end


async def test_work_that_loses_its_first_cancellation_ends_too() -> None:
    async def stubborn() -> None:
        with suppress(asyncio.CancelledError):
            await asyncio.Event().wait()
        await asyncio.Event().wait()

    async def short() -> None:
        await asyncio.sleep(0)

    async with asyncio.timeout(30.0):
        await first_to_end(stubborn(), short())
