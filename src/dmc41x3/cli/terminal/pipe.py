"""The terminal without a screen: lines from standard input, answers to standard output."""

from __future__ import annotations

import asyncio
import sys
from typing import TextIO

from dmc41x3.cli import console
from dmc41x3.cli.connection import Dial
from dmc41x3.cli.console import Site
from dmc41x3.cli.terminal.session import TerminalSession, stop_directly
from dmc41x3.cli.terminal.words import carry_out

QUIT = {":quit", ":q"}
"""Lines that end a session."""


class PipeOutput:
    """Prints answers unchanged; messages and notes go to standard error, so that a script can separate them."""

    def answer(self, text: str) -> None:
        """Print what the controller printed."""
        console.say(text.replace("\r", ""))

    def refused(self, text: str) -> None:
        """Print a refusal in place of the answer."""
        console.say(text)

    def message(self, text: str) -> None:
        """Print a message of a program to standard error."""
        _aside(f"message: {text}")

    def note(self, text: str) -> None:
        """Print a note of the terminal to standard error."""
        _aside(text)

    def trouble(self, text: str) -> None:
        """Print an error to standard error."""
        _aside(text)


def _aside(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


async def converse(dial: Dial, place: str, lines: TextIO, site: Site) -> int:
    """Execute every line of a text in order; return the exit code.

    The exit code is 1 if anything was refused or the link was lost. Raises `ConnectFailed`.
    """
    session = TerminalSession(dial, place, PipeOutput(), stop_directly(place), site)
    work: asyncio.Task[None] | None = None
    try:
        await session.connect()
        work = asyncio.create_task(session.work(carry_out))
        while (line := await asyncio.to_thread(lines.readline)) and line.strip() not in QUIT:
            session.enter(line)
            await session.answered()
        await session.settled()
    finally:
        if work is not None:
            work.cancel()
            await asyncio.wait({work})
        await session.close()
    return console.FAILED if session.refused or session.trouble else console.DONE
