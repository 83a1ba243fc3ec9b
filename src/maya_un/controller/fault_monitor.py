"""Detect changes that Maya did not command, and report them to the motion under way, or enter the fault state.

Such changes show in the data record, in the guard's answer to every beat, and in the controller's own messages.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Sequence
from contextlib import suppress

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.record import DataRecord
from maya_un.controller import state_builder
from maya_un.controller.homing_mark import erase, plausible, remembered
from maya_un.controller.monitor import Monitor
from maya_un.controller.registers import GROUPS, MEANING, PendingRead
from maya_un.controller.seek import strays
from maya_un.controller.watchdog import Watchdog, WatchdogStatus
from maya_un.controller.watchdog_program import REPORT
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    CommandRejected,
    ControllerReset,
    ForeignMotion,
    GuardNotRunning,
    HostSilent,
    InternalError,
    MachineError,
    MayaError,
    NotConnected,
    OwnerErased,
    OwnershipLost,
    PositionChanged,
    RegisterChanged,
    UnexpectedReply,
)

MOVING_RATE, REST_RATE = 20.0, 4.0
"""Reads per second, at most: of the first group in motion, and of all groups in turn."""

_NAMED = (AbortInput, AmplifierFault, CommandRejected, PositionChanged, RegisterChanged, ForeignMotion, UnexpectedReply)
"""Errors that name their cause; a refused command of this program explains a register that differs."""


class FaultMonitor:
    """Watches the controller of `monitor`, and keeps its guard running. Never sends motion.

    Without `live`, as in a dry run, it has no guard and reads on request only.
    """

    def __init__(self, monitor: Monitor, *, live: bool) -> None:
        self._loop = asyncio.get_running_loop()
        self._monitor = monitor
        monitor.live = live
        self._live = live
        self._turn = 0
        self._guard = self._chosen_guard() if live else None
        self._looking: asyncio.Task[None] | None = None
        self._hearing: asyncio.Task[None] | None = None
        self._unheard = False
        self._tasks: set[asyncio.Task[None]] = set()
        monitor.on_returned = self._on_returned

    def begin(self) -> None:
        """Read the record at the configured rate from now on; restarts the reading if a defect ended it."""
        if self._live and (self._looking is None or self._looking.done()):
            self._looking = self._loop.create_task(self._keep_looking(), name="state stream")

    async def close(self) -> None:
        """Stop reading and listening, and end the guard."""
        link = self._monitor.link
        if self._looking is not None:
            self._looking.cancel()
            await asyncio.gather(self._looking, return_exceptions=True)
            self._looking = None
        if self._guard is not None:
            with suppress(MayaError):
                await self._leave_torque(self._guard)
            with suppress(MayaError):
                await self._guard.close(link.driver if link.up else None)
        for task in self._tasks:
            task.cancel()

    async def _leave_torque(self, guard: Watchdog) -> None:
        """Set the torque that any path may need, and no more, for the next program."""
        monitor = self._monitor
        if monitor.link.up and monitor.registers.written and not monitor.moving():
            driver = monitor.link.driver
            if await guard.owner.holds(driver):
                await driver.batch(monitor.registers.torque(monitor.torque.most))

    async def claim(self, driver: Driver, *, take_over: bool = False) -> None:
        """Claim the controller for this program (a dry run needs no claim).

        Raises `ControllerOwned`, `ControllerMoves`.
        """
        if self._guard is not None:
            await self._guard.claim(driver, self._monitor.link.address, self._moving, take_over=take_over)

    async def require_owned(self, driver: Driver) -> None:
        """Raise `OwnershipLost`, or as `load`, unless this program owns the controller and the guard watches."""
        await self.wake_guard(driver)
        await self.load(driver, [])

    async def output(self, driver: Driver, bit: int, *, high: bool) -> None:
        """Set or clear an output if this program owns the controller; raises `OwnershipLost`, `GuardNotRunning`."""
        if self._guard is None:
            await driver.send(f"{'SB' if high else 'CB'} {bit}")
        else:
            await self._guard.output(driver, bit, high=high)

    async def install_guard(self, driver: Driver) -> None:
        """Install and start the guard in the controller; raises `GuardBlocked`, `GuardNotRunning`."""
        if self._guard is not None:
            driver.on_message = self._on_message
            await self._guard.install(driver)

    async def load(self, driver: Driver, commands: Sequence[str]) -> None:
        """Send the preparation of a motion; with a guard, only if it runs (`GuardNotRunning`, `HostSilent`).

        A `live` monitor also reads every register that safety depends on; raises `RegisterChanged`. Without expected
        values to compare with, it sends nothing and raises `InternalError`.
        """
        registers = self._monitor.registers
        checked = self._live and bool(commands)
        if checked and not registers.known and not driver.lost.done():
            raise InternalError(reason=phrase("the expected values of the controller's registers are unknown"))
        asked = registers.ask(driver) if checked and registers.known else None
        registers.sent(commands)
        if self._guard is None:
            await driver.batch(commands)
        else:
            await self._guard.load(driver, commands)
        if asked is not None:
            await registers.require(driver, asked)

    async def name(self, driver: Driver, error: MachineError) -> MachineError:
        """Return the cause of a motion's `error`: a changed register if one is found, else `error`."""
        registers = self._monitor.registers
        if not self._live or not registers.known or driver.lost.done() or isinstance(error, _NAMED):
            return error
        try:
            await registers.require(driver, registers.ask(driver))
        except RegisterChanged as changed:
            with suppress(MachineError):
                if await remembered(driver):
                    self._void_by(changed)
                    return changed
        except MachineError:
            pass
        return error

    async def wake_guard(self, driver: Driver) -> None:
        """Restart the guard's time before a motion: at rest, a host that was busy for longer does no harm."""
        if self._guard is not None:
            await self._guard.arm(driver)

    def _chosen_guard(self) -> Watchdog:
        letters = "".join(sorted(axis.letter for axis, _ in self._monitor.places()))
        return Watchdog(self._monitor.config.safety.guard_time, letters, self._on_watch)

    async def _moving(self) -> bool:
        await self._monitor.look()
        return self._monitor.moving()

    def _on_returned(self, driver: Driver) -> None:
        """Resume the beat on a new connection once nothing moves: until then the guard must stop a motion under way."""
        if self._guard is not None:
            self._begin(self._resume(driver, self._guard))

    async def _resume(self, driver: Driver, guard: Watchdog) -> None:
        try:
            if await guard.owner.holds(driver):
                await guard.resume(driver, self._moving)
                return
            error = await guard.lost(driver)
        except (NotConnected, MachineError):
            return  # lost again: the link's keeper dials again
        if isinstance(error, OwnershipLost | OwnerErased):
            self._monitor.enter_fault(error)

    async def _keep_looking(self) -> None:
        monitor = self._monitor
        period = 1.0 / monitor.config.controller.stream_rate
        while True:
            await asyncio.sleep(period)
            run = monitor.run
            try:
                driver = monitor.link.driver
                asked = self._ask(driver)
                record = await monitor.look()
                if run is monitor.run:  # a record requested before BGS shows the motion before
                    await self._judge(record)
                if asked is not None:
                    await self._judge_registers(driver, asked)
            except (NotConnected, MachineError):
                continue  # the link's keeper reports the loss and dials again
            except Exception as defect:
                monitor.enter_fault(InternalError(reason=repr(defect)))
                raise

    def _ask(self, driver: Driver) -> PendingRead | None:
        """Send reads of registers: the first group often in motion, all in turn a few times a second."""
        monitor = self._monitor
        if not monitor.powered or not monitor.registers.known or monitor.fault is not None:
            return None
        self._turn += 1
        rate = monitor.config.controller.stream_rate
        groups: list[int] = []
        if monitor.under_way and self._turn % max(1, round(rate / MOVING_RATE)) == 0:
            groups.append(0)
        every = max(1, round(rate / REST_RATE))
        if self._turn % every == 0:
            groups.append(self._turn // every % len(GROUPS))
        return monitor.registers.ask(driver, dict.fromkeys(groups)) if groups else None

    async def _judge_registers(self, driver: Driver, asked: PendingRead) -> None:
        """Report a changed register to the motion under way, or enter the fault state."""
        monitor = self._monitor
        try:
            await monitor.registers.require(driver, asked)
        except RegisterChanged as changed:
            if monitor.fault is not None or not monitor.registers.known:
                return
            self._void_by(changed)
            await self._tell(driver, changed)

    def _void_by(self, changed: RegisterChanged) -> None:
        """Make the homing invalid if the register defines the meaning of counts."""
        if str(changed.details["register"])[:2] in MEANING:
            self._monitor.displace(changed)

    async def _tell(self, driver: Driver, error: MachineError) -> None:
        """End the motion under way with an error, or enter the fault state.

        After a reset, use the error of the reset.
        """
        monitor = self._monitor
        if not await remembered(driver):
            monitor.homed, error = False, ControllerReset()
        if monitor.displaced is not None and not monitor.under_way:
            await erase(driver)
        if monitor.fault is not None:
            return
        command = monitor.slot.current
        if command is not None:
            command.interrupt(error)
        if not monitor.under_way:
            monitor.enter_fault(error)

    async def _judge(self, record: DataRecord) -> None:
        """Report changes that Maya did not command to the motion under way, or enter the fault state."""
        monitor = self._monitor
        if monitor.fault is not None:
            return
        command = monitor.slot.current
        if monitor.displaced is not None and not monitor.under_way:
            driver = monitor.link.driver
            letters = strays(record, monitor.config, monitor.order)
            if letters:
                driver.urgent(f"ST{letters}")
            if record.s.moving:
                driver.urgent("ST S")
            await self._tell(driver, monitor.displaced)
            return
        strange = monitor.homed and not plausible(monitor.config, monitor.here())
        if strange and not await remembered(monitor.link.driver):
            if monitor.fault is None:
                monitor.homed = False
                monitor.end(ControllerReset())
            return
        if command is not None and monitor.under_way:
            found = self._met(record)
            if found is not None:
                command.interrupt(found)
            return
        found = monitor.motor_off()
        if found is not None and command is None:
            monitor.enter_fault(found)

    def _met(self, record: DataRecord) -> MayaError | None:
        """Return the error of the motion under way, None without one; a homing checks limits itself."""
        monitor, run = self._monitor, self._monitor.run
        found = None if run is None else state_builder.grave(record, monitor.order, run.members)
        found = found or monitor.motor_off()
        if found is not None:
            return found
        strange: MachineError | None = state_builder.foreign(record, monitor.order)
        if strange is None and run is not None:
            strange = monitor.reckoning.astray(run.move.polyline, monitor.standing())
        if strange is not None:
            monitor.displace(strange)
        return strange

    def _on_watch(self, watch: WatchdogStatus, driver: Driver) -> None:
        """Evaluate the guard's answer, which comes many times a second, unless a fault is present."""
        monitor = self._monitor
        if monitor.fault is not None or driver.lost.done():
            return
        if not watch.ours and self._guard is not None:
            self._begin(self._find_owner(driver, self._guard))
        elif not watch.running:
            self._begin(self._find_out(watch.garbled or GuardNotRunning()))
        elif watch.expired and monitor.under_way:
            monitor.end(HostSilent())
        elif watch.expired and self._guard is not None:  # at rest the guard had nothing to stop
            self._begin(self._guard.arm(driver))

    async def _find_owner(self, driver: Driver, guard: Watchdog) -> None:
        """End the motion under way with an error that names the new owner."""
        try:
            error = await guard.lost(driver)
        except (NotConnected, MachineError):
            return  # the link's keeper reports the loss
        if not isinstance(error, OwnershipLost):
            await self._find_out(error)  # no owner: a reset
        elif self._monitor.fault is None and not self._ending():
            self._monitor.end(error)

    def _ending(self) -> bool:
        command = self._monitor.slot.current
        return command is not None and command.interrupted.done()

    def _on_message(self, text: str) -> None:
        """Read the record at once after a message of the guard about a limit or a following error."""
        if text.startswith(REPORT):
            self._unheard = True
            if self._hearing is None or self._hearing.done():
                self._hearing = self._begin(self._hear())

    async def _hear(self) -> None:
        """Read once for all messages that arrived meanwhile, so many messages do not cause many reads."""
        while self._unheard:
            self._unheard = False
            await self._find_out(None)

    async def _find_out(self, otherwise: MachineError | None) -> None:
        """Find the error of the axes, and end the motion under way with it, or with `otherwise`."""
        monitor = self._monitor
        run = monitor.run
        try:
            record = await monitor.look()
        except (NotConnected, MachineError):
            return  # the link's keeper reports the loss
        if run is monitor.run:
            await self._judge(record)
        if otherwise is not None and monitor.fault is None and not self._ending():
            found = state_builder.grave(record, monitor.order, (0, 1, 2) if run is None else run.members)
            # Outside of a run, a limit or a following error may be an old one.
            if found is None or (run is None and not isinstance(found, (AbortInput, AmplifierFault))):
                found = otherwise
            monitor.end(found)

    def _begin(self, work: Coroutine[None, None, None]) -> asyncio.Task[None]:
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None and not isinstance(task.exception(), MayaError):
            self._monitor.enter_fault(InternalError(reason=repr(task.exception())))
