"""The controller floor on a Galil DMC-41x3: every rule of safety that no edge can go around lives here or lower."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, suppress

from maya_un.config import Config
from maya_un.controller import faults, marker
from maya_un.controller.homing import Homing
from maya_un.controller.link import Dial
from maya_un.controller.monitor import Monitor, Run
from maya_un.controller.planner import Planner
from maya_un.controller.protocol import Preview
from maya_un.controller.registers import configure
from maya_un.controller.seek import SETTLE, Seeker, brake
from maya_un.controller.wish import Wish
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    Busy,
    CommandRejected,
    EndNotReached,
    LimitReached,
    MachineError,
    MarkerMissing,
    NotConnected,
    NothingToRecover,
    Stopped,
    TrajectoryRefused,
    UnknownName,
)
from maya_un.events import EventLog, Kind
from maya_un.galil.driver import Driver
from maya_un.galil.record import DataRecord
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.motion.move import CoordinatedMove, commands
from maya_un.values import AXES, Joints, Progress, State, StopReport

LATE = 1.0
"""A motion may end this much later than predicted [s], and a twentieth of its duration, before that is an error."""

_START_TOLERANCE = (1e-3, 1e-4, 1e-4)


class GalilController:
    """Joint-space control of Maya through one handle of its motion controller; see `protocol.Controller`.

    `dial` opens the transport, `address` names it in messages. A `live` one reads the data record at
    the configured rate for whoever watches, and has a guard in the controller stop the axes if this program falls
    silent; the other (dry runs) renews its state at every wish only.
    """

    def __init__(self, dial: Dial, address: str, config: Config, *, live: bool = True) -> None:
        self._loop = asyncio.get_running_loop()
        self._monitor = Monitor(dial, address, config, live=live)
        self._planner = Planner(config, self._monitor.mechanism)
        self.config = config
        self.units = self._monitor.units

    @property
    def address(self) -> str:
        """The controller's address, for people."""
        return self._monitor.link.address

    @property
    def firmware(self) -> str:
        """The controller's firmware line, "" before the first connection."""
        return self._monitor.link.firmware

    @property
    def mechanism(self) -> Mechanism:
        """Geometry of the machine."""
        return self._monitor.mechanism

    @property
    def workspace(self) -> Workspace:
        """Where the robot may go; strokes as measured once homed."""
        return self._monitor.workspace

    @property
    def events(self) -> EventLog:
        """Facts in order."""
        return self._monitor.events

    @property
    def state(self) -> State:
        """Latest state."""
        return self._monitor.state

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        return self._monitor.watch()

    def progress(self) -> Progress | None:
        """How far the motion under way has come, None at rest."""
        return self._monitor.progress()

    def tap(self, listener: Callable[[str, bytes], None]) -> None:
        """Hand every byte on the wire to `listener` ("tx" or "rx"), from the next connection on."""
        self._monitor.link.tap = listener

    async def open(self) -> None:
        """Connect and write the configured registers; sends no motion.

        Raises `ConnectFailed`, `LinkTimeout`, `WrongController`, `ParameterMismatch`, `GuardBlocked`.
        """
        driver = await self._monitor.open()
        try:
            if not self._monitor.moving():
                await configure(driver, self.config)
            await self._monitor.install_guard(driver)
        except BaseException:
            await self._monitor.close()
            raise
        self._monitor.announce()

    async def close(self) -> None:
        """Brake if something moves, give the handle back."""
        if self._monitor.desk.current is not None and self._monitor.link.up:
            await self.stop()
            await self._monitor.desk.free()
        await self._monitor.close()

    async def skip_home(self) -> None:
        """Take over the homing whose mark stands in the controller.

        Raises `MarkerMissing` where there is none since the last reset, `Busy`, `NotConnected`, `Faulted`.
        """
        monitor = self._monitor
        with monitor.desk.take("skip home"):
            driver = monitor.ready(homed=False)
            await monitor.look()
            if monitor.moving():
                raise Busy(doing="the axes finish what was sent before")
            await configure(driver, self.config)
            if not await monitor.adopt(driver):
                raise MarkerMissing
            await monitor.power(driver)
            self.events.emit(Kind.HOMED)
            monitor.publish()

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes (`controller.homing`).

        Raises as all motion does, and `WiringContradictsCn`, `HomingStalled`, `SwitchNotFound`, `StrokeDiffers`.
        """
        monitor = self._monitor
        async with self._motion("home", homed=False) as (wish, driver):
            monitor.homed = False
            await configure(driver, self.config)
            await marker.erase(driver)
            await monitor.power(driver)
            await monitor.wake_guard(driver)
            self.events.emit(Kind.HOMING)
            seeker = Seeker(driver, self.config, self.units, wish.pause, self._loop.time, monitor.load)
            found = await Homing(seeker, driver, self.config, self.units, monitor.enter_phase).run()
            ends = (found.b_end, found.c_end)
            await marker.leave(driver, ends, self.units)
            monitor.set_homed(ends)
            await monitor.look()
        self.events.emit(Kind.HOMED)
        monitor.publish()

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Go to `target` (rad, m, m), straight in joint space; `speed` scales the limits, above 0 up to 1."""
        await self._travel("move", lambda here: [here, target], speed)

    async def follow(self, path: Sequence[Joints], *, speed: float = 1.0) -> None:
        """Go along `path`; raises `TrajectoryRefused` unless it starts where the robot is."""
        points = [Joints(*point) for point in path]
        if len(points) < 2:
            raise TrajectoryRefused(reason="it needs at least two points")

        def from_here(here: Joints) -> list[Joints]:
            for axis, start, place, tolerance in zip(AXES, points[0], here, _START_TOLERANCE, strict=True):
                if not abs(start - place) <= tolerance:
                    raise TrajectoryRefused(reason=f"it starts at {axis} = {start:.4f}, the robot is at {place:.4f}")
            return [here, *points[1:]]

        await self._travel("follow", from_here, speed)

    async def jog(self, axis: str, distance: float, *, speed: float = 1.0) -> None:
        """Move one axis ("a", "b", "c") by `distance` (rad or m); raises `UnknownName` for another name."""
        if axis not in AXES:
            raise UnknownName(name=axis, known=", ".join(AXES))
        index = AXES.index(axis)

        def by(here: Joints) -> list[Joints]:
            there = list(here)
            there[index] += distance
            return [here, Joints(*there)]

        await self._travel("jog", by, speed)

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper and wait until it has moved; no motion, so no homing is needed."""
        monitor = self._monitor
        with monitor.desk.take("open" if open_ else "close") as wish:
            driver = monitor.ready(homed=False)
            grip = self.config.gripper
            high = (grip.closed_by == "set") is not open_
            await driver.send(f"{'SB' if high else 'CB'} {grip.output}")
            await wish.pause(self._loop.time() + grip.settle_time)
            await monitor.look()
            self.events.emit(Kind.GRIPPER_OPEN if open_ else Kind.GRIPPER_CLOSED)

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path, past every queue; tell how long and how far it takes.

        Raises `NotConnected`; never `Busy`.
        """
        monitor = self._monitor
        driver = monitor.link.driver
        sent = driver.urgent("ST S")
        report = self._stop_report()
        wish = monitor.desk.current
        if wish is not None:
            monitor.stopping = monitor.run is not None or monitor.phase is not None
            wish.interrupt(Stopped())
            monitor.publish()
        with suppress(CommandRejected):  # a refused ST S means that there is no sequence
            await sent
        record = await self._stop_strays(driver)
        if wish is None and monitor.moving():
            self.events.emit(Kind.STOPPED)
        return report or self._braking(record)

    async def abort(self) -> None:
        """Stop without deceleration (Galil AB 1). Motors that OE guards go off, which is a fault to recover from."""
        monitor = self._monitor
        driver = monitor.link.driver
        sent = driver.urgent("AB 1")
        wish = monitor.desk.current
        if wish is not None:
            wish.interrupt(Stopped())
        await sent
        await monitor.look()
        off = monitor.motor_off()
        if isinstance(off, MachineError):
            monitor.fail(off, driver)

    async def recover(self) -> None:
        """Clear a fault once its cause is gone; moves nothing, switches motors on where they are.

        Raises `NothingToRecover`; `NotConnected`, `AbortInput`, `AmplifierFault` while the cause lasts; `Busy`
        while the axes still finish what was sent.
        """
        monitor = self._monitor
        driver = monitor.link.driver
        if monitor.fault is None:
            raise NothingToRecover
        with monitor.desk.take("recover"):
            record = await monitor.look()
            if monitor.moving():
                raise Busy(doing="the axes finish what was sent before")
            if await driver.value("_AB") == 0.0:
                raise AbortInput
            if record.amplifier_status:
                raise AmplifierFault(status=f"{record.amplifier_status:#010x}")
            await configure(driver, self.config)
            await monitor.install_guard(driver)
            if await driver.value("_AB") == 0.0:  # pressed meanwhile: no motor is switched on again
                raise AbortInput
            await monitor.power(driver)
            if isinstance(monitor.fault, LimitReached) or not await monitor.adopt(driver):
                monitor.homed = False
                await marker.erase(driver)
            monitor.fault = None
            self.events.emit(Kind.RECOVERED)
            if not monitor.homed:
                self.events.emit(Kind.NOT_HOMED)
            monitor.publish()

    def preview(self, path: Sequence[Joints], *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would; raises what the motion would raise, sends nothing."""
        return self._planner.preview(self.workspace, [Joints(*point) for point in path], speed)

    async def _travel(self, name: str, path: Callable[[Joints], list[Joints]], speed: float) -> None:
        monitor = self._monitor
        async with self._motion(name, homed=True) as (wish, driver):
            known = monitor.here()
            plan = self._planner.plan(self.workspace, path(known), speed)  # what is refused says nothing on the wire
            await monitor.look()
            if monitor.moving():
                raise Busy(doing="the axes finish what was sent before")
            if monitor.here() != known:
                plan = self._planner.plan(self.workspace, path(monitor.here()), speed)
            wish.check()
            if plan.move is not None:
                self.events.emit(Kind.MOVING, to=str(tuple(round(value, 4) for value in plan.points[-1])))
                await self._execute(wish, driver, plan.move)
        if plan.move is not None:
            self.events.emit(Kind.IDLE)

    async def _execute(self, wish: Wish, driver: Driver, move: CoordinatedMove) -> None:
        """Send a plan, begin it, wait for its predicted end, then make sure of it."""
        monitor = self._monitor
        await monitor.wake_guard(driver)
        await monitor.load(driver, commands(move))
        # Between this look at the wish and the bytes of BGS nothing can come in: no await stands there.
        wish.check()
        members = tuple(i for i in range(3) if self.config.axes[i].letter in move.axes)
        began = self._loop.time()
        monitor.run = Run(move, began, members)
        try:
            await driver.send("BGS")
        except CommandRejected as refusal:
            await monitor.look()
            raise monitor.motor_off() or refusal from refusal
        monitor.publish()
        await wish.pause(began + move.duration + SETTLE)
        record = await self._ended(wish, began + move.duration * 1.05 + LATE)
        try:
            self._arrived(record, move, members)
        except Stopped:
            await monitor.load(driver, [])  # the guard did it, if this program slept until now
            wish.check()
            raise
        monitor.run = None

    async def _ended(self, wish: Wish, latest: float) -> DataRecord:
        record = await self._monitor.look()
        while self._monitor.moving():
            if self._loop.time() > latest:
                raise EndNotReached(axis="a, b or c", distance="an unknown way, still moving,")
            await wish.pause(self._loop.time() + 0.01)
            record = await self._monitor.look()
        return record

    def _arrived(self, record: DataRecord, move: CoordinatedMove, members: tuple[int, ...]) -> None:
        found = faults.cause(record, self._monitor.order, members)
        if found is not None:
            raise found
        for i in members:
            axis = record.axes[self._monitor.order[i]]
            away = abs(axis.position - move.end[i])
            if axis.reference != move.end[i] or away > self.config.axes[i].error_limit_counts // 4:
                raise EndNotReached(axis=AXES[i], distance=f"{away} counts")

    @asynccontextmanager
    async def _motion(self, name: str, *, homed: bool) -> AsyncIterator[tuple[Wish, Driver]]:
        """Hold the desk for a motion; whatever ends it early, the axes are at rest before the block is left."""
        monitor = self._monitor
        with monitor.desk.take(name) as wish:
            driver = monitor.ready(homed=homed)
            try:
                yield wish, driver
            except (asyncio.CancelledError, Stopped):
                await self._rest(driver)
                self.events.emit(Kind.STOPPED)
                raise
            except MachineError as error:
                await self._rest(driver)
                monitor.fail(error, driver)
                raise
            except Exception:
                if monitor.run is not None or monitor.phase is not None:
                    await self._rest(driver)
                raise
            finally:
                monitor.run = None
                monitor.phase = None
                monitor.stopping = False
                monitor.publish()

    async def _rest(self, driver: Driver) -> None:
        """Brake on the path and wait until nothing moves; a cancel that comes meanwhile takes effect afterwards."""
        resting = self._loop.create_task(self._come_to_rest(driver))
        cancelled = False
        while not resting.done():
            try:
                await asyncio.wait({resting})
            except asyncio.CancelledError:
                cancelled = True
        resting.result()
        if cancelled:
            raise asyncio.CancelledError

    async def _come_to_rest(self, driver: Driver) -> None:
        """Brake and look until nothing moves; a lost link cannot be waited for."""
        if driver.lost.done():
            return
        try:
            await brake(driver)
            await self._monitor.look()
            while self._monitor.moving():
                await asyncio.sleep(0.02)
                await self._monitor.look()
        except (NotConnected, MachineError):
            if not driver.lost.done():
                raise

    async def _stop_strays(self, driver: Driver) -> DataRecord:
        """Stop axes that move outside the coordinated sequence, which ST S does not reach; return the record."""
        record = await self._monitor.look()
        axes = ((axis.letter, record.axes[place]) for axis, place in self._monitor.places())
        letters = sorted(letter for letter, axis in axes if axis.moving and not axis.coordinated)
        if letters:
            await driver.urgent(f"ST{''.join(letters)}")
        return record

    def _stop_report(self) -> StopReport | None:
        """Return what a stop said now makes of the motion under way, None where its plan is not known."""
        run = self._monitor.run
        if run is None:
            return None
        elapsed = self._loop.time() - run.began
        duration, end = run.move.stop_at(elapsed)
        here = run.move.position_at(elapsed)
        return StopReport(duration > 0.0, duration, (end.a - here.a, end.b - here.b, end.c - here.c))

    def _braking(self, record: DataRecord) -> StopReport:
        """Return what a stop makes of a motion known by its speeds only: v / a and v t / 2 of every axis.

        Axes of a sequence come to rest together, with the one that takes longest.
        """
        axes = [(record.axes[place], axis.stop_deceleration_counts) for axis, place in self._monitor.places()]
        alone = [abs(axis.velocity) / rate if axis.moving else 0.0 for axis, rate in axes]
        together = max((time for time, (axis, _) in zip(alone, axes, strict=True) if axis.coordinated), default=0.0)
        times = [together if axis.coordinated else time for time, (axis, _) in zip(alone, axes, strict=True)]
        a, b, c = (
            0.5 * axis.velocity * time / unit
            for (axis, _), time, unit in zip(axes, times, self.units.per_unit, strict=True)
        )
        return StopReport(self._monitor.moving(), max(times), (a, b, c))
