"""`maya dmc terminal`: on a screen where there is one, else as a filter."""

from __future__ import annotations

import asyncio
import sys

from maya_un.cli.dmc_tools import dial
from maya_un.cli.dmc_tools.terminal import pipe
from maya_un.cli.settings import OutputSettings


def terminal(address: str, settings: OutputSettings) -> int:
    """Talk to a controller until the person or the input ends it; return the exit code. Raises `ConnectFailed`."""
    return asyncio.run(_terminal(dial.meant(address, settings)))


async def _terminal(place: str) -> int:
    async with dial.reached(place) as way:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            return await pipe.converse(way, place, sys.stdin)
        from maya_un.cli.dmc_tools.terminal import screen

        return await screen.converse(way, place)
