"""Stopping: past every queue, on the path, with a report of the braking; and the wait until nothing moves."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

from dmc41x3.driver import Driver
from dmc41x3.language.record import DataRecord
from maya_un.cancellation import wait_for_end
from maya_un.controller import state_builder
from maya_un.controller.monitor import Monitor
from maya_un.controller.seek import SETTLE, brake, strays
from maya_un.errors import CommandRejected, MachineError, NotConnected, Stopped
from maya_un.events import MotionStopped
from maya_un.values import StopReport

PATIENCE = 30.0
"""A controller that refuses commands is polled for this time [s] until its axes rest."""


class MotionStopper:
    """Stops the motion of the controller that `monitor` reads."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._loop = asyncio.get_running_loop()

    async def stop(self) -> StopReport:
        """Begin to brake at once; return the duration and distance of braking; raises `NotConnected`."""
        monitor = self._monitor
        driver = monitor.link.driver
        sent = driver.urgent("ST S")
        report = None if monitor.run is None else monitor.run.stop_report(self._loop.time())
        command = monitor.slot.current
        if command is not None:
            monitor.stopping = monitor.under_way
            command.interrupt(Stopped())
        if command is not None or monitor.pace.paused:
            monitor.release()
            monitor.publish()
        with suppress(CommandRejected):  # a refused ST S means that no sequence runs
            await sent
        record = await self._stop_strays(driver)
        if command is None:  # at rest as well: a process between two steps must not continue
            monitor.events.emit(MotionStopped())
        return report or self._braking(record)

    async def rest(
        self,
        driver: Driver,
        then: Callable[[], object] | None = None,
        rested: Callable[[], Awaitable[object]] | None = None,
    ) -> None:
        """Brake on the path, wait until nothing moves, await `rested`, and call `then`, which may report the stop.

        A cancellation that comes meanwhile takes effect afterwards.
        """
        resting = self._loop.create_task(self._come_to_rest(driver, rested))
        cancelled = await wait_for_end(resting)
        resting.result()
        if then is not None:
            then()  # in this task: no other task runs before the caller publishes the state
        if cancelled:
            raise asyncio.CancelledError

    def _require_on_path(self, record: DataRecord) -> None:
        """Make the homing invalid if a stopped motion does not rest on its path."""
        monitor = self._monitor
        if monitor.run is None or state_builder.grave(record, monitor.order) is not None:
            return
        astray = monitor.reckoning.astray(monitor.run.move.polyline, monitor.standing())
        if astray is not None:
            monitor.displace(astray)

    async def _come_to_rest(self, driver: Driver, rested: Callable[[], Awaitable[object]] | None) -> None:
        """Brake, poll until nothing moves, and once more after the axes have settled.

        Returns early if the link is lost.
        """
        if driver.lost.done():
            return
        try:
            await brake(driver)
            latest = self._loop.time() + PATIENCE
            await self._until_rest(driver, latest)
            await asyncio.sleep(SETTLE)  # the encoders follow a little later: the next plan starts at their positions
            self._require_on_path(await self._until_rest(driver, latest))
            self._monitor.hold(driver)
            if rested is not None:
                await rested()
        except (NotConnected, MachineError):
            if not driver.lost.done():
                raise

    async def _until_rest(self, driver: Driver, latest: float) -> DataRecord:
        """Return the first record that shows all axes at rest; raises as `_resting`."""
        while True:
            record = await self._resting(driver, latest)
            if record is not None:
                return record
            await asyncio.sleep(0.02)

    async def _resting(self, driver: Driver, latest: float) -> DataRecord | None:
        """Return the record once nothing moves, None in motion; brake axes that a refused stop left moving.

        Raises `CommandRejected` if the controller still refuses to answer at loop time `latest` [s].
        """
        try:
            record = await self._stop_strays(driver)
        except CommandRejected:
            if self._loop.time() < latest:
                return None
            raise
        if not self._monitor.moving():
            return record
        if record.s.moving and not record.s.stopping:
            await brake(driver)
        return None

    async def _stop_strays(self, driver: Driver) -> DataRecord:
        """Stop axes that move outside the coordinated sequence, which ST S does not reach; return the record."""
        record = await self._monitor.look()
        letters = strays(record, self._monitor.config, self._monitor.order)
        if letters:
            await driver.urgent(f"ST{letters}")
        return record

    def _braking(self, record: DataRecord) -> StopReport:
        """Return the braking of a motion known by its speeds only: v / a and v t / 2 of every axis.

        Axes of a sequence come to rest together, with the slowest to stop.
        """
        axes = [(record.axes[place], axis.stop_deceleration_counts) for axis, place in self._monitor.places()]
        alone = [abs(axis.velocity) / rate if axis.moving else 0.0 for axis, rate in axes]
        together = max((time for time, (axis, _) in zip(alone, axes, strict=True) if axis.coordinated), default=0.0)
        times = [together if axis.coordinated else time for time, (axis, _) in zip(alone, axes, strict=True)]
        a, b, c = (
            0.5 * axis.velocity * time / unit + 0.0  # people read it: -0.0 becomes 0.0
            for (axis, _), time, unit in zip(axes, times, self._monitor.units.per_unit, strict=True)
        )
        return StopReport(self._monitor.moving(), max(times), (a, b, c))
