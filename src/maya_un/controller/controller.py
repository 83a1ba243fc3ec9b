"""The controller layer on a Galil DMC-41x3. The rules of safety are here or lower, so that no edge can bypass them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.reading import only_reads
from dmc41x3.language.record import DataRecord
from maya_un.config import Config
from maya_un.controller import datum
from maya_un.controller.command_slot import RunningCommand
from maya_un.controller.datum import GivenDatum
from maya_un.controller.execution import GUARDED_MOVE, Execution, Pacing
from maya_un.controller.fault_monitor import FaultMonitor
from maya_un.controller.homing import HomingRun, guarded_move, homed_pose
from maya_un.controller.homing_mark import erase, leave
from maya_un.controller.monitor import Monitor
from maya_un.controller.planner import Jogging, MotionPlan, Planner, Planning, name_of
from maya_un.controller.protocol import Inspection, MotionRun, OnVia, Preview, require_output
from maya_un.controller.registers import Dial
from maya_un.controller.seek import Seeker
from maya_un.controller.stopping import MotionStopper
from maya_un.errors import (
    AbortInput,
    AmplifierFault,
    Busy,
    DatumNeeded,
    DatumRefused,
    LimitReached,
    MachineError,
    MarkerMissing,
    NotConnected,
    NothingToRecover,
    OwnershipLost,
    Stopped,
    TerminalReadsOnly,
)
from maya_un.events import (
    DatumConfirmed,
    DatumGiven,
    EventLog,
    FaultCleared,
    GripperClosed,
    GripperOpened,
    HomingBegun,
    HomingDone,
    HomingNeeded,
    MotionBegun,
    MotionEnded,
    MotionStopped,
    OutputCleared,
    OutputSet,
    ZonesChanged,
)  # fmt: skip
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Workspace
from maya_un.kinematics.zones import Zone
from maya_un.motion.path import Route
from maya_un.schema.robot import Jogged, LinkView, Signals
from maya_un.values import LEAST_SPEED, JogDirection, Joints, Progress, State, StopReport
from maya_un.workers import Workers

_Way = Callable[[RunningCommand, Joints], Awaitable[Route]]
"""Returns the path of a command from the robot's position."""


class GalilController:
    """Joint-space control of Maya through one handle of its motion controller; see `protocol.Controller`.

    `dial` opens the transport; messages name the controller by `address`. A `live` controller reads the data record at
    the configured rate and runs a guard in the motion controller, which stops the axes if this program falls silent.
    Without `live` (dry runs) the state is renewed at every command only. `workers` plan the motions; without workers
    this process plans them.
    """

    def __init__(
        self, dial: Dial, address: str, config: Config, *, live: bool = True, workers: Workers | None = None
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._monitor = Monitor(dial, address, config)
        self._fault_monitor = FaultMonitor(self._monitor, live=live)
        self._planner = Planner(config, self._monitor.mechanism)
        self._jogging = Jogging(self._planner, self._monitor.mechanism)
        self._planning = Planning(self._planner, self._jogging, workers)
        self._stopping = MotionStopper(self._monitor)
        self._pacing = Pacing(self._monitor)
        self._execution = Execution(self._monitor, self._fault_monitor)
        self.config = config
        self.units = self._monitor.units
        self.stops = 0
        self._live = live
        self._along_vector = False

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
        """The workspace; its strokes are the measured ones once the robot is homed."""
        return self._monitor.workspace

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The zones that the robot keeps out of."""
        return self._monitor.workspace.zones

    def set_zones(self, zones: Sequence[Zone]) -> None:
        """Set the zones that all motion but homing avoids from now on; raises `Busy` while something moves.

        A zone that contains the robot is accepted. No motion then passes the check until that zone is removed.
        """
        monitor = self._monitor
        with monitor.slot.take("zones"):
            if monitor.moving():
                raise Busy(doing="the axes finish an earlier motion")
            monitor.workspace = monitor.workspace.with_zones(zones)
        self.events.emit(ZonesChanged(", ".join(zone.name for zone in zones)))

    @property
    def events(self) -> EventLog:
        """Facts in order."""
        return self._monitor.events

    @property
    def state(self) -> State:
        """Latest state."""
        return self._monitor.state

    @property
    def record(self) -> DataRecord | None:
        """The latest data record as the controller sent it, None before the first."""
        return self._monitor.record

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        return self._monitor.watch()

    def progress(self) -> Progress | None:
        """How far the motion under way has come, None at rest."""
        return self._monitor.progress()

    def signals(self) -> Signals | None:
        """Return the signals in the latest record, None while disconnected."""
        return self._monitor.signals()

    async def interrogate(self, command: str) -> str:
        """Return the controller's answer to a command that only reads, which needs no ownership and no slot.

        Raises `TerminalReadsOnly` for any other text, `CommandRejected`, `NotConnected`, and the loss of the link.
        """
        if not only_reads(command):
            raise TerminalReadsOnly(command=command)
        return await self._monitor.link.driver.exact(command)

    def link(self, speed: float) -> LinkView:
        """Return the quality of the link, in real time; the loop's clock runs at `speed` times real time."""
        return self._monitor.quality.view(self._loop.time(), speed, up=self._monitor.link.up)

    @property
    def run(self) -> MotionRun | None:
        """The motion under way, None at rest and in a homing."""
        return self._monitor.run

    def tap(self, listener: Callable[[str, bytes], None]) -> None:
        """Pass every byte on the wire to `listener` ("tx" or "rx") from now on.

        A new listener replaces the earlier one.
        """
        self._monitor.link.tap(listener)

    async def open(self, *, take_over: bool = False) -> None:
        """Connect, claim the controller, and write the configured registers; sends no motion.

        With `take_over`, claims also a controller at rest whose owner is alive. Raises `ConnectFailed`, `LinkTimeout`,
        `WrongController`, `ControllerOwned`, `ControllerMoves`, `ParameterMismatch`, `GuardBlocked`.
        """
        driver = await self._monitor.open()
        try:
            await self._fault_monitor.claim(driver, take_over=take_over)
            if not self._monitor.moving():
                await self._monitor.registers.adopt(driver)
            await self._fault_monitor.install_guard(driver)
        except BaseException:
            await self._end()
            raise
        self._monitor.announce()
        self._fault_monitor.begin()

    async def close(self) -> None:
        """Brake if something moves, and release the handle, also if braking failed; then raises the error of `stop`."""
        try:
            if self._monitor.slot.current is not None and self._monitor.link.up:
                await self.stop()
                await self._monitor.slot.free()
        finally:
            await self._end()

    async def _end(self) -> None:
        await self._fault_monitor.close()
        await self._monitor.close()

    async def skip_home(self) -> None:
        """Adopt the homing whose mark is stored in the controller.

        Raises `MarkerMissing` if the controller has no valid mark, `PositionNotKept` if an axis has moved since,
        `Busy`, `NotConnected`, `Faulted`, and ownership and configuration errors.
        """
        monitor = self._monitor
        with monitor.slot.take("skip home"):
            driver = monitor.ready(homed=False)
            await self._at_rest_and_owned(driver)
            await monitor.require_kept(driver)
            if not await monitor.adopt(driver):
                raise MarkerMissing
            monitor.displaced = None
            await monitor.power(driver)
            monitor.hold(driver)
            self.events.emit(HomingDone())
            monitor.publish()

    async def home(self) -> None:
        """Find the switches, define the counts, measure the strokes (`controller.homing`).

        If the machine needs a person for that, only go to the homed pose, once a datum is given. Raises the errors of a
        motion, and `WiringContradictsCn`, `HomingStalled`, `SwitchNotFound`, `StrokeDiffers`, `DatumNeeded`.
        """
        monitor = self._monitor
        if self.config.person_needed:
            monitor.ready(homed=False)
            if not monitor.homed:
                raise DatumNeeded(reason=self.config.person_needed)
            await self.move(homed_pose(self.config))
            return
        async with self._motion("home", homed=False) as (command, driver):
            await self._execution.allowed_whole(command)
            await self._at_rest_and_owned(driver)
            monitor.homed, monitor.displaced = False, None
            await erase(driver)
            await monitor.power(driver)
            await self._fault_monitor.wake_guard(driver)
            self.events.emit(HomingBegun())
            seeker = self._seeker(command, driver)
            found = await HomingRun(seeker, driver, self.config, self.units, monitor.enter_phase).run()
            await leave(driver, found, self.units)
            monitor.set_homed(found)
            monitor.seeking, monitor.phase = False, None
            await monitor.look()
            monitor.hold(driver)
            self.events.emit(HomingDone())
        monitor.publish()

    @property
    def datum(self) -> GivenDatum | None:
        """The datum that a person gave, None without one, or if switches have shown the position."""
        return self._monitor.given if self._monitor.homed else None

    async def give_datum(self, joints: Joints, *, by: str, confirmed: bool = False) -> None:
        """Believe `by`, a person, that the robot stands at `joints` (rad, m, m), within the bounds of `datum`.

        Nothing moves. Raises `Unreachable`, `Busy`, `NotConnected`, `Faulted`, ownership and configuration errors.
        """
        monitor = self._monitor
        with monitor.slot.take("datum"):
            driver = monitor.ready(homed=False)
            datum.narrowed(Workspace.of(self.config)).with_zones(()).require(joints)
            await self._at_rest_and_owned(driver)
            await monitor.believe(driver, GivenDatum(joints, confirmed))
            self.events.emit(DatumGiven(by, str(tuple(round(value, 4) for value in joints))))
            monitor.publish()

    async def confirm_datum(self, joints: Joints, *, by: str) -> None:
        """Compare the position with what `by`, a person, states (rad, m, m); raises as `Controller.confirm_datum`."""
        monitor = self._monitor
        with monitor.slot.take("datum"):
            driver = monitor.ready(homed=True)
            await self._at_rest_and_owned(driver)
            await monitor.confirm(driver, joints)
            self.events.emit(DatumConfirmed(by))
            monitor.publish()

    async def guarded_move(self, axis: str, distance: float) -> Jogged:
        """Move one axis of a robot that is not homed by at most `datum.NUDGE`, slowly; return the distance moved.

        It ends at a limit switch, and does not begin towards an active one: the answer names what it met. Raises
        `InvalidValue`, `DatumRefused`, `HomingStalled` if the axis does not follow, and the errors of a motion.
        """
        number, monitor = datum.require_nudge(axis, distance), self._monitor
        async with self._motion(GUARDED_MOVE, homed=False) as (command, driver):
            if monitor.homed:
                raise DatumRefused(reason=phrase("the robot is homed; use `maya jog`"))
            await self._execution.allowed_whole(command)
            await self._at_rest_and_owned(driver)
            await monitor.power(driver)
            await self._fault_monitor.wake_guard(driver)
            seeker = self._seeker(command, driver)
            gone = await guarded_move(seeker, self.config, self.units, number, distance)
            monitor.seeking = False
            await monitor.look()
            monitor.hold(driver)
        monitor.publish()
        return gone

    def _seeker(self, command: RunningCommand, driver: Driver) -> Seeker:
        """Return what moves axes at unknown positions, and expect such motion."""
        self._monitor.seeking = True
        self._monitor.reckoning.forget()
        return Seeker(driver, self.config, self.units, command.wait, self._loop.time, self._fault_monitor.load)

    async def _at_rest_and_owned(self, driver: Driver) -> None:
        """Write the registers of a controller that is ours and at rest; raises `Busy`, and ownership errors."""
        monitor = self._monitor
        await monitor.look()
        if monitor.moving():
            raise Busy(doing="the axes finish an earlier motion")
        await self._fault_monitor.require_owned(driver)
        await monitor.registers.adopt(driver)

    async def move(self, target: Joints, *, speed: float = 1.0) -> None:
        """Move to `target` (rad, m, m), straight in joint space; `speed` scales the limits, from 0.001 to 1."""

        async def way(_command: RunningCommand, here: Joints) -> Route:
            return [here, target]

        await self._travel("move", way, speed)

    async def follow(self, path: Route, *, speed: float = 1.0, on_via: OnVia | None = None) -> None:
        """Move along `path`; raises `TrajectoryRefused` unless it starts at the robot's position.

        Calls `on_via` with the number of every waypoint between the ends, from 0, as the robot passes it.
        """

        async def way(_command: RunningCommand, here: Joints) -> Route:
            return self._planner.begun_at(path, here)

        await self._travel("follow", way, speed, on_via)

    async def jog(self, axis: JogDirection, distance: float, *, speed: float = 1.0, clip: bool = False) -> Jogged:
        """Move along one of `axes.JOG_AXES` by `distance` (rad or m), or with `clip` as far as the workspace allows.

        Returns the distance and the limit that shortened it. Raises `UnknownName` for another axis. Along a vector,
        `speed` is that of the beginning, and `jog_speed` changes it.
        """
        gone, vector, begun = Jogged(name_of(axis), distance), not isinstance(axis, str), False

        async def way(command: RunningCommand, here: Joints) -> Route:
            nonlocal gone, begun
            if vector and not begun:
                begun = self._along_vector = True
                self._monitor.pace.change(share=speed)
            gone = await self._planning.jogged(command, self.workspace, axis, here, distance) if clip else gone
            return self._jogging.path(axis, here, gone.distance)

        try:
            await self._travel("jog", way, 1.0 if vector else speed)
        finally:
            if begun:
                self._along_vector = False
                self._monitor.pace.change(share=1.0)
        return gone

    async def jog_speed(self, speed: float) -> bool:
        """Scale the speed of the jog along a vector under way to `speed`, from 0.01 to 1 of the full speed, at once.

        Return False without such a jog. Raises `InvalidValue`.
        """
        if not self._along_vector:
            return False
        await self._pacing.scale(speed)
        return True

    async def gripper(self, open_: bool) -> None:
        """Open or close the gripper and wait until it has moved, in a pause after its end; needs no homing."""
        monitor = self._monitor
        with monitor.slot.take("open" if open_ else "close") as command:
            driver = monitor.ready(homed=False)
            await self._execution.allowed(command)
            grip = self.config.gripper
            high = (grip.closed_by == "set") is not open_
            await self._fault_monitor.output(driver, grip.output, high=high)
            await command.wait(self._loop.time() + grip.settle_time)
            await monitor.look()
            self.events.emit(GripperOpened() if open_ else GripperClosed())
            command.check()

    async def output(self, number: int, *, on: bool) -> None:
        """Switch an output of `controller.outputs`, in a pause after its end; raises `InvalidValue` for others."""
        require_output(self.config, number)
        monitor = self._monitor
        with monitor.slot.take("output") as command:
            driver = monitor.ready(homed=False)
            await self._execution.allowed(command)
            await self._fault_monitor.output(driver, number, high=on)
            self.events.emit(OutputSet(number) if on else OutputCleared(number))
            await monitor.look()
            command.check()

    async def input(self, number: int) -> bool:
        """Return whether digital input `number`, from 1 to 8, is high; raises `NotConnected`.

        A live controller has it from the latest record, another one reads it.
        """
        if not self._live:
            await self._monitor.look()
        signals = self._monitor.signals()
        if signals is None:
            raise NotConnected
        return signals.inputs[number - 1]

    async def stop(self) -> StopReport:
        """Begin to brake at once, on the path, past every queue; return the duration and distance of braking.

        A paused motion ends too. Raises `NotConnected`; never `Busy`.
        """
        self.stops += 1
        return await self._stopping.stop()

    async def override(self, ratio: float) -> None:
        """Scale the speed of the motion under way, from now on, and of all later ones (Galil VR).

        `ratio` is from 0.01 to 1; ramps keep their steepness. A homing keeps its own speeds. Raises `InvalidValue`.
        """
        await self._pacing.override(ratio)

    async def pause(self, *, ahead: bool = False) -> StopReport:
        """Brake on the path and hold all motion until `resume`; return the duration and distance of braking.

        A motion, a gripper command or an output that is requested meanwhile waits. A stop, a fault or `recover` ends a
        pause; a pause has no time limit. With `ahead`, the next motion is held even if nothing is under way now. Raises
        `CannotPause` for a homing, a guarded move, and if nothing is under way; `Faulted`, `NotConnected`.
        """
        return await self._pacing.pause(ahead=ahead)

    async def resume(self) -> None:
        """Continue motion after a pause; raises `NotPaused`, `NotConnected`."""
        await self._pacing.resume()

    async def abort(self) -> None:
        """Stop without deceleration (Galil AB 1).

        Motors with OE set switch off, which is a fault that needs `recover`.
        """
        self.stops += 1
        monitor = self._monitor
        driver = monitor.link.driver
        sent = driver.urgent("AB 1")
        command = monitor.slot.current
        if command is not None:
            command.interrupt(Stopped())
        monitor.release()
        await sent
        await monitor.look()
        off = monitor.motor_off()
        if isinstance(off, MachineError):
            monitor.fail(off, driver)

    async def recover(self, *, take_over: bool = False) -> None:
        """Clear a fault whose cause is gone; moves nothing, switches motors on at their positions.

        Claims a controller back from another program if that program ended, or with `take_over`. Raises
        `NothingToRecover`; `NotConnected`, `AbortInput`, `AmplifierFault` while the cause lasts; `Busy` while the axes
        still finish earlier commands; `ControllerOwned`.
        """
        monitor = self._monitor
        driver = monitor.link.driver
        if monitor.fault is None:
            raise NothingToRecover
        with monitor.slot.take("recover"):
            record = await monitor.look()
            if monitor.moving():
                raise Busy(doing="the axes finish an earlier motion")
            if await driver.value("_AB") == 0.0:
                raise AbortInput
            if record.amplifier_status:
                raise AmplifierFault(status=f"{record.amplifier_status:#010x}")
            await self._fault_monitor.claim(driver, take_over=take_over)
            await monitor.registers.adopt(driver)
            await self._fault_monitor.install_guard(driver)
            if await driver.value("_AB") == 0.0:  # pressed meanwhile: no motor is switched on again
                raise AbortInput
            await monitor.power(driver)
            self._fault_monitor.begin()
            void = monitor.displaced is not None or isinstance(monitor.fault, LimitReached)
            if isinstance(monitor.fault, OwnershipLost):  # another program moved the axes
                void = void or not await monitor.kept(driver)
            if void or not await monitor.adopt(driver):
                monitor.homed = False
                await erase(driver)
            monitor.displaced = None
            monitor.hold(driver)
            monitor.fault = None
            monitor.release()
            self.events.emit(FaultCleared())
            if not monitor.homed:
                self.events.emit(HomingNeeded())
            monitor.publish()

    def preview(self, path: Route, *, speed: float = 1.0) -> Preview:
        """Check and time `path` as a motion would; raises the errors of that motion, sends nothing."""
        return self._planner.preview(self.workspace, path, self.allowed(speed))

    def inspect(self, path: Route, *, speed: float = 1.0, samples: int = 200) -> Inspection | None:
        """Return the details of the motion along `path`, None if the path has no length; raises as `preview` does."""
        return self._planner.inspect(self.workspace, path, self.allowed(speed), samples)

    async def _travel(self, name: str, way: _Way, speed: float, on_via: OnVia | None = None) -> None:
        async with self._motion(name, homed=True) as (command, driver):
            plan = await self._planned(command, way, speed)
            begun = plan.move is None
            while plan.move is not None and not begun:
                if self._monitor.pace.paused:
                    await self._execution.allowed(command)
                    plan = await self._planned(command, way, speed)
                    continue
                command.check()
                self.events.emit(MotionBegun(str(tuple(round(value, 4) for value in plan.end))))
                begun = await self._execution.carry_out(command, driver, plan, on_via)
        if plan.move is not None:
            self.events.emit(MotionEnded())

    async def _planned(self, command: RunningCommand, way: _Way, speed: float) -> MotionPlan:
        """Return the plan from the reference position of the newest record; raises the errors of motion."""
        monitor = self._monitor
        known = monitor.here()
        plan = await self._plan(command, way, known, speed)  # an error here leaves the controller untouched
        await monitor.look()
        if monitor.displaced is not None:
            raise monitor.displaced
        if monitor.moving():
            raise Busy(doing="the axes finish an earlier motion")
        here = monitor.here()
        return plan if here == known else await self._plan(command, way, here, speed)

    async def _plan(self, command: RunningCommand, way: _Way, here: Joints, speed: float) -> MotionPlan:
        speed = self.allowed(speed)
        return await self._planning.plan(command, self.workspace, await way(command, here), speed)

    def allowed(self, speed: float) -> float:
        """Return the share of the speeds with which a motion may run that was requested with `speed`."""
        return max(LEAST_SPEED, speed * datum.SPEED) if self._monitor.uncertain and speed > 0.0 else speed

    @asynccontextmanager
    async def _motion(self, name: str, *, homed: bool) -> AsyncIterator[tuple[RunningCommand, Driver]]:
        """Hold the slot for a motion; if it ends early, the axes are at rest before the block ends."""
        monitor = self._monitor
        with monitor.slot.take(name) as command:
            driver = monitor.ready(homed=homed)
            try:
                yield command, driver
                command.check()  # a stop may have arrived during the last read: no further motion may start
            except asyncio.CancelledError:
                await self._stopping.rest(driver, self._tell_stopped)
                raise
            except Stopped:
                await self._stopping.rest(driver, self._release_stopped)
                raise
            except OwnershipLost as error:  # the motion may be the new owner's: the guard stops ours
                monitor.fail(error, driver)
                raise
            except MachineError as error:
                raise await self._at_rest_after(error, driver) from error.__cause__
            except Exception:
                if monitor.under_way:
                    await self._stopping.rest(driver)
                raise
            finally:
                monitor.forget_motion()

    async def _at_rest_after(self, error: MachineError, driver: Driver) -> MachineError:
        """Come to rest, enter the fault state, and return the error that names its cause."""
        named = error

        async def name() -> None:
            nonlocal named
            named = await self._fault_monitor.name(driver, error)

        await self._stopping.rest(driver, lambda: self._monitor.fail(named, driver), name)
        return named

    def _tell_stopped(self) -> None:
        self.events.emit(MotionStopped())

    def _release_stopped(self) -> None:
        self._monitor.release()
        self._tell_stopped()
