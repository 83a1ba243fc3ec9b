"""The end of `maya up`: on the path, or after the step under way; a second word does not wait."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

from dmc41x3.cli.signals import on_end
from maya_un.assembly import Stack
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.cli.words import word
from maya_un.errors import MayaError
from maya_un.values import Mode

FINISH = signal.SIGUSR1
"""What `maya down --finish` sends."""

_MOVING = {Mode.MOVING, Mode.HOMING, Mode.STOPPING}
_ORDINARY = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class ShutdownRequest:
    """How the program is to end: `asked` is set with the first word, `hurried` with a second.

    With `finish` the step under way is carried to its end, also where somebody asks for that.
    """

    def __init__(self, *, finish: bool) -> None:
        self.finish = finish
        self.asked = asyncio.Event()
        self.hurried = asyncio.Event()

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Listen to signals while the block runs; must run in the main thread."""
        with ExitStack() as signals:
            signals.enter_context(on_end(self._end, *_ORDINARY))
            signals.enter_context(on_end(self._finish, FINISH))
            yield

    def _end(self) -> None:
        (self.hurried if self.asked.is_set() else self.asked).set()

    def _finish(self) -> None:
        if not self.asked.is_set():
            self.finish = True
        self.asked.set()


async def brought_to_rest(running: Stack, ending: ShutdownRequest, settings: OutputSettings) -> None:
    """End what runs and return when the robot is at rest and all is written down; says which way it ends."""
    under_way = running.process.running
    finish = ending.finish and under_way is not None
    if not settings.json:
        output.say(word(_words(finish=finish, job=under_way), settings.language, job=under_way))
    if finish:
        await _finished(running, ending, settings)
    else:
        await running.process.close()
    await _come_to_rest(running)


def _words(*, finish: bool, job: int | None) -> str:
    if job is None:
        return "ending"
    return "ending_finish" if finish else "ending_stop"


async def _finished(running: Stack, ending: ShutdownRequest, settings: OutputSettings) -> None:
    """Carry the step under way to its end, unless a second word comes."""
    closing = asyncio.ensure_future(running.process.close(finish=True))
    hurrying = asyncio.ensure_future(ending.hurried.wait())
    await asyncio.wait({closing, hurrying}, return_when=asyncio.FIRST_COMPLETED)
    if not closing.done():
        if not settings.json:
            output.say(word("ending_hurried", settings.language))
        await running.process.close()
    hurrying.cancel()
    await closing


async def _come_to_rest(running: Stack) -> None:
    """Stop on the path and wait for it; a machine that cannot be told any more is left to itself."""
    if running.controller.state.mode not in _MOVING:
        return
    with suppress(MayaError, TimeoutError):
        report = await running.service.stop()
        async with asyncio.timeout(report.duration + 5.0):
            async for state in running.controller.watch():
                if state.mode not in _MOVING:
                    return
