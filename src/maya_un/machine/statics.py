"""How the load hangs on its two lines: place, tension and slack for given line lengths.

Two anchors at the same height, W apart, carry lines of length b and c that meet where the gripper hangs. With u
the horizontal distance of that point from anchor b and h its depth below the anchors,

    u = (W² + b² − c²) / 2W        h = √(b² − u²)
    T_b = (W − u)/W · b/h          T_c = u/W · c/h         (in multiples of the load)

which is the balance of forces at the meeting point. A line cannot push: with u < 0 the load hangs straight below
anchor b and line c is slack by c − √(W² + b²), with u > W the other way round. Derived, with worked cases, in
docs/explanation/mechanics.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, inf, sqrt
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from maya_un.machine.truth import TrueConstants

Floats = NDArray[np.float64]


class LoadStatics(NamedTuple):
    """Where and how the load hangs.

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
        """Return how the load hangs on lines of `b` and `c` [m], b + c ≥ W."""
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
