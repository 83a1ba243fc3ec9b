"""What is true of one machine, known to its mechanics only: geometry, switches, friction, stiffness, wiring.

The constants are the machine's own; the software above has a configuration that may be wrong about them.
Axes are numbered 0 (a, the boom), 1 (b, the inner line), 2 (c, the outer line); triples are in that order and
pairs are (reverse, forward), that is (short end, long end).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi, radians
from typing import Literal, Protocol

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Levels = tuple[bool, bool]
Switch = Literal["reverse", "forward"]

MOTOR_LIMIT = 9.9982
"""The largest motor command [V]."""


class Random(Protocol):
    """What drawing needs of a source of randomness; `random.Random` and numpy's `Generator` both have it."""

    def random(self) -> float:
        """Return a number in [0, 1)."""
        ...

    def uniform(self, a: float, b: float, /) -> float:
        """Return a number between `a` and `b`."""
        ...


@dataclass(frozen=True, slots=True)
class TrueConstants:
    """All constants of one machine (manual, figures 7 to 9 and its table of constants; errata 2, 5, 6).

    `switches` are the positions at which limit switches trip [rad, m, m], `gaps` the way from there to the hard
    stop [rad, m, m], `friction` the motor command that overcomes it [V], `torque_per_load` the command that
    balances a line tension of one load [V], `lag` how late an axis follows its reference [s], `stall_stiffness`
    how the command grows with the following error of a blocked axis [V/count], `fall_speed` how fast a drum that
    does not lock pays out under load with its motor off [m/s]. `active_high` says whether a switch's input is
    electrically high when it is active.
    """

    height: float = 2.35
    length: float = 2.30
    delta: float = 0.30
    gripper_height: float = 0.20
    counts_per_degree: float = 371.06
    counts_per_metre: float = 1e6
    switches: tuple[Pair, Pair, Pair] = ((0.0, 2.0 * pi / 3.0), (0.575, 2.260), (0.565, 2.300))
    gaps: Triple = (radians(3.0), 0.020, 0.020)
    friction: Triple = (0.1, 0.1, 0.1)
    torque_per_load: float = 0.5
    lag: Triple = (0.02, 0.02, 0.02)
    stall_stiffness: Triple = (MOTOR_LIMIT / 400.0, MOTOR_LIMIT / 4000.0, MOTOR_LIMIT / 4000.0)
    self_locking: bool = True
    fall_speed: float = 0.05
    active_high: tuple[Levels, Levels, Levels] = ((False, False), (False, False), (False, False))
    gripper_output: int = 1
    gripper_closes_on: bool = False

    @property
    def width(self) -> float:
        """W, the distance between the two anchors [m]."""
        return self.length - self.delta

    @property
    def scale(self) -> Triple:
        """Counts per rad, per m, per m."""
        return (self.counts_per_degree * 180.0 / pi, self.counts_per_metre, self.counts_per_metre)

    @property
    def strongest(self) -> Pair:
        """The tension of lines b and c at which their motors are at their limit [multiples of the load]."""
        _, fb, fc = self.friction
        return (MOTOR_LIMIT - fb) / self.torque_per_load, (MOTOR_LIMIT - fc) / self.torque_per_load

    def with_wiring(self, active_high: bool, axis: int | None = None, switch: Switch | None = None) -> TrueConstants:
        """Return the machine with switches wired so: all of them, those of one axis, or a single one."""

        def wired(index: int) -> Levels:
            reverse, forward = self.active_high[index]
            if axis not in (None, index):
                return reverse, forward
            return (
                reverse if switch == "forward" else active_high,
                forward if switch == "reverse" else active_high,
            )

        return replace(self, active_high=(wired(0), wired(1), wired(2)))

    @classmethod
    def drawn(cls, rng: Random) -> TrueConstants:
        """Return a machine with the default geometry and drawn ends, gaps, friction, lag and stiffness.

        Long ends within ±3 % of the nominal ones, short ends exact (they are the datum); hard stops 12 to 30 mm
        behind the switches (a: 1.8° to 4.5°), friction 0.02 to 0.25 V, lag 5 to 40 ms, stiffness × 0.5 to 2.
        """
        nominal = cls()

        def three(low: float, high: float) -> Triple:
            return rng.uniform(low, high), rng.uniform(low, high), rng.uniform(low, high)

        stretch, gap, soft = three(0.97, 1.03), three(0.6, 1.5), three(-1.0, 1.0)

        def ends(axis: int) -> Pair:
            reverse, forward = nominal.switches[axis]
            return reverse, forward * stretch[axis]

        return replace(
            nominal,
            switches=(ends(0), ends(1), ends(2)),
            gaps=_times(nominal.gaps, gap),
            friction=three(0.02, 0.25),
            lag=three(0.005, 0.040),
            stall_stiffness=_times(nominal.stall_stiffness, (2.0 ** soft[0], 2.0 ** soft[1], 2.0 ** soft[2])),
        )


def _times(left: Triple, right: Triple) -> Triple:
    return left[0] * right[0], left[1] * right[1], left[2] * right[2]
