"""Keep the guard in the controller running and the owner's beat going, and detect when the guard stops."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.numbers import parse_number
from maya_un.controller import watchdog_program
from maya_un.controller.ownership import LOOK, SILENT, Moving, Ownership
from maya_un.controller.watchdog_program import OUT, START, THREAD
from maya_un.errors import (
    CommandRejected,
    GuardBlocked,
    GuardNotRunning,
    HostSilent,
    InvalidValue,
    MachineError,
    OwnerErased,
    OwnershipLost,
    UnexpectedReply,
)

BEATS = 20
"""Beats in the guard's time: a late or lost beat does not stop the axes."""

USUAL = 0.5
"""Time from which the period of the beat follows (divided by `BEATS`) without a guard [s]."""

_PROGRAM_RUNS = 17


@dataclass(frozen=True, slots=True)
class WatchdogStatus:
    """The parsed answer to the guard's query; an unreadable answer is `garbled` and proves nothing.

    `ours` is whether the controller still belongs to this program.
    """

    running: bool
    expired: bool
    ours: bool = True
    garbled: UnexpectedReply | None = None

    def require(self) -> None:
        """Raise `GuardNotRunning` or `HostSilent` unless the guard watches."""
        if not self.running:
            raise GuardNotRunning
        if self.expired:
            raise HostSilent


class Watchdog:
    """The guard of one controller, and the beat that restarts its time and proves this program's ownership.

    `seconds` is how long the host may be silent (0: no guard, beat only), `letters` are the axes that the guard stops.
    After `install`, `on_watch` receives the status in every beat's answer. The beat ends when the link is lost.
    """

    def __init__(self, seconds: float, letters: str, on_watch: Callable[[WatchdogStatus, Driver], None]) -> None:
        self._seconds = seconds
        self._letters = letters
        self._on_watch = on_watch
        self._period = (seconds or USUAL) / BEATS
        self.owner = Ownership(max(SILENT, 2.0 * seconds))
        self._question = f"MG_XQ{THREAD},{OUT},{self.owner.ours}"
        self._lines = range(0)
        self._installed = False
        self._beat: asyncio.Task[None] | None = None
        self._sent: set[asyncio.Task[None]] = set()
        self._changing = asyncio.Lock()

    async def claim(self, driver: Driver, address: str, moving: Moving, *, take_over: bool = False) -> None:
        """Claim the controller for this program and beat from now on; raises as `Ownership.claim`."""
        async with self._changing:
            await self._stop_beating()
            await self.owner.claim(driver, address, moving, take_over=take_over)
            await self.arm(driver)  # the variables that the query names may have been deleted
            self._begin_beating(driver)

    async def resume(self, driver: Driver, moving: Moving) -> None:
        """Beat again once nothing moves, on a new connection to a controller that this program still owns."""
        async with self._changing:  # a user may recover meanwhile: only one beat may run
            await self._stop_beating()
            while True:
                if not await moving():
                    break
                await asyncio.sleep(LOOK)
            await self.owner.sign(driver)
            self._begin_beating(driver)

    async def install(self, driver: Driver) -> None:
        """Install the guard in the controller unless it is present, and start it unless it runs.

        Requires `claim` before. A user's program stays unchanged; the guard follows after its lines. Raises
        `GuardBlocked` if that is impossible.
        """
        if self._seconds > 0.0:
            await self._provide(driver)
            if not (await self._look(driver)).running:
                if await driver.value(f"_XQ{THREAD}") >= 0.0:
                    raise GuardBlocked(
                        reason=phrase("thread {thread} runs something else: halt it with HX {thread}", thread=THREAD)
                    )
                await driver.batch([*self.owner.arm, f"XQ#{START},{THREAD}"])
        await driver.subscribe()
        await self._prove(driver, self.owner.arm)
        self._installed = True

    async def arm(self, driver: Driver) -> None:
        """Restart the guard's time, also after it has run out."""
        try:
            await driver.batch(self.owner.arm)
        except CommandRejected:
            await driver.batch(self.owner.first_arm)

    async def load(self, driver: Driver, commands: Sequence[str]) -> None:
        """Send commands that prepare a motion, and check ownership and the guard in the same batch.

        Raises `OwnershipLost`, `OwnerErased`, `GuardNotRunning`, `HostSilent`, and the errors of the driver.
        """
        if self._beat is None or self._beat.done():
            raise GuardNotRunning
        await self._prove(driver, commands)

    async def output(self, driver: Driver, bit: int, *, high: bool) -> None:
        """Set or clear an output if this program owns the controller.

        Raises `OwnershipLost`, `OwnerErased`, `GuardNotRunning`.
        """
        command = self.owner.output(bit, high=high)
        if not await self.owner.did(driver, command):
            raise await self.lost(driver)

    async def lost(self, driver: Driver) -> OwnershipLost | OwnerErased | GuardNotRunning:
        """Return the error for lost ownership.

        Without an owner it is `OwnerErased` if the guard runs, else `GuardNotRunning`.
        """
        holder = await self.owner.successor(driver)
        if holder:
            return OwnershipLost(holder=holder)
        return OwnerErased() if (await self._look(driver)).running else GuardNotRunning()

    async def close(self, driver: Driver | None) -> None:
        """End the beat.

        With a driver of a controller that this program owns, also end the guard and release the controller. Thread 7 is
        left alone if it runs another program, as when the guard could not be installed. Everything that another program
        owns is left alone too.
        """
        await self._stop_beating()
        self._installed = False
        if driver is None:
            return
        if await self.owner.holds(driver):
            if self._seconds > 0.0 and (await self._look(driver)).running:
                await driver.send(f"HX{THREAD}")
            await self.owner.release(driver)

    async def _provide(self, driver: Driver) -> None:
        present = await driver.upload()
        wanted = watchdog_program.merged(present, self._seconds, self._letters)
        if present.splitlines() != wanted.splitlines():
            old = watchdog_program.span(present)
            if old is not None and await driver.value(f"_XQ{THREAD}") in old:
                await driver.send(f"HX{THREAD}")
            await self._download(driver, wanted, _common(present, wanted))
        lines = watchdog_program.span(wanted)
        assert lines is not None
        self._lines = lines

    @staticmethod
    async def _download(driver: Driver, program: str, keep: int) -> None:
        try:
            await driver.download(program, keep=keep)
        except InvalidValue as error:
            raise GuardBlocked(reason=phrase("the two together are too much ({error})", error=error)) from error
        except CommandRejected as refused:
            if refused.details["tc"] != _PROGRAM_RUNS:
                raise GuardBlocked(
                    reason=phrase("the controller refused its lines ({refused})", refused=refused)
                ) from refused
            raise GuardBlocked(reason="it runs, and a running program cannot be added to: halt it with HX") from refused

    async def _prove(self, driver: Driver, commands: Sequence[str]) -> None:
        try:
            answers = await driver.batch([*commands, self._question])
        except CommandRejected as refused:
            if refused.details["command"] == self._question:  # the variables are gone: a reset
                raise GuardNotRunning from refused
            raise
        watch = self._read(answers[-1])
        if not watch.ours:
            raise await self.lost(driver)
        watch.require()

    async def _look(self, driver: Driver) -> WatchdogStatus:
        try:
            return self._read(await driver.send(self._question))
        except CommandRejected:
            return WatchdogStatus(running=False, expired=False)

    def _read(self, answer: str) -> WatchdogStatus:
        words = answer.split()
        try:
            line, out, ours = (parse_number(word) for word in words)
        except ValueError as error:
            raise UnexpectedReply(command=self._question, reply=answer) from error
        if self._seconds == 0.0:
            return WatchdogStatus(running=True, expired=False, ours=ours != 0.0)
        return WatchdogStatus(running=line in self._lines, expired=out != 0.0, ours=ours != 0.0)

    def _begin_beating(self, driver: Driver) -> None:
        self._beat = asyncio.get_running_loop().create_task(self._keep_beating(driver), name="beat of the guard")

    async def _keep_beating(self, driver: Driver) -> None:
        loop = asyncio.get_running_loop()
        while not driver.lost.done():
            # The beat does not wait for its answer: a slow reply must not become a slow beat.
            task = loop.create_task(self._one_beat(driver))
            self._sent.add(task)
            task.add_done_callback(self._sent.discard)
            await asyncio.sleep(self._period)

    async def _one_beat(self, driver: Driver) -> None:
        try:
            _, answer = await driver.batch([self.owner.beat, self._question])
            watch = self._read(answer)
        except CommandRejected:
            watch = WatchdogStatus(running=False, expired=False)
        except UnexpectedReply as error:
            watch = WatchdogStatus(running=False, expired=False, garbled=error)
        except MachineError:
            return  # the link's keeper reports a lost link
        if self._installed:
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
