"""The electronic cam (ECAM): slaves that follow a table over the cycle of a master (EA, EM, EP, ET, EB, EG, EQ).

Table entries lie EP counts of the master apart, with straight lines between them; the master's cycle is its EM. While
EB is 1 the master's counter stays within its cycle, and an engaged slave's within its own EM; where that is 0, or the
table does not end where it began, the slave goes on from cycle to cycle by what the table advances.

Where the manual is silent: ST and limits disengage a slave, which decelerates; EB 0 stops all slaves at once.
"""

from __future__ import annotations

from bisect import bisect_right
from math import floor, inf

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.following import TICK, Imposed, Master
from dmc41x3.twin.refusal import Rejection

ENTRIES = 257
"""Entries of the table of one axis."""

CAM = "cam"
_DEFAULT_MASTER = Master("N")


class _CamSlave:
    """One axis on the cam: where it engages and disengages, and what the cam has moved it."""

    def __init__(self, axis: Axis) -> None:
        self.axis = axis
        self.table = [0.0] * ENTRIES
        self.engage_at: float | None = None
        self.release_at: float | None = None
        self.imposed: Imposed | None = None
        self.origin = 0.0

    @property
    def engaged(self) -> bool:
        """Whether it follows the cam."""
        return self.imposed is not None

    @property
    def concerned(self) -> bool:
        """Whether the master's way matters to it."""
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
        """Forget tables and master."""
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
        """Nothing that befalls axes is awaited."""
        return False

    def next_event(self) -> float:
        """Return when a moving master is to be read next [s]."""
        concerned = self.enabled and any(slave.concerned for slave in self._slaves)
        return self._core.now + TICK if concerned and self.master.busy(self._core) else inf

    def look(self, now: float) -> None:
        """Read the master and bring every slave to where it belongs."""
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
        """Enable or disable the cam (EB); refused without a cycle (102) and for one too long (103)."""
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
        self._origin = (0 if axis is None else axis.offset) - self.shift
        self._way = self._read()

    def set_entry(self, axis: Axis, index: int, value: float) -> None:
        """Set a table entry (ET)."""
        self._slaves[axis.index].table[index] = value

    def entry(self, axis: Axis, index: int) -> float:
        """Return a table entry."""
        return self._slaves[axis.index].table[index]

    def engage(self, axis: Axis, place: float) -> None:
        """Let an axis follow from `place` of the master's cycle on (EG), at once where there is no such place."""
        slave = self._slave(axis)
        if not slave.engaged:
            slave.engage_at = place
            self.look(self._core.now)
            if not 0.0 <= place < self.modulus or place == self._way % self.modulus:
                self._engage(slave, self._way)

    def disengage(self, axis: Axis, place: float) -> None:
        """Let an axis go at `place` of the master's cycle (EQ), at once where there is no such place."""
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
        """Return what an axis waits for (`_EQ`): 1 to engage, 2 to disengage, 0 for neither."""
        slave = self._slaves[axis.index]
        return (slave.engage_at is not None) + 2 * (slave.release_at is not None)

    def displacement(self, axis: Axis, way: float) -> float:
        """Return where the table has an axis after a `way` of the master [counts], from its entry 0 on."""
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
        """Return the master's places of the table entries, from 0 to its cycle."""
        places = [0.0]
        while places[-1] < self.modulus and len(places) < ENTRIES:
            places.append(places[-1] + self.widened.get(len(places) - 1, self.interval))
        places[-1] = self.modulus
        return places

    def _read(self) -> float:
        """Return the way of the master since EB 1, from its counter of then on [counts]."""
        return self.master.position(self._core) + self._origin

    def _fold_master(self) -> int:
        """Keep the master's counter within its cycle; return the cycles taken from it."""
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
        """Return the way at which the master passed a place of its cycle since it was at `before`."""
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
        """Put a slave where the table has it after a `way` of the master, and fold its counter."""
        if slave.imposed is None:
            return
        axis = slave.axis
        slave.imposed.impose(self._core.now, self.displacement(axis, way) - slave.origin, velocity)
        modulus = int(axis.registers["EM"])
        if modulus:
            axis.offset -= floor(axis.reference(self._core.now) / modulus) * modulus

    def _slope(self, slave: _CamSlave) -> float:
        """Return the speed of a slave in multiples of its master's."""
        table, places = slave.table, self._places
        at = min(bisect_right(places, self._way % self.modulus), len(places) - 1) - 1
        return (table[at + 1] - table[at]) / (places[at + 1] - places[at])

    def _leave(self, slave: _CamSlave) -> None:
        if slave.imposed is not None:
            slave.imposed, slave.release_at = None, None
            slave.axis.bound = ""
            self._core.halt(slave.axis, StopCode.CAM_STOPPED)
