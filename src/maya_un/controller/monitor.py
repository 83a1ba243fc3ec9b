"""The known state of the machine: link, latest record, expected positions, whether homed, events, and a latched fault.

The reference of an axis (Galil DMC-41x3, command RP) changes by motion, by DP, and by SH, which sets it to the position
of the axis. So at rest it does not change, and in motion it stays on the path.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator, Sequence

import numpy as np

from dmc41x3.driver import Driver
from dmc41x3.i18n import phrase
from dmc41x3.language.record import DataRecord
from maya_un.axes import AXES
from maya_un.config import AxisConfig, Config, Units
from maya_un.controller import datum, homing_mark, state_builder
from maya_un.controller.command_slot import ExclusiveSlot
from maya_un.controller.datum import GivenDatum
from maya_un.controller.link_quality import LinkQuality
from maya_un.controller.protocol import MotionPace, MotionRun, homing_progress
from maya_un.controller.registers import Dial, DriverLink, Registers, Torque
from maya_un.controller.state_builder import ControllerStatus, StateBuilder
from maya_un.errors import (
    CommandRejected,
    ControllerReset,
    Faulted,
    ForeignMotion,
    MachineError,
    MayaError,
    MotorOff,
    NotConnected,
    NotHomed,
    OwnershipLost,
    PositionChanged,
    PositionNotKept,
)
from maya_un.events import Connected, Disconnected, EventLog, HomingNeeded, PhaseBegun
from maya_un.kinematics.mechanism import Mechanism
from maya_un.kinematics.workspace import Stroke, Workspace
from maya_un.motion.polyline import Polyline
from maya_un.schema.robot import Signals
from maya_un.values import Joints, Mode, Progress, State


class StateBroadcaster:
    """Holds the newest `state` and passes it to all watchers; a slow watcher delays no other."""

    def __init__(self, state: State) -> None:
        self.state = state
        self._newer = asyncio.Event()

    def show(self, state: State) -> None:
        """Replace the state by a newer one, and wake all watchers."""
        self.state = state
        self._newer.set()
        self._newer.clear()

    async def watch(self, shown: State | None = None) -> AsyncIterator[State]:
        """Yield the present state, unless it is `shown`, and then every newer state.

        A slow reader skips to the newest.
        """
        while True:
            if self.state is not shown:
                shown = self.state
                yield shown
            else:
                await self._newer.wait()

    async def until(self, holds: Callable[[], bool]) -> None:
        """Return when `holds` returns True; it is called now and after every newer state."""
        while not holds():
            await self._newer.wait()


SETTLED = 20
"""Greatest distance of an axis at rest from its reference [counts]; SH changes the reference by no more."""

_ON_PATH = 16
"""In motion, the reference is within this share of the error limit (ER) of its path."""

_PUSHED = 4
"""An axis that is farther than this share of the error limit (ER) from its reference at rest was pushed."""

Counts = Sequence[float]


class PositionReckoner:
    """Known positions of Maya's axes at rest."""

    def __init__(self, config: Config, order: state_builder.Order) -> None:
        self._config = config
        self._units = Units.of(config)
        self._order = order
        self._last: DataRecord | None = None

    def forget(self) -> None:
        """Forget the positions, as during a motion of this program."""
        self._last = None

    def compare(self, record: DataRecord) -> MachineError | None:
        """Store a record of axes at rest; return the error for a foreign change, None without one.

        If an axis moves, another program began the motion, unless no record was stored before.
        """
        last = self._last
        if last is None:
            self._last = None if any(record.axes[place].moving for place in self._order) else record
            return None
        found = self._foreign(record) or self._changed(last, record) or self._pushed(record)
        self._last = record if found is None else None
        return found

    def _foreign(self, record: DataRecord) -> ForeignMotion | None:
        return next(
            (ForeignMotion(axis=AXES[i]) for i, place in enumerate(self._order) if record.axes[place].moving), None
        )

    def _changed(self, last: DataRecord, record: DataRecord) -> PositionChanged | None:
        for i, place in enumerate(self._order):
            before, now = last.axes[place], record.axes[place]
            if now.reference == before.reference:
                continue
            taken = abs(now.reference - before.position) <= SETTLED and abs(now.position - before.position) <= SETTLED
            if not taken:
                return self.changed(i, now.reference - before.reference)
        return None

    def _pushed(self, record: DataRecord) -> PositionChanged | None:
        for i, place in enumerate(self._order):
            axis = record.axes[place]
            away = axis.position - axis.reference
            if not axis.motor_off and abs(away) > self._config.axes[i].error_limit_counts // _PUSHED:
                return self.changed(i, away)
        return None

    def changed(self, axis: int, counts: float) -> PositionChanged:
        """Return the error for an axis (0 to 2) that is `counts` away from its expected position."""
        return PositionChanged(axis=AXES[axis], distance=self.shown(axis, counts))

    def shown(self, axis: int, counts: float) -> str:
        """Return a distance in counts of an axis (0 to 2) as text."""
        way = abs(counts) / self._units.per_unit[axis]
        return phrase("{angle} deg", angle=f"{way * 57.29577951308232:.2f}") if axis == 0 else f"{way * 1000.0:.2f} mm"

    def astray(self, path: Polyline, here: Counts) -> PositionChanged | None:
        """Return the error for a reference `here` that is not on `path` [counts]."""
        away = path.nearest(np.asarray(here, dtype=np.float64)).away
        for i, counts in enumerate(away.tolist()):
            if abs(counts) > max(SETTLED, self._config.axes[i].error_limit_counts // _ON_PATH):
                return self.changed(i, counts)
        return None


OFF_SWITCH = (0.002, 0.001, 0.001)
"""Travel ends this far short of a long end's switch (rad, m, m), so that arriving there does not trip it."""


class Monitor:
    """Maintains the link, reads the record on request, publishes states and events. Never sends motion.

    `on_returned` is called when the controller answers again after a loss and the state has been published.
    """

    def __init__(self, dial: Dial, address: str, config: Config) -> None:
        self._loop = asyncio.get_running_loop()
        self.config = config
        self.units = Units.of(config)
        self.mechanism = Mechanism.of(config)
        self.workspace = Workspace.of(config)
        self.events = EventLog(self._loop.time)
        self.order = state_builder.indices(config)
        self.registers = Registers(config)
        self.torque = Torque(config)
        self.reckoning = PositionReckoner(config, self.order)
        self.displaced: MachineError | None = None
        self.slot = ExclusiveSlot()
        self.link = DriverLink(dial, address, config.controller.timeout, self._on_lost, self._on_back)
        self.quality = LinkQuality()
        self.pace = MotionPace()
        self.run: MotionRun | None = None
        self.phase: tuple[str, float] | None = None
        self.stopping = False
        self.live = False
        self.seeking = False
        self.unpausable = False
        self.homed = False
        self.given: GivenDatum | None = None
        self.powered = False
        self.fault: MayaError | None = None
        self.record: DataRecord | None = None
        self.on_returned: Callable[[Driver], None] | None = None
        self._down = True
        self._lens = StateBuilder(config, self.units, self.mechanism, self.order)
        self._latest = StateBroadcaster(self._compose())

    @property
    def state(self) -> State:
        """Latest state."""
        return self._latest.state

    async def open(self) -> Driver:
        """Connect and read the record; raises `ConnectFailed`, `LinkTimeout`, `WrongController`."""
        driver = await self.link.open()
        self._down = False
        await self.look()
        return driver

    def announce(self) -> None:
        """Emit the events that the controller is connected and not homed."""
        self.events.emit(Connected(self.link.address, self.link.firmware))
        self.events.emit(HomingNeeded())
        self.publish()

    async def close(self) -> None:
        """End the link."""
        await self.link.close()

    def signals(self) -> Signals | None:
        """Return the signals in the latest record, None before the first and while disconnected."""
        if self.record is None or not self.link.up:
            return None
        return self._lens.signals(self.record, self.state)

    def watch(self) -> AsyncIterator[State]:
        """Yield the state now and every newer one; a slow reader skips to the newest."""
        return self._latest.watch()

    def progress(self) -> Progress | None:
        """Progress of the motion under way, None at rest; the phases of a homing have no known duration."""
        now = self._loop.time()
        if self.run is not None:
            name = self.slot.current.name if self.slot.current else "move"
            return Progress(name, *self.run.times(now))
        if self.phase is not None:
            return homing_progress(self.phase[0], now - self.phase[1])
        return None

    def ready(self, *, homed: bool) -> Driver:
        """Return the driver if motion is allowed; raises `NotConnected`, `Faulted`, `NotHomed`."""
        driver = self.link.driver
        if self.fault is not None:
            raise Faulted(fault=str(self.fault))
        if homed and not self.homed:
            raise NotHomed(command=self.config.homing_command)
        return driver

    async def look(self) -> DataRecord:
        """Read the record, renew the state, and return the record."""
        asked = self._loop.time()
        self.record = await self.link.driver.record()
        self.quality.replied(asked, self._loop.time())
        self._reckon(self.record)
        self.publish()
        return self.record

    def _reckon(self, record: DataRecord) -> None:
        """Detect a position that changes, or an axis that moves, without a motion of this program."""
        if self.under_way or isinstance(self.fault, OwnershipLost):  # the motion is ours, or the new owner's
            self.reckoning.forget()
            return
        found = self.reckoning.compare(record)
        if found is not None and (self.homed or (self.powered and isinstance(found, ForeignMotion))):
            self.displace(found)

    @property
    def under_way(self) -> bool:
        """Whether a motion of this program is under way."""
        return self.run is not None or self.phase is not None or self.seeking

    def forget_motion(self) -> None:
        """Show that the motion under way has ended."""
        self.run = self.phase = None
        self.seeking = self.unpausable = self.stopping = False
        self.publish()

    def displace(self, error: MachineError) -> None:
        """Make the homing invalid, because of `error`; the first cause stays until `recover`."""
        self.homed = False
        self.displaced = self.displaced or error

    def hold(self, driver: Driver) -> None:
        """Set the torque of rest for the lines; a live program also writes the rest position of the axes."""
        commands = self.registers.torque(self.torque.rest)
        if self.live and self.homed:
            commands += homing_mark.resting(self.standing())
        if commands and not driver.lost.done():
            self.registers.sent(commands)
            sent = driver.begin_batch(commands)
            sent.add_done_callback(lambda done: self._held(done, driver))

    def _held(self, done: asyncio.Future[list[str]], driver: Driver) -> None:
        """Enter the fault state if the controller refused the torque of rest: no caller waits for the answer."""
        error = None if done.cancelled() else done.exception()
        if isinstance(error, CommandRejected):
            self.fail(error, driver)

    def standing(self) -> tuple[int, int, int]:
        """Return the reference position of a, b, c [counts]."""
        assert self.record is not None
        a, b, c = (self.record.axes[place].reference for place in self.order)
        return a, b, c

    def here(self) -> Joints:
        """Return the reference position (rad, m, m), from which the next motion starts."""
        return self.units.to_joints(self.standing())

    def moving(self) -> bool:
        """Whether one of Maya's axes moved in the latest record."""
        return self.record is not None and any(self.record.axes[place].moving for place in self.order)

    def motor_off(self) -> MayaError | None:
        """Return the error for a motor that is off though it was switched on, None if all are on."""
        if self.record is None or not self.powered:
            return None
        off = [i for i, place in enumerate(self.order) if self.record.axes[place].motor_off]
        if not off:
            return None
        return state_builder.grave(self.record, self.order, off) or MotorOff(axis=AXES[off[0]])

    def places(self) -> Iterator[tuple[AxisConfig, int]]:
        """Yield every axis with its index in the record."""
        for i, place in enumerate(self.order):
            yield self.config.axes[i], place

    async def power(self, driver: Driver) -> None:
        """Switch on the motors that are off, and set every reference to the position (SH moves nothing)."""
        record = await self.look()
        places = [(axis.letter, record.axes[place]) for axis, place in self.places()]
        off = [name for name, axis in places if axis.motor_off or abs(axis.position - axis.reference) > SETTLED]
        if off:
            await driver.send(f"SH{''.join(sorted(off))}")
        self.powered = True
        await self.look()

    async def adopt(self, driver: Driver) -> bool:
        """Adopt a valid homing mark.

        Return whether the robot is then homed, that is, inside its workspace without zones.
        """
        ends = await homing_mark.read(driver, self.config, self.units, self.here())
        if ends is None:
            return False
        self.set_homed(ends, await datum.read(driver, self.units))
        self.homed = self.workspace.with_zones(()).holds_grain(self.here())
        return self.homed

    def set_homed(self, ends: tuple[float, float], given: GivenDatum | None = None) -> None:
        """Take over a homing with these long ends of b and c [m], and with the datum that a person gave, if any."""
        self.homed = True
        self.given = given
        zones = self.workspace.zones
        whole = Workspace.of(self.config, strokes=_within(self.config, ends)).with_zones(zones)
        self.workspace = datum.narrowed(whole) if self.uncertain else whole

    async def require_kept(self, driver: Driver) -> None:
        """Raise `PositionNotKept` if the references differ from the end of this program's last motion."""
        left = await homing_mark.noted(driver)
        if left is None:
            return
        for axis, (counts, here) in enumerate(zip(left, self.standing(), strict=True)):
            if abs(here - counts) > SETTLED:
                await homing_mark.erase(driver)
                raise PositionNotKept(axis=AXES[axis], distance=self.reckoning.shown(axis, here - counts))

    async def kept(self, driver: Driver) -> bool:
        """Return whether the references are as after this program's last motion."""
        try:
            await self.require_kept(driver)
        except PositionNotKept:
            return False
        return True

    async def believe(self, driver: Driver, given: GivenDatum) -> None:
        """Define the counts by the datum that a person gave, and store it. Switches the motors on."""
        self.homed, self.displaced = False, None
        await homing_mark.erase(driver)
        await self.power(driver)
        letters = [axis.letter for axis, _ in self.places()]
        counts = zip(letters, self.units.to_counts(given.joints), strict=True)
        await driver.batch([f"DP{letter}={count}" for letter, count in counts])
        await driver.batch([homing_mark.datum(self.config, self.units, axis) for axis in range(3)])
        await homing_mark.leave(driver, self._configured_ends, self.units, given)
        self.reckoning.forget()
        self.set_homed(self._configured_ends, given)
        await self.look()
        self.hold(driver)

    async def confirm(self, driver: Driver, stated: Joints) -> None:
        """Allow all motion if the robot stands at `stated` (rad, m, m), by a person; else the homing is invalid.

        Raises `DatumRefused`, and `DatumContradicted`.
        """
        here = self.here()
        given = datum.second_point(self.given, here)
        found = datum.contradiction(here, stated)
        if found is not None:
            self.homed = False
            await homing_mark.erase(driver)
            self.events.emit(HomingNeeded())
            self.publish()
            raise found
        await driver.batch(datum.written(given, self.units))
        self.set_homed(self._configured_ends, given)

    @property
    def _configured_ends(self) -> tuple[float, float]:
        return self.config.axes.b.maximum, self.config.axes.c.maximum

    @property
    def uncertain(self) -> bool:
        """Whether a person gave the datum, and no second point has confirmed it."""
        return self.given is not None and not self.given.confirmed

    def enter_phase(self, name: str) -> None:
        """Begin a phase of homing."""
        self.phase = (name, self._loop.time())
        self.events.emit(PhaseBegun(name))
        self.publish()

    def release(self) -> None:
        """End a pause."""
        if self.pace.paused:
            self.pace.change(paused=False)

    def fail(self, error: MachineError, driver: Driver) -> None:
        """Enter the fault state; the first cause stays until `recover`. A lost link is reported as lost."""
        if driver.lost.done():
            self._on_lost(driver.lost.result())
        elif self.fault is None:
            self.enter_fault(error)

    def end(self, error: MayaError) -> None:
        """End the running command with an error, or enter the fault state at once if no command runs."""
        if self.slot.current is None:
            self.enter_fault(error)
        else:
            self.slot.current.interrupt(error)

    def enter_fault(self, error: MayaError) -> None:
        """Enter the fault state with an error, even during a motion."""
        self.fault = error
        self.release()
        self.events.emit(state_builder.kind(error)(str(error), code=error.code))
        self.publish()

    def publish(self) -> None:
        """Renew the state and wake all watchers."""
        self._latest.show(self._compose())

    def _on_lost(self, reason: MachineError) -> None:
        """Report a lost link once: the waiting command or the supervisor of the link may notice it first."""
        if self._down:
            return
        self._down = True
        self.quality.lost()
        if self.under_way:
            self.reckoning.forget()  # the guard stops the axes at unknown positions
        self.registers.forget()
        self.fault = reason
        self.release()
        self.events.emit(Disconnected(str(reason), code=reason.code))
        if self.slot.current is not None:
            self.slot.current.interrupt(reason)
        self.publish()

    async def _on_back(self, driver: Driver) -> None:
        """Read the record when the controller answers again, and report; move nothing."""
        homed = self.homed
        try:
            await self.look()
            lost = homed and await homing_mark.read(driver, self.config, self.units, self.here()) is None
        except (NotConnected, MachineError) as error:
            if not isinstance(error, MachineError) or driver.lost.done():
                return  # lost again: the link's keeper dials again
            self.fault, lost = error, False  # it answers, but its answer is invalid
        self._down = False
        self.events.emit(Connected(self.link.address, self.link.firmware))
        if lost:
            self.homed = False
            self.enter_fault(ControllerReset())
        elif homed and self.displaced is not None:
            self.enter_fault(self.displaced)
        self.publish()
        if self.on_returned is not None:
            self.on_returned(driver)

    def _mode(self) -> Mode:
        if self._down:
            return Mode.DISCONNECTED
        if self.fault is not None:
            return Mode.FAULT
        if self.stopping:
            return Mode.STOPPING
        if self.phase is not None:
            return Mode.HOMING
        if self.pace.paused or self.run is not None:
            return Mode.PAUSED if self.pace.paused else Mode.MOVING
        return Mode.IDLE if self.homed else Mode.NOT_HOMED

    def _compose(self) -> State:
        standing = ControllerStatus(
            self._loop.time(), self._mode(), self.homed, self.progress(), self.fault, self.pace.override
        )
        return self._lens.state(self.record, standing)


def _within(config: Config, ends: tuple[float, float]) -> tuple[Stroke, Stroke, Stroke]:
    """Return the strokes that stay off every switch: as configured, and short of the measured long ends."""
    a, b, c = config.axes.a, config.axes.b, config.axes.c
    return (
        (a.minimum, a.maximum - OFF_SWITCH[0]),
        (b.minimum, min(b.maximum, ends[0] - OFF_SWITCH[1])),
        (c.minimum, min(c.maximum, ends[1] - OFF_SWITCH[2])),
    )
