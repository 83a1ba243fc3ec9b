"""Electronic gearing (GA, GR, GM, GD) and the electronic cam (ECAM): slaves that follow a master.

The controller reads the master every sample. The twin reads it at every event, before every command, and every `TICK`
while the master moves; the slave is exact at these times and moves at constant speed between them.

Not in the manual: a slave that leaves the gear because of ST, a limit, an abort or a motor that is switched off has
ratio 0 afterwards; a gantry's slave (GM 1) without power follows again after SH; if an error switched it off, its
master is stopped.

Table entries lie EP counts of the master apart, with straight lines between them; the master's cycle is its EM. While
EB is 1 the master's counter stays within its cycle, and an engaged slave's within its own EM, if that is not 0. In
each cycle the slave advances by the difference between the last and the first entry of the table.

Not in the manual: ST and limits disengage a slave, which decelerates; EB 0 stops all slaves at once.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import floor, inf

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.expressions import Rejection
from dmc41x3.twin.motion.axis import NAMES, VIRTUAL, Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.timeline import TimelinePiece

TICK = 0.002
"""Interval between readings of a moving master [s]."""

_STILL = 0.01
"""A master slower than this [counts/s] counts as still."""


@dataclass(frozen=True, slots=True)
class Master:
    """The master: an axis A to H, a virtual axis M or N, or the distance along the path of plane S or T.

    The position of an axis is that of its main encoder, its commanded position, or that of its auxiliary encoder.
    """

    letter: str
    commanded: bool = False
    auxiliary: bool = False

    def axis(self, core: MotionCore) -> Axis | None:
        """Return the axis, None for a plane."""
        if self.letter in VIRTUAL:
            return core.virtual[self.letter]
        return core.axes[LETTERS.index(self.letter)] if self.letter in LETTERS else None

    def position(self, core: MotionCore) -> float:
        """Return the position of the master [counts], which DP does not change."""
        axis = self.axis(core)
        if axis is None:
            return core.planes[self.letter].distance(core.now)
        if self.auxiliary:
            return 0.0  # nothing turns an auxiliary encoder
        if self.commanded or axis.virtual:
            return axis.timeline.at(core.now)[0]
        return core.plant.position(axis.index)

    def velocity(self, core: MotionCore) -> float:
        """Return the velocity of the master [counts/s]."""
        axis = self.axis(core)
        if axis is None:
            return core.planes[self.letter].speed(core.now)
        if self.auxiliary:
            return 0.0
        if self.commanded or axis.virtual:
            return axis.timeline.at(core.now)[1]
        return core.plant.velocity(axis.index)

    def busy(self, core: MotionCore) -> bool:
        """Return whether the master moves, or is about to."""
        axis = self.axis(core)
        moving = core.planes[self.letter].running if axis is None else axis.moving or bool(axis.bound)
        return moving or abs(self.velocity(core)) > _STILL


class Imposed:
    """A displacement added to the reference of an axis, independent of the axis' own motion."""

    def __init__(self, axis: Axis, now: float) -> None:
        self._axis = axis
        self._total = self._drift = 0.0
        self._since = now
        self._version = axis.timeline.version

    def impose(self, now: float, total: float, velocity: float) -> None:
        """Set the displacement to `total` [counts] at time `now` [s]; it then changes at `velocity` [counts/s]."""
        axis = self._axis
        # A new plan began at the displaced position of the axis, but without the drift.
        kept = self._drift if axis.timeline.version == self._version else 0.0
        step = total - self._total - self._drift * (now - self._since)
        turn = velocity - kept
        if step or turn:
            ahead = axis.timeline.ahead(now)
            axis.timeline.plan(now, [_moved(piece, piece.t - now, step, turn) for piece in ahead])
        if axis.motion is not None:
            axis.motion.target += round(total) - round(self._total)
        self._total, self._drift, self._since = total, velocity, now
        self._version = axis.timeline.version


def _moved(piece: TimelinePiece, after: float, step: float, turn: float) -> TimelinePiece:
    return TimelinePiece(piece.t, piece.p + step + turn * after, piece.v + turn, piece.a)


GEAR = "gear"
_FAULTS = (StopCode.OFF_ON_ERROR, StopCode.AMPLIFIER_FAULT, StopCode.ENCODER_FAILURE)


@dataclass(slots=True)
class _Ramp:
    """A ratio that changes from `start` to `end` over `length` [counts] of the master, of which `way` is done."""

    start: float = 0.0
    end: float = 0.0
    length: float = 0.0
    way: float = 0.0

    @property
    def ratio(self) -> float:
        """The ratio in force."""
        if self.way >= self.length:
            return self.end
        return self.start + (self.end - self.start) * self.way / self.length

    def travel(self, distance: float) -> float:
        """Return the distance of the slave for a `distance` of the master [counts]."""
        if not distance:
            return 0.0
        first = self.way
        self.way += abs(distance)
        rising = min(self.way, self.length) ** 2 - min(first, self.length) ** 2
        level = max(self.way, self.length) - max(first, self.length)
        lost = self.start * (min(self.way, self.length) - min(first, self.length))
        share = (self.end - self.start) * rising / (2.0 * self.length) if self.length else 0.0
        gone = lost + share + self.end * level
        return gone if distance > 0.0 else -gone


class _GearedSlave:
    """One axis and its master."""

    def __init__(self, axis: Axis, master: Master, core: MotionCore) -> None:
        self.axis = axis
        self.master = master
        self.engaged = False
        self.phase = 0.0
        self._core = core
        self._ramp = _Ramp()
        self._at = 0.0
        self._total = 0.0
        self._imposed: Imposed | None = None

    def look(self) -> None:
        """Update the position of the slave from that of its master."""
        self._read()
        axis = self.axis
        if self.engaged and not axis.on:
            self._lose_power()
        elif self.engaged and axis.bound != GEAR:
            self._engage() if self._imposed is None else self._leave()
        elif axis.on and axis.registers["GR"] != self._ramp.end:
            self._change(axis.registers["GR"])
        self._write()

    def _read(self) -> None:
        here = self.master.position(self._core)
        distance, self._at = here - self._at, here
        if self.engaged:
            gone = self._ramp.travel(distance)
            self.phase += self._ramp.end * distance - gone
            self._total += gone

    def _change(self, wanted: float) -> None:
        """Apply a new ratio."""
        if not self.engaged:
            self._engage()
        self.phase = 0.0
        self._ramp = _Ramp(self._ramp.ratio, wanted, self.axis.registers["GD"])

    def _engage(self) -> None:
        self.engaged = True
        self.axis.bound = GEAR
        self._total = 0.0
        self._imposed = Imposed(self.axis, self._core.now)

    def _lose_power(self) -> None:
        """Stop following; a gantry's slave stays in gear."""
        self.axis.bound = ""
        self._imposed = None
        if not self.axis.registers["GM"]:
            self._leave()

    def _leave(self) -> None:
        self.engaged, self._imposed = False, None
        self.axis.registers["GR"] = 0.0
        self._ramp = _Ramp()

    def _write(self) -> None:
        if self._imposed is None:
            return
        ratio = self._ramp.ratio
        self._imposed.impose(self._core.now, self._total, ratio * self.master.velocity(self._core))
        if self._ramp.end == ratio == 0.0:
            self.engaged, self._imposed = False, None
            self.axis.bound = ""

    @property
    def failed(self) -> bool:
        """Whether this is a gantry's slave whose motor an error has switched off."""
        axis = self.axis
        return self.engaged and axis.registers["GM"] == 1 and not axis.on and axis.stop_code in _FAULTS


class Gearing:
    """The slaves of all axes, an `Activity`."""

    def __init__(self, core: MotionCore) -> None:
        self._core = core
        self._slaves: dict[int, _GearedSlave] = {}

    @property
    def active(self) -> bool:
        """Whether any axis has a master."""
        return bool(self._slaves)

    @property
    def watching(self) -> bool:
        """False: gearing does not wait for events of axes."""
        return False

    def next_event(self) -> float:
        """Return when to read a moving master next [s]."""
        core = self._core
        busy = any(slave.engaged and slave.axis.on and slave.master.busy(core) for slave in self._slaves.values())
        return core.now + TICK if busy else inf

    def look(self, now: float) -> None:
        """Update the position of every slave from that of its master."""
        for slave in self._slaves.values():
            failed = slave.failed
            slave.look()
            master = slave.master.axis(self._core)
            if failed and master is not None and master.moving:
                self._core.stop(master)

    def reset(self) -> None:
        """Remove all masters."""
        self._slaves.clear()

    def connect(self, axis: Axis, master: Master) -> None:
        """Let an axis follow a master (GA); refused (46) if the master is the axis itself or its own slave."""
        if master.letter == axis.letter:
            raise Rejection(ErrorCode.GEAR_MASTER_IS_SLAVE)
        leader = master.axis(self._core)
        other = None if leader is None else self._slaves.get(leader.index)
        if other is not None and other.master.letter == axis.letter:
            raise Rejection(ErrorCode.GEAR_MASTER_IS_SLAVE)
        slave = self._slaves[axis.index] = _GearedSlave(axis, master, self._core)
        slave.look()

    def number_of_master(self, axis: Axis) -> int:
        """Return the number of an axis' master as in axis variables; -1 for none."""
        slave = self._slaves.get(axis.index)
        return -1 if slave is None else NAMES.index(slave.master.letter)

    def phase(self, axis: Axis) -> float:
        """Return by how much the slave lags since the last change of its ratio (`_GP`) [counts]."""
        slave = self._slaves.get(axis.index)
        return 0.0 if slave is None else slave.phase


ENTRIES = 257
"""Entries of the table of one axis."""

CAM = "cam"
_DEFAULT_MASTER = Master("N")


class _CamSlave:
    """One axis on the cam: where it engages and disengages, and its displacement by the cam."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self.table = [0.0] * ENTRIES
        self.engage_at: float | None = None
        self.release_at: float | None = None
        self.imposed: Imposed | None = None
        self.origin = 0.0

    @property
    def engaged(self) -> bool:
        """Whether the axis follows the cam."""
        return self.imposed is not None

    @property
    def concerned(self) -> bool:
        """Whether the axis follows the cam or waits to engage."""
        return self.engaged or self.engage_at is not None


class Cam:
    """The cam and its slaves, an `Activity`.

    `interval` and `shift` are EP [counts of the master], `index` is EC, `widened` EW, `cycles` EY.
    """

    def __init__(self, core: MotionCore) -> None:
        self._core = core
        self._slaves = [_CamSlave(axis) for axis in core.axes]
        self.reset()

    def reset(self) -> None:
        """Clear tables and master."""
        self.master = _DEFAULT_MASTER
        self.enabled = False
        self.interval, self.shift = 256, 0
        self.index = self.cycles = 0
        self.widened: dict[int, int] = {}
        self._way = self._origin = 0.0
        self._places: list[float] = []
        self._slaves = [_CamSlave(axis) for axis in self._core.axes]

    @property
    def active(self) -> bool:
        """Whether the cam is enabled."""
        return self.enabled

    @property
    def watching(self) -> bool:
        """False: the cam does not wait for events of axes."""
        return False

    def next_event(self) -> float:
        """Return when to read a moving master next [s]."""
        concerned = self.enabled and any(slave.concerned for slave in self._slaves)
        return self._core.now + TICK if concerned and self.master.busy(self._core) else inf

    def look(self, now: float) -> None:
        """Read the master and update the position of every slave."""
        before, self._way = self._way, self._read()
        self.cycles += self._fold_master()
        for slave in self._slaves:
            self._follow(slave, before)

    @property
    def modulus(self) -> float:
        """EM of the master, its cycle [counts]."""
        axis = self.master.axis(self._core)
        return 0.0 if axis is None else axis.registers["EM"]

    def choose(self, master: Master) -> None:
        """Choose the master (EA); refused (100) while the cam is enabled."""
        if self.enabled:
            raise Rejection(ErrorCode.CAM_RUNS)
        self.master = master

    def enable(self, on: bool) -> None:
        """Enable or disable the cam (EB); refused without a cycle (102) and if the cycle is too long (103)."""
        if on == self.enabled:
            return
        if not on:
            self.look(self._core.now)
            for slave in self._slaves:
                self._leave(slave)
                slave.engage_at = slave.release_at = None
            self.enabled = False
            return
        if not self.modulus:
            raise Rejection(ErrorCode.CAM_WITHOUT_MASTER)
        if self.modulus > (ENTRIES - 1) * self.interval:
            raise Rejection(ErrorCode.CAM_MODULUS)
        self._places = self._spaced()
        self.enabled, self.cycles = True, 0
        self._fold_master()
        axis = self.master.axis(self._core)
        self._origin = (0.0 if axis is None else axis.offset) - self.shift
        self._way = self._read()

    def set_entry(self, axis: Axis, index: int, value: float) -> None:
        """Set a table entry (ET)."""
        self._slaves[axis.index].table[index] = value

    def entry(self, axis: Axis, index: int) -> float:
        """Return a table entry."""
        return self._slaves[axis.index].table[index]

    def engage(self, axis: Axis, place: float) -> None:
        """Let an axis follow from `place` of the master's cycle on (EG), at once if the cycle has no such place."""
        slave = self._slave(axis)
        if not slave.engaged:
            slave.engage_at = place
            self.look(self._core.now)
            if not 0.0 <= place < self.modulus or place == self._way % self.modulus:
                self._engage(slave, self._way)

    def disengage(self, axis: Axis, place: float) -> None:
        """Release an axis at `place` of the master's cycle (EQ), at once if the cycle has no such place."""
        slave = self._slave(axis)
        slave.engage_at = None
        if slave.engaged:
            slave.release_at = place
            self.look(self._core.now)
            if not 0.0 <= place < self.modulus or place == self._way % self.modulus:
                self._place(slave, self._way, 0.0)
                self._leave(slave)

    def engaged(self, axis: Axis) -> bool:
        """Return whether an axis follows the cam (`_EG`)."""
        return self._slaves[axis.index].engaged

    def waiting(self, axis: Axis) -> int:
        """Return the state of an axis (`_EQ`): 1 if it waits to engage, 2 if it waits to disengage, 0 for neither."""
        slave = self._slaves[axis.index]
        return (slave.engage_at is not None) + 2 * (slave.release_at is not None)

    def displacement(self, axis: Axis, way: float) -> float:
        """Return the table position of an axis after a distance `way` of the master [counts], from its entry 0 on."""
        table, places = self._slaves[axis.index].table, self._places
        cycle, place = divmod(way, self.modulus)
        last = len(places) - 1
        at = min(bisect_right(places, place), last) - 1
        share = (place - places[at]) / (places[at + 1] - places[at])
        here = table[at] + share * (table[at + 1] - table[at])
        return cycle * (table[last] - table[0]) + here

    def _slave(self, axis: Axis) -> _CamSlave:
        if not self.enabled:
            raise Rejection(ErrorCode.CAM_NOT_ENABLED)
        return self._slaves[axis.index]

    def _spaced(self) -> list[float]:
        """Return the master's positions of the table entries, from 0 to its cycle."""
        places = [0.0]
        while places[-1] < self.modulus and len(places) < ENTRIES:
            places.append(places[-1] + self.widened.get(len(places) - 1, self.interval))
        places[-1] = self.modulus
        return places

    def _read(self) -> float:
        """Return the counter of the master without folding, with its offset at EB 1 and the shift of EP [counts]."""
        return self.master.position(self._core) + self._origin

    def _fold_master(self) -> int:
        """Fold the master's counter into its cycle; return the number of cycles removed."""
        axis = self.master.axis(self._core)
        if axis is None:
            return 0
        gone = floor((self.master.position(self._core) + axis.offset) / self.modulus)
        axis.offset -= int(gone * self.modulus)
        return gone

    def _follow(self, slave: _CamSlave, before: float) -> None:
        if slave.engaged and slave.axis.bound != CAM:
            slave.imposed, slave.release_at = None, None
            return
        if slave.engage_at is not None:
            met = self._passed(slave.engage_at, before)
            if met is not None:
                self._engage(slave, met)
        if not slave.engaged:
            return
        met = None if slave.release_at is None else self._passed(slave.release_at, before)
        if met is not None:
            self._place(slave, met, 0.0)
            self._leave(slave)
        else:
            self._place(slave, self._way, self._slope(slave) * self.master.velocity(self._core))

    def _passed(self, place: float, before: float) -> float | None:
        """Return the distance at which the master passed a place of its cycle since `before`, None if it did not."""
        modulus, way = self.modulus, self._way
        if way > before:
            met = place + modulus * (floor((before - place) / modulus) + 1)
            return met if met <= way else None
        if way < before:
            met = place + modulus * floor((before - place) / modulus)
            met = met if met < before else met - modulus
            return met if met >= way else None
        return None

    def _engage(self, slave: _CamSlave, way: float) -> None:
        axis = slave.axis
        slave.engage_at = None
        if not axis.on or axis.moving or axis.bound:
            return
        here = round(axis.timeline.at(self._core.now)[0])
        counter = self.displacement(axis, way % self.modulus)
        slave.origin = self.displacement(axis, way) - counter + round(counter)
        axis.offset = round(counter) - here
        axis.bound, axis.stop_code = CAM, StopCode.CAM_RUNNING
        slave.imposed = Imposed(axis, self._core.now)
        self._place(slave, self._way, self._slope(slave) * self.master.velocity(self._core))

    def _place(self, slave: _CamSlave, way: float, velocity: float) -> None:
        """Move a slave to its position by the table after a distance `way` of the master, and fold its counter."""
        if slave.imposed is None:
            return
        axis = slave.axis
        slave.imposed.impose(self._core.now, self.displacement(axis, way) - slave.origin, velocity)
        modulus = int(axis.registers["EM"])
        if modulus:
            axis.offset -= floor(axis.reference(self._core.now) / modulus) * modulus

    def _slope(self, slave: _CamSlave) -> float:
        """Return the ratio of a slave's speed to its master's."""
        table, places = slave.table, self._places
        at = min(bisect_right(places, self._way % self.modulus), len(places) - 1) - 1
        return (table[at + 1] - table[at]) / (places[at + 1] - places[at])

    def _leave(self, slave: _CamSlave) -> None:
        if slave.imposed is not None:
            slave.imposed, slave.release_at = None, None
            slave.axis.bound = ""
            self._core.halt(slave.axis, StopCode.CAM_STOPPED)
