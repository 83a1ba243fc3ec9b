"""Execute one plan while its speed changes, is paused and resumed, and confirm its end.

Speed override, pause and resume write one register of the controller (VR), past the queue; the axes stay on the path.

The prediction assumes that the controller does not scale its end speeds by VR. A controller that does arrives later, so
the wait for a motion's end checks the record before it trusts the prediction. Homing has fixed speeds and cannot be
paused.

To execute a plan: send it, begin it, wait for its end while its speed may change, and confirm that the axes arrived.
"""

from __future__ import annotations

import asyncio
from math import inf

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.record import DataRecord
from maya_un.axes import AXES
from maya_un.controller import state_builder
from maya_un.controller.command_slot import RunningCommand
from maya_un.controller.fault_monitor import FaultMonitor
from maya_un.controller.homing_mark import MOVING
from maya_un.controller.monitor import Monitor
from maya_un.controller.planner import MotionPlan
from maya_un.controller.protocol import MotionRun, OnVia, require_ratio
from maya_un.controller.seek import SETTLE
from maya_un.errors import (
    CannotPause,
    CommandRejected,
    EndNotReached,
    Faulted,
    NotPaused,
    Stopped,
    SwitchBlocks,
    TrajectoryRefused,
)
from maya_un.events import MotionPaused, MotionResumed, SpeedChanged
from maya_un.motion.move import CoordinatedMove, commands, speed_ratio
from maya_un.values import StopReport

_NOTHING = StopReport(False, 0.0, (0.0, 0.0, 0.0))


class Pacing:
    """Changes the speed of the controller that `monitor` reads, on its path."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._loop = asyncio.get_running_loop()

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way and of all later ones by `ratio`; raises `InvalidValue`."""
        require_ratio("ratio", ratio)
        monitor = self._monitor
        before = monitor.pace.override
        monitor.pace.change(override=ratio)
        if monitor.pace.override != before:
            monitor.events.emit(SpeedChanged(monitor.pace.override))
        await self._tell()

    async def scale(self, share: float) -> None:
        """Scale the speed of the motion under way by `share` (0.01 to 1) too; raises `InvalidValue`."""
        require_ratio("speed", share)
        self._monitor.pace.change(share=share)
        await self._tell()

    async def pause(self, *, ahead: bool) -> StopReport:
        """Brake on the path and hold all motion; return the duration and distance of braking.

        Without a command under way, raises `CannotPause` unless `ahead`. Raises `CannotPause`, `Faulted`,
        `NotConnected`.
        """
        monitor = self._monitor
        self._require_pausable(ahead=ahead)
        now = self._loop.time()
        report = _NOTHING if monitor.run is None else monitor.run.stop_report(now)
        if not monitor.pace.paused:
            monitor.pace.change(paused=True)
            monitor.events.emit(MotionPaused())
            await self._tell()
        return report

    async def resume(self) -> None:
        """Continue; raises `NotPaused`, `NotConnected`."""
        monitor = self._monitor
        if not monitor.pace.paused:
            raise NotPaused
        _ = monitor.link.driver
        monitor.pace.change(paused=False)
        monitor.events.emit(MotionResumed())
        await self._tell()

    def _require_pausable(self, *, ahead: bool) -> None:
        monitor = self._monitor
        _ = monitor.link.driver
        if monitor.fault is not None:
            raise Faulted(fault=str(monitor.fault))
        if monitor.pace.paused:
            return
        if monitor.unpausable:
            if monitor.slot.current is not None and monitor.slot.current.name == GUARDED_MOVE:
                raise CannotPause(reason="a guarded move cannot be interrupted and continued")
            raise CannotPause(reason="a homing cannot be interrupted and continued")
        if monitor.stopping:
            raise CannotPause(reason="the robot is stopping")
        if monitor.slot.current is None and not ahead:
            raise CannotPause(reason="nothing moves")

    async def _tell(self) -> None:
        """Send the present ratio to a running motion, and predict the motion again from this instant."""
        monitor = self._monitor
        run = monitor.run
        if run is None or monitor.stopping:
            monitor.publish()
            return
        driver = monitor.link.driver
        line = speed_ratio(monitor.pace.ratio)
        sent = driver.urgent(line)
        monitor.registers.sent([line])
        run.follow(monitor.pace, self._loop.time())
        monitor.publish()
        await self._accepted(sent, driver)

    async def _accepted(self, sent: asyncio.Future[str], driver: Driver) -> None:
        """Wait until the controller accepts the new ratio.

        If it refuses, end the command with that error and raise it.
        """
        try:
            await sent
        except CommandRejected as refusal:
            command = self._monitor.slot.current
            if command is not None and not driver.lost.done():
                command.interrupt(refusal)
            raise


GUARDED_MOVE = "guarded move"
"""Name of the command that moves an axis of a robot that is not homed."""

LATE = 1.0
"""A motion may end this much later than predicted [s], and a twentieth of its duration, before that is an error."""

HELD_LOOK = 0.25
"""In a pause the record is read this often [s]: a motion paused at its very end may already have arrived."""

_ROUNDING = 1e-6
"""Times that differ by less [s] are the same."""


class Execution:
    """Executes plans, one at a time, on the controller that `monitor` reads."""

    def __init__(self, monitor: Monitor, fault_monitor: FaultMonitor) -> None:
        self._monitor = monitor
        self._fault_monitor = fault_monitor
        self._loop = asyncio.get_running_loop()

    async def allowed(self, command: RunningCommand) -> None:
        """Wait until all motion is no longer on hold; raises `Faulted` if a fault ended the hold."""
        while self._monitor.pace.paused:
            await command.wait(inf, self._monitor.pace.news)
        if self._monitor.fault is not None:
            raise Faulted(fault=str(self._monitor.fault))

    async def allowed_whole(self, command: RunningCommand) -> None:
        """Wait as `allowed` for a motion that cannot be paused: from now until its end, every pause is refused."""
        await self.allowed(command)
        self._monitor.unpausable = True  # no await since the look at the pause: no pause can come between

    async def carry_out(
        self, command: RunningCommand, driver: Driver, plan: MotionPlan, on_via: OnVia | None = None
    ) -> bool:
        """Execute the move of a plan and return True; if the speed changed meanwhile, move nothing and return False."""
        monitor, move = self._monitor, plan.move
        assert move is not None
        if move.start != monitor.standing():  # segments are relative: the proof holds only for this start
            raise TrajectoryRefused(
                reason=phrase(
                    "it starts at counts {start}, the axes are at {position}",
                    start=move.start,
                    position=monitor.standing(),
                )
            )
        ratio = monitor.pace.ratio
        await self._fault_monitor.wake_guard(driver)
        limits = monitor.torque.travel(self._members(move), plan.knots)
        note = [MOVING] if monitor.live else []
        await self._fault_monitor.load(driver, [*note, *monitor.registers.torque(limits), *commands(move, ratio)])
        # Nothing can come between this check of command and ratio and the bytes of BGS: there is no await.
        command.check()
        if monitor.fault is not None:  # the fault ended the pause in which this command waited
            monitor.hold(driver)
            raise Faulted(fault=str(monitor.fault))
        if monitor.pace.ratio != ratio:
            monitor.hold(driver)
            return False
        run = self._run(move, ratio, on_via)
        monitor.run = run
        monitor.reckoning.forget()
        try:
            await driver.send("BGS")
            run.acknowledged = self._loop.time()
        except CommandRejected as refusal:
            record = await monitor.look()
            raise monitor.motor_off() or self._blocked(record, run, refusal) or refusal from refusal
        monitor.publish()
        await self._to_its_end(command, driver, run)
        monitor.run = None
        monitor.hold(driver)
        return True

    def _run(self, move: CoordinatedMove, factor: float, on_via: OnVia | None) -> MotionRun:
        return MotionRun(move, self._loop.time(), self._members(move), factor, vias=move.via_ways, on_via=on_via)

    def _members(self, move: CoordinatedMove) -> tuple[int, ...]:
        axes = self._monitor.config.axes
        return tuple(i for i in range(3) if axes[i].letter in move.axes)

    def _blocked(self, record: DataRecord, run: MotionRun, refusal: CommandRejected) -> SwitchBlocks | None:
        """Return the error for a switch that is active before a motion towards it, None without one."""
        if refusal.details["tc"] != ErrorCode.BEGIN_AT_LIMIT:
            return None
        ways = run.move.segments.counts
        forward, reverse = state_builder.limits(record, self._monitor.config, self._monitor.order)
        for i in run.members:
            for side, active, ahead in (
                ("forward", forward[i], (ways[:, i] > 0).any()),
                ("reverse", reverse[i], (ways[:, i] < 0).any()),
            ):
                if active and ahead:
                    return SwitchBlocks(axis=AXES[i], side=side)
        return None

    async def _to_its_end(self, command: RunningCommand, driver: Driver, run: MotionRun) -> None:
        record = await self._ended(command, run)
        try:
            self._arrived(record, run)
        except Stopped:
            await self._fault_monitor.load(driver, [])  # raises if the guard stopped it, while this program slept
            command.check()
            raise
        run.tell_vias(inf)

    async def _ended(self, command: RunningCommand, run: MotionRun) -> DataRecord:
        """Wait for the predicted end, which may change, and read the record until the axes are at rest; return it."""
        pace = self._monitor.pace
        while True:
            await command.wait(self._due(run), pace.news)
            now = self._loop.time()
            run.tell_vias(now)
            if not pace.paused and now < run.end + SETTLE - _ROUNDING:
                continue
            record = await self._monitor.look()
            if not self._monitor.moving():
                return record
            if now > run.acknowledged + 1.05 * (run.end - run.began) + LATE:
                raise EndNotReached(axis=phrase("a, b or c"), distance=phrase("an unknown distance"))

    def _due(self, run: MotionRun) -> float:
        """Return the loop time of the next action [s]: a via, the end, or the next poll in a pause or after the end."""
        now = self._loop.time()
        if self._monitor.pace.paused:
            return min(run.next_via(), max(run.rest + SETTLE, now + HELD_LOOK))
        if now < run.end + SETTLE - _ROUNDING:
            return min(run.next_via(), run.end + SETTLE)
        return now + 0.01

    def _arrived(self, record: DataRecord, run: MotionRun) -> None:
        found = state_builder.cause(record, self._monitor.order, run.members)
        if found is not None:
            raise found
        astray = self._monitor.reckoning.astray(run.move.polyline, self._monitor.standing())
        if astray is not None:
            self._monitor.displace(astray)
            raise astray
        for i in range(3):
            axis = record.axes[self._monitor.order[i]]
            away, end = abs(axis.position - run.move.end[i]), run.move.end[i]
            if axis.reference != end:
                changed = self._monitor.reckoning.changed(i, axis.reference - end)
                self._monitor.displace(changed)
                raise changed
            if away > self._monitor.config.axes[i].error_limit_counts // 4:
                raise EndNotReached(axis=AXES[i], distance=phrase("{away:d} counts", away=away))
