"""Electronic gearing: slaves that follow a master at a ratio (GA, GR, GM, GD).

Where the manual is silent: a slave that ST, a limit, an abort or the loss of its motor's power takes out of gear has
ratio 0 afterwards; a gantry's slave (GM 1) without power follows again from SH on, and where an error switched it off,
its master is stopped.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin.motion.axis import NAMES, Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.motion.following import TICK, Imposed, Master
from dmc41x3.twin.refusal import Rejection

GEAR = "gear"
_FAULTS = (StopCode.OFF_ON_ERROR, StopCode.AMPLIFIER_FAULT, StopCode.ENCODER_FAILURE)


@dataclass(slots=True)
class _Ramp:
    """The ratio goes from `start` to `end` while the master goes `length` [counts]; it has gone `way` of it."""

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
        """Return by how much the slave moves while the master moves by `distance` [counts]."""
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
    """One axis and what it follows."""

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
        """Bring the slave to where its master is."""
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
        """Take over a new ratio."""
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
        """Stand; a gantry's slave remembers that it is in gear."""
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
        """Nothing that befalls axes is awaited."""
        return False

    def next_event(self) -> float:
        """Return when a moving master is to be read next [s]."""
        core = self._core
        busy = any(slave.engaged and slave.axis.on and slave.master.busy(core) for slave in self._slaves.values())
        return core.now + TICK if busy else inf

    def look(self, now: float) -> None:
        """Bring every slave to where its master is."""
        for slave in self._slaves.values():
            failed = slave.failed
            slave.look()
            master = slave.master.axis(self._core)
            if failed and master is not None and master.moving:
                self._core.stop(master)

    def reset(self) -> None:
        """Forget all masters."""
        self._slaves.clear()

    def connect(self, axis: Axis, master: Master) -> None:
        """Let an axis follow a master (GA); refused (46) where that would be itself or its own slave."""
        if master.letter == axis.letter:
            raise Rejection(ErrorCode.GEAR_MASTER_IS_SLAVE)
        leader = master.axis(self._core)
        other = None if leader is None else self._slaves.get(leader.index)
        if other is not None and other.master.letter == axis.letter:
            raise Rejection(ErrorCode.GEAR_MASTER_IS_SLAVE)
        slave = self._slaves[axis.index] = _GearedSlave(axis, master, self._core)
        slave.look()

    def number_of_master(self, axis: Axis) -> int:
        """Return what an axis follows, as axis variables number it; -1 for nothing."""
        slave = self._slaves.get(axis.index)
        return -1 if slave is None else NAMES.index(slave.master.letter)

    def phase(self, axis: Axis) -> float:
        """Return what the slave lacks of its ratio since that changed (`_GP`) [counts]."""
        slave = self._slaves.get(axis.index)
        return 0.0 if slave is None else slave.phase
