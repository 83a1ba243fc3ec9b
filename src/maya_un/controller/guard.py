"""Keeps the guard in the controller running and its beat going, and knows whether it does."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from maya_un.controller import guard_program
from maya_un.controller.guard_program import BEAT, OUT, START, THREAD
from maya_un.errors import (
    CommandRejected,
    GuardBlocked,
    GuardNotRunning,
    HostSilent,
    InvalidValue,
    MachineError,
    UnexpectedReply,
)
from maya_un.galil.driver import Driver
from maya_un.galil.numbers import parse_number

BEATS = 20
"""Beats in the guard's time: one that comes late, or is lost, is no reason to stop."""

QUESTION = f"MG_XQ{THREAD},{OUT}"
"""Asks where the guard is (-1: nowhere) and whether it has stopped the axes."""

_ARM = (f"{BEAT}=TIME", f"{OUT}=0")
_PROGRAM_RUNS = 17


@dataclass(frozen=True, slots=True)
class Watch:
    """What an answer to `QUESTION` says of the guard; one without sense is `garbled` and proves nothing."""

    running: bool
    expired: bool
    garbled: UnexpectedReply | None = None

    def require(self) -> None:
        """Raise `GuardNotRunning` or `HostSilent` unless the guard watches."""
        if not self.running:
            raise GuardNotRunning
        if self.expired:
            raise HostSilent


class Guard:
    """The guard of one controller; `seconds` is how long the host may be silent, `letters` are the axes it stops.

    `on_watch` is told what every beat's answer says. A link that is lost ends the beat; `install` begins it again.
    """

    def __init__(self, seconds: float, letters: str, on_watch: Callable[[Watch, Driver], None]) -> None:
        self._seconds = seconds
        self._letters = letters
        self._on_watch = on_watch
        self._lines = range(0)
        self._beat: asyncio.Task[None] | None = None
        self._sent: set[asyncio.Task[None]] = set()

    async def install(self, driver: Driver) -> None:
        """Put the guard into the controller unless it is there, start it unless it runs, and beat from now on.

        A user's program stays as it is, the guard goes behind it. Raises `GuardBlocked` where that cannot be.
        """
        await self._stop_beating()
        await self._provide(driver)
        await self.arm(driver)  # somebody may have deleted the variables that the question names
        if not (await self._look(driver)).running:
            if await driver.value(f"_XQ{THREAD}") >= 0.0:
                raise GuardBlocked(reason=f"thread {THREAD} runs something else: halt it with HX {THREAD}")
            await driver.batch([*_ARM, f"XQ#{START},{THREAD}"])
        await driver.subscribe()
        await self._prove(driver, _ARM)
        self._beat = asyncio.get_running_loop().create_task(self._keep_beating(driver), name="beat of the guard")

    async def arm(self, driver: Driver) -> None:
        """Begin the guard's time anew, also after it has run out."""
        await driver.batch(_ARM)

    async def load(self, driver: Driver, commands: Sequence[str]) -> None:
        """Send commands that prepare a motion, and make sure in the same breath that the guard watches.

        Raises `GuardNotRunning`, `HostSilent`, and as the driver.
        """
        if self._beat is None or self._beat.done():
            raise GuardNotRunning
        await self._prove(driver, commands)

    async def close(self, driver: Driver | None) -> None:
        """End the beat; with a driver also the guard itself, for whoever uses the controller next.

        Where the guard could not be installed, thread 7 is somebody else's and left alone.
        """
        await self._stop_beating()
        if driver is not None and (await self._look(driver)).running:
            await driver.send(f"HX{THREAD}")

    async def _provide(self, driver: Driver) -> None:
        present = await driver.upload()
        wanted = guard_program.merged(present, self._seconds, self._letters)
        if present.splitlines() != wanted.splitlines():
            old = guard_program.span(present)
            if old is not None and await driver.value(f"_XQ{THREAD}") in old:
                await driver.send(f"HX{THREAD}")
            await self._download(driver, wanted, _common(present, wanted))
        lines = guard_program.span(wanted)
        assert lines is not None
        self._lines = lines

    @staticmethod
    async def _download(driver: Driver, program: str, keep: int) -> None:
        try:
            await driver.download(program, keep=keep)
        except InvalidValue as error:
            raise GuardBlocked(reason=f"the two together are too much ({error})") from error
        except CommandRejected as refused:
            if refused.details["tc"] != _PROGRAM_RUNS:
                raise GuardBlocked(reason=f"the controller refused its lines ({refused})") from refused
            raise GuardBlocked(reason="it runs, and a running program cannot be added to: halt it with HX") from refused

    async def _prove(self, driver: Driver, commands: Sequence[str]) -> None:
        try:
            answers = await driver.batch([*commands, QUESTION])
        except CommandRejected as refused:
            if refused.details["command"] == QUESTION:  # the variables are gone: a reset
                raise GuardNotRunning from refused
            raise
        self._read(answers[-1]).require()

    async def _look(self, driver: Driver) -> Watch:
        try:
            return self._read(await driver.send(QUESTION))
        except CommandRejected:
            return Watch(running=False, expired=False)

    def _read(self, answer: str) -> Watch:
        words = answer.split()
        try:
            line, out = (parse_number(word) for word in words)
        except ValueError as error:
            raise UnexpectedReply(command=QUESTION, reply=answer) from error
        return Watch(running=line in self._lines, expired=out != 0.0)

    async def _keep_beating(self, driver: Driver) -> None:
        loop = asyncio.get_running_loop()
        period = self._seconds / BEATS
        while not driver.lost.done():
            # The beat does not wait for its answer: a slow reply must not become a slow beat.
            task = loop.create_task(self._one_beat(driver))
            self._sent.add(task)
            task.add_done_callback(self._sent.discard)
            await asyncio.sleep(period)

    async def _one_beat(self, driver: Driver) -> None:
        try:
            _, answer = await driver.batch([f"{BEAT}=TIME", QUESTION])
            watch = self._read(answer)
        except CommandRejected:
            watch = Watch(running=False, expired=False)
        except UnexpectedReply as error:
            watch = Watch(running=False, expired=False, garbled=error)
        except MachineError:
            return  # a lost link is announced by those who keep it
        self._on_watch(watch, driver)

    async def _stop_beating(self) -> None:
        tasks = [task for task in (self._beat, *self._sent) if task is not None]
        self._beat = None
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def _common(present: str, wanted: str) -> int:
    """Return how many lines two programs have in common at their beginning."""
    ours, theirs = wanted.splitlines(), present.splitlines()
    count = min(len(ours), len(theirs))
    return next((number for number in range(count) if ours[number] != theirs[number]), count)
