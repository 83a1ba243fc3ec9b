"""`dmc terminal`: on a screen if there is one, else as a filter."""

from __future__ import annotations

import asyncio
import sys

from dmc41x3.cli import connection
from dmc41x3.cli.console import OutputSettings, Site
from dmc41x3.cli.terminal import pipe


def terminal(address: str, settings: OutputSettings) -> int:
    """Run the terminal until the user or the input ends it; return the exit code. Raises `ConnectFailed`."""
    return asyncio.run(_terminal(connection.meant(address, settings), settings.site))


async def _terminal(place: str, site: Site) -> int:
    async with connection.reached(place, site) as way:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            return await pipe.converse(way, place, sys.stdin, site)
        from dmc41x3.cli.terminal import screen

        return await screen.converse(way, place, site)
