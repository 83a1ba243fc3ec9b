"""The true constants of one machine, the statics of its load, and the pose in which it starts.

Only the mechanics know them. The software above has a configuration that may differ from them. Axes are numbered 0 (a,
the boom), 1 (b, the inner line), 2 (c, the outer line); triples are in that order and pairs are (reverse, forward),
that is (short end, long end).

Two anchors at the same height, W apart, carry lines of length b and c that meet where the gripper hangs. With u the
horizontal distance of that point from anchor b and h its depth below the anchors,

    u = (W² + b² − c²) / 2W        h = √(b² − u²)
    T_b = (W − u)/W · b/h          T_c = u/W · c/h         (in multiples of the load)

which is the balance of forces at the meeting point. A line cannot push: with u < 0 the load hangs straight below anchor
b and line c is slack by c − √(W² + b²), with u > W the other way round. The derivation, with worked cases, is in
docs/explanation/mechanics.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from math import hypot, inf, pi, radians, sqrt
from typing import Literal, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from maya_un.machine.wiring import WIRED, Wiring

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Levels = tuple[bool, bool]
Switch = Literal["reverse", "forward"]

MOTOR_LIMIT = 9.9982
"""The largest motor command [V]."""


class Random(Protocol):
    """Source of randomness for drawing; `random.Random` and numpy's `Generator` both have it."""

    def random(self) -> float:
        """Return a number in [0, 1)."""
        ...

    def uniform(self, a: float, b: float, /) -> float:
        """Return a number between `a` and `b`."""
        ...


@dataclass(frozen=True, slots=True)
class TrueConstants:
    """All constants of one machine (manual, figures 7 to 9 and its table of constants; errata 2, 5, 6).

    `switches` are the positions at which limit switches trip [rad, m, m], `gaps` the way from there to the hard stop
    [rad, m, m], `friction` the motor command that overcomes it [V], `torque_per_load` the command that balances a line
    tension of one load [V], `lag` the delay of an axis behind its reference [s], `stall_stiffness` the increase of the
    command with the following error of a blocked axis [V/count], `fall_speed` the speed at which a drum that does not
    lock pays out under load with its motor off [m/s]. `active_high` is whether a switch's input is electrically high
    when it is active. `fitted` is whether there is a switch; without one, its input is open, and high. `letters` are
    the axes of the controller that drive a, b and c. `wiring` has the mistakes between cabinet and motors.
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
    fitted: tuple[Levels, Levels, Levels] = ((True, True), (True, True), (True, True))
    gripper_output: int = 1
    gripper_closes_on: bool = False
    letters: str = "ABC"
    wiring: Wiring = WIRED

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
        """Return the machine with changed switch wiring: of all switches, those of one axis, or a single one."""

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

    @classmethod
    def built(cls, rng: Random, plan: TrueConstants) -> TrueConstants:
        """Return a machine as somebody has built it by a `plan`: its lengths and scales differ a little.

        Height and distances of the anchors within ±10 mm, or ±0.5 % of W on small machines, the gripper's height within
        ±3 mm, scales within ±0.2 %, long ends within ±1 %, friction × 0.2 to 2.5, lag × 0.5 to 1.5.
        """
        most = min(0.01, 0.005 * plan.width)

        def end(axis: int) -> Pair:
            reverse, forward = plan.switches[axis]
            return reverse, forward * rng.uniform(0.99, 1.01)

        def three(low: float, high: float) -> Triple:
            return rng.uniform(low, high), rng.uniform(low, high), rng.uniform(low, high)

        return replace(
            plan,
            height=plan.height + rng.uniform(-most, most),
            length=plan.length + rng.uniform(-most, most),
            delta=plan.delta + rng.uniform(-most, most),
            gripper_height=plan.gripper_height + rng.uniform(-0.003, 0.003),
            counts_per_degree=plan.counts_per_degree * rng.uniform(0.998, 1.002),
            counts_per_metre=plan.counts_per_metre * rng.uniform(0.998, 1.002),
            switches=(end(0), end(1), end(2)),
            friction=_times(plan.friction, three(0.2, 2.5)),
            lag=_times(plan.lag, three(0.5, 1.5)),
        )


def _times(left: Triple, right: Triple) -> Triple:
    return left[0] * right[0], left[1] * right[1], left[2] * right[2]


Floats = NDArray[np.float64]


class LoadStatics(NamedTuple):
    """The place of the load, and the state of its lines.

    `d` is the gripper's distance from the vertical axis [m], `z` its height above the table [m], `tension_b` and
    `tension_c` the line tensions [multiples of the load], `slack_b` and `slack_c` the surplus lengths [m].
    """

    d: float
    z: float
    tension_b: float
    tension_c: float
    slack_b: float
    slack_c: float

    @property
    def tension(self) -> float:
        """The greater of the two tensions [multiples of the load]."""
        return max(self.tension_b, self.tension_c)

    @property
    def slack(self) -> float:
        """The surplus length of the line that does not carry [m], 0 while both are taut."""
        return max(self.slack_b, self.slack_c)


@dataclass(frozen=True, slots=True)
class Statics:
    """The statics of one frame: `width` W between the anchors, `inner` distance of anchor b from the axis [m].

    `top` is the height of the gripper with the meeting point at the anchors, H − Φ [m]. `strongest` caps the
    tensions of b and c: near h = 0 no motor pulls more than it can.
    """

    width: float = 2.0
    inner: float = 0.30
    top: float = 2.15
    strongest: tuple[float, float] = (inf, inf)

    @classmethod
    def of(cls, truth: TrueConstants) -> Self:
        """Return the statics of a machine."""
        top = truth.height - truth.gripper_height
        return cls(truth.width, truth.delta, top, truth.strongest)

    def hang(self, b: float, c: float) -> LoadStatics:
        """Return the statics of a load on lines of `b` and `c` [m], b + c ≥ W."""
        W = self.width
        u = (W * W + b * b - c * c) / (2.0 * W)
        if u < 0.0:
            return LoadStatics(self.inner, self.top - b, 1.0, 0.0, 0.0, c - hypot(W, b))
        if u > W:
            return LoadStatics(self.inner + W, self.top - c, 0.0, 1.0, b - hypot(W, c), 0.0)
        h = sqrt(max(0.0, b * b - u * u))
        most_b, most_c = self.strongest
        tension_b = min(most_b, (W - u) * b / (W * h)) if h > 0.0 else most_b
        tension_c = min(most_c, u * c / (W * h)) if h > 0.0 else most_c
        return LoadStatics(self.inner + u, self.top - h, tension_b, tension_c, 0.0, 0.0)

    def hang_many(self, b: Floats, c: Floats) -> tuple[Floats, Floats, Floats]:
        """Return height z [m], greater tension [× load] and slack [m] for lengths of shape (n,) [m]."""
        W = self.width
        bb, cc = b * b, c * c
        u = (W * W + bb - cc) / (2.0 * W)
        most_b, most_c = self.strongest
        taut = (u >= 0.0) & (u <= W)
        if taut.all():
            h, tension = self._taut(u, b, c, bb)
            return self.top - h, tension, np.zeros_like(h)
        inner = np.clip(u, 0.0, W)
        h, tension = self._taut(inner, b, c, bb)
        h = np.where(taut, h, np.where(u < 0.0, b, c))
        slack = np.where(u < 0.0, c - np.sqrt(W * W + bb), b - np.sqrt(W * W + cc))
        return (
            self.top - h,
            np.where(taut, tension, min(1.0, most_b, most_c)),
            np.where(taut, 0.0, slack),
        )

    def _taut(self, u: Floats, b: Floats, c: Floats, bb: Floats) -> tuple[Floats, Floats]:
        h = np.sqrt(np.maximum(bb - u * u, 0.0))
        most_b, most_c = self.strongest
        depth = np.maximum(self.width * h, 1e-12)
        tension_b = np.minimum((self.width - u) * b / depth, most_b)
        tension_c = np.minimum(u * c / depth, most_c)
        return h, np.maximum(tension_b, tension_c)


TRIES = 2_000
"""After this many tries, a start of any kind is drawn."""
TENSION = 5.0
"""A start is taut at no more than this [× load] ..."""
SLACK = 0.25
"""... or on a switch, with no more slack than this [m] (errata, "Homing, in numbers")."""
PARTS = 0.40
"""Height of the gripper above the parts [m] (errata, "The cell"); less on a machine that is lower than Maya."""
TABLE = 0.10
"""No start is lower than this [m]; less on a lower machine."""
OVERTRAVEL = 0.003
"""An axis on a switch stands up to this far beyond its trip point [m]; axis a up to as many tenths of a rad."""


class StartPose(NamedTuple):
    """True angle [rad] and line lengths [m] at power-up."""

    a: float = 1.0
    b: float = 1.5
    c: float = 1.5


def legal_start(rng: Random, truth: TrueConstants) -> StartPose:
    """Return a start that homing must handle, drawn for this machine.

    Most are inside the strokes, taut and above the parts; a fifth stand on one or more switches, perhaps with a slack
    line; an eighth are lower than the parts.
    """
    kind = rng.random()
    statics = Statics.of(truth)
    for tries in count():
        if tries == TRIES:
            kind = 1.0
        on_switch = kind < 0.2
        start = StartPose(
            _place(rng, truth, 0, 0.4 if on_switch else 0.0),
            _place(rng, truth, 1, 0.5 if on_switch else 0.0),
            _place(rng, truth, 2, 0.5 if on_switch else 0.0),
        )
        if _legal(start, truth, statics, low=0.2 <= kind < 0.325, on_switch=on_switch):
            return start
        if tries > 2 * TRIES:
            break
    raise ValueError("no pose of this machine keeps both lines taut above its table")


def _place(rng: Random, truth: TrueConstants, axis: int, chance: float) -> float:
    reverse, forward = truth.switches[axis]
    place, choice, beyond = rng.uniform(reverse, forward), rng.random(), rng.random() * OVERTRAVEL
    beyond *= 10.0 if axis == 0 else 1.0
    if choice < 0.5 * chance:
        return reverse - beyond
    if choice < chance:
        return forward + beyond
    return place


def _legal(start: StartPose, truth: TrueConstants, statics: Statics, *, low: bool, on_switch: bool) -> bool:
    if start.b + start.c <= truth.width or on_switch != any(_beyond(start, truth)):
        return False
    hang = statics.hang(start.b, start.c)
    may_be_slack = any(_beyond(start, truth)[1:])
    if hang.tension > TENSION or hang.slack > (SLACK if may_be_slack else 0.0):
        return False
    share = min(1.0, statics.top / Statics().top)
    return TABLE * share <= hang.z < PARTS * share if low else hang.z >= PARTS * share


def _beyond(start: StartPose, truth: TrueConstants) -> list[bool]:
    return [not reverse < q < forward for q, (reverse, forward) in zip(start, truth.switches, strict=True)]
