"""The end of `maya up`, on the path or after the step under way, and the messages to systemd (sd_notify(3))."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

from dmc41x3.cli.signals import on_end
from dmc41x3.i18n import marked, translate
from maya_un.assembly import Stack
from maya_un.cli import output
from maya_un.cli.settings import OutputSettings
from maya_un.errors import MayaError
from maya_un.values import Mode


def tell(words: str) -> None:
    """Say something like "READY=1" at $NOTIFY_SOCKET; where nobody listens nothing happens."""
    place = os.environ.get("NOTIFY_SOCKET", "")
    if not place.startswith(("/", "@")):
        return
    address = f"\0{place[1:]}" if place.startswith("@") else place
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as mouth:
        mouth.sendto(words.encode(), address)


def interval() -> float | None:
    """Return how often the supervisor wants to hear that this process lives [s, real time], None where never.

    Half of $WATCHDOG_USEC, as sd_watchdog_enabled(3) advises.
    """
    meant = os.environ.get("WATCHDOG_PID", str(os.getpid()))
    microseconds = os.environ.get("WATCHDOG_USEC", "")
    if meant != str(os.getpid()) or not microseconds.isdecimal() or int(microseconds) == 0:
        return None
    return int(microseconds) / 2e6


async def stay_alive(speed: float) -> None:
    """Say again and again that the running loop, whose clock runs `speed` times as fast, is alive; until cancelled."""
    every = interval()
    while every is not None:
        tell("WATCHDOG=1")
        await asyncio.sleep(every * speed)


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
        text = _ending(finish=finish, job=under_way)
        output.say(translate(text, settings.language, job=under_way))
    if finish:
        await _finished(running, ending, settings)
    else:
        await running.process.close()
    await _come_to_rest(running)


def _ending(*, finish: bool, job: int | None) -> str:
    if job is None:
        return marked("Ending.")
    if finish:
        return marked("Ending after the running step of job {job}; repeat the command to stop now.")
    return marked(
        "Ending: job {job} stops on its path and stays interrupted; a person decides about it at the next start."
    )


async def _finished(running: Stack, ending: ShutdownRequest, settings: OutputSettings) -> None:
    """Carry the step under way to its end, unless a second word comes."""
    closing = asyncio.ensure_future(running.process.close(finish=True))
    hurrying = asyncio.ensure_future(ending.hurried.wait())
    await asyncio.wait({closing, hurrying}, return_when=asyncio.FIRST_COMPLETED)
    if not closing.done():
        if not settings.json:
            output.say(translate("Stopping on the path now.", settings.language))
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
