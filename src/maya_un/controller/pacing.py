"""Speed override, pause and resume: one register of the controller (VR), written past the queue, on the path.

Where a controller might not scale its end speeds by VR the prediction holds; one that does would arrive later, and
the wait for a motion's end looks before it believes. Homing keeps its own speeds and is not paused.
"""

from __future__ import annotations

import asyncio

from dmc41x3.driver import Driver
from maya_un.controller.monitor import Monitor
from maya_un.errors import CannotPause, CommandRejected, Faulted, InvalidValue, NotPaused
from maya_un.events import MotionPaused, MotionResumed, SpeedChanged
from maya_un.motion.move import speed_ratio
from maya_un.values import StopReport

SLOWEST = 0.01
"""Least speed override: a hundredth of the planned speed. What is to stand still is paused."""

_NOTHING = StopReport(False, 0.0, (0.0, 0.0, 0.0))


class Pacing:
    """Changes how fast the controller that `monitor` keeps goes along its path."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._loop = asyncio.get_running_loop()

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way and of all later ones by `ratio`; raises `InvalidValue`."""
        if not SLOWEST <= ratio <= 1.0:
            raise InvalidValue(key="ratio", value=ratio, reason=f"it is at least {SLOWEST:g} and at most 1")
        monitor = self._monitor
        before = monitor.pace.override
        monitor.pace.change(override=ratio)
        if monitor.pace.override != before:
            monitor.events.emit(SpeedChanged(monitor.pace.override))
        await self._tell()

    async def pause(self, *, ahead: bool) -> StopReport:
        """Brake on the path and hold all motion; tell how long and how far it still goes.

        Nothing under way is refused unless something is `ahead`. Raises `CannotPause`, `Faulted`, `NotConnected`.
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
        """Go on; raises `NotPaused`, `NotConnected`."""
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
        if monitor.phase is not None:
            raise CannotPause(reason="a homing goes by its switches")
        if monitor.stopping:
            raise CannotPause(reason="the robot is stopping")
        if monitor.desk.current is None and not ahead:
            raise CannotPause(reason="nothing is under way")

    async def _tell(self) -> None:
        """Send the ratio that is wanted now to a run under way, and predict it anew from this instant."""
        monitor = self._monitor
        run = monitor.run
        if run is None or monitor.stopping:
            monitor.publish()
            return
        driver = monitor.link.driver
        command = speed_ratio(monitor.pace.ratio)
        sent = driver.urgent(command)
        monitor.registers.sent([command])
        run.follow(monitor.pace, self._loop.time())
        monitor.publish()
        await self._accepted(sent, driver)

    async def _accepted(self, sent: asyncio.Future[str], driver: Driver) -> None:
        """See the new ratio accepted; a run whose speed is not what was said ends."""
        try:
            await sent
        except CommandRejected as refusal:
            wish = self._monitor.desk.current
            if wish is not None and not driver.lost.done():
                wish.interrupt(refusal)
            raise
