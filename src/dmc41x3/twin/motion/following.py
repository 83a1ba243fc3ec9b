"""What gearing and cams have in common: a master to read, and a displacement to impose on the slave's reference.

The controller reads the master every sample. Here it is read whenever the machine looks, which is at every event,
before every command, and every `TICK` while the master moves; the slave is right at each of these instants and goes
on at the present speed between them.
"""

from __future__ import annotations

from dataclasses import dataclass

from dmc41x3.language.hardware import LETTERS
from dmc41x3.twin.motion.axis import VIRTUAL, Axis
from dmc41x3.twin.motion.core import MotionCore
from dmc41x3.twin.timeline import TimelinePiece

TICK = 0.002
"""How often a moving master is read [s]."""

_STILL = 0.01
"""A master slower than this [counts/s] stands still."""


@dataclass(frozen=True, slots=True)
class Master:
    """What is followed: an axis A to H, a virtual axis M or N, or the way along the path of plane S or T.

    Of an axis it is the main encoder, or the commanded position, or the auxiliary encoder.
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
        """Return its position, which no DP changes [counts]."""
        axis = self.axis(core)
        if axis is None:
            return core.planes[self.letter].distance(core.now)
        if self.auxiliary:
            return 0.0  # nothing turns an auxiliary encoder
        if self.commanded or axis.virtual:
            return axis.timeline.at(core.now)[0]
        return core.plant.position(axis.index)

    def velocity(self, core: MotionCore) -> float:
        """Return its velocity [counts/s]."""
        axis = self.axis(core)
        if axis is None:
            return core.planes[self.letter].speed(core.now)
        if self.auxiliary:
            return 0.0
        if self.commanded or axis.virtual:
            return axis.timeline.at(core.now)[1]
        return core.plant.velocity(axis.index)

    def busy(self, core: MotionCore) -> bool:
        """Tell whether it moves, or is about to."""
        axis = self.axis(core)
        moving = core.planes[self.letter].running if axis is None else axis.moving or bool(axis.bound)
        return moving or abs(self.velocity(core)) > _STILL


class Imposed:
    """A displacement added to the reference of an axis, whatever the axis does by itself."""

    def __init__(self, axis: Axis, now: float) -> None:
        self._axis = axis
        self._total = self._drift = 0.0
        self._since = now
        self._version = axis.timeline.version

    def impose(self, now: float, total: float, velocity: float) -> None:
        """Make the displacement `total` [counts] at time `now` [s], going on at `velocity` [counts/s]."""
        axis = self._axis
        # A new plan began where the axis was, displacement included, but did not keep the drift.
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
