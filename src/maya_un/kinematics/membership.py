"""Which of many places, or of many joints, keep the limits: block by block, so that all columns stay in the cache.

No angle is computed: whether the boom's range holds a direction is a matter of two cross products. Lengths and tensions
are compared as squares. With v = u − W/2, which is counted from the middle between the anchors, and the limit k,

    b² − W²/4 = h² + v² + Wv     c² − W²/4 = h² + v² − Wv     T ≤ k  ⟺  (W²/4 − v²)² ≤ (k²W² − (W/2 + |v|)²) h²

where T is the tension of the line that carries more (`statics.shallowest`, squared).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin, tau

import numpy as np
from numpy.typing import NDArray

from maya_un.kinematics.limits import ReasonBounds, Stroke
from maya_un.kinematics.mechanism import Floats, Mechanism

Flags = NDArray[np.bool_]
"""An array of truth values; the shape stands where it is used."""

_BLOCK = 16384


@dataclass(frozen=True, slots=True)
class Membership:
    """The limits of a workspace, zones aside, ready to be compared with.

    They hold to `tolerance` (m, rad, and as a share of the tension limit).
    """

    mechanism: Mechanism
    bounds: ReasonBounds
    tolerance: float

    def of_points(self, points: Floats, out: Flags) -> Flags:
        """Return in `out`, shape (n,), which gripper points (n, 3) [m] keep all limits."""
        return _blockwise(self._points, points, out)

    def of_joints(self, joints: Floats, out: Flags) -> Flags:
        """Return in `out`, shape (n,), which joints (n, 3) [rad, m, m] keep all limits."""
        return _blockwise(self._joints, joints, out)

    def _points(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        x, y, h, v, spare, other = columns
        self._directions(inside, flags, columns)
        np.multiply(x, x, out=x)
        np.multiply(y, y, out=y)
        np.add(x, y, out=v)
        np.sqrt(v, out=v)
        np.subtract(v, self.mechanism.delta + 0.5 * self.mechanism.width, out=v)
        np.subtract(self.mechanism.reach_down, h, out=h)
        _within(h, (0.0, self.mechanism.reach_down), self.tolerance, inside, flags)
        np.greater(h, 0.0, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.multiply(h, h, out=h)
        self._lengths(h, v, inside, flags, (x, y, spare, other))
        self._pulls(h, v, inside, flags, x)

    def _joints(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        a, b, c, v, h, spare = columns
        W, bounds, deepest = self.mechanism.width, self.bounds, self.mechanism.reach_down + self.tolerance
        inside.fill(True)
        for column, stroke in ((a, bounds.boom), (b, bounds.line_b), (c, bounds.line_c)):
            _within(column, stroke, self.tolerance, inside, flags)
        np.subtract(b, c, out=v)
        np.add(b, c, out=spare)
        np.multiply(v, spare, out=v)
        np.multiply(v, 0.5 / W, out=v)
        np.add(v, 0.5 * W, out=c)
        np.subtract(b, c, out=h)
        np.add(b, c, out=spare)
        np.multiply(h, spare, out=h)
        np.greater(h, 0.0, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.less_equal(h, deepest * deepest, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.multiply(v, v, out=a)
        self._pulls(h, v, inside, flags, a)

    def _directions(self, inside: Flags, flags: Flags, columns: Floats) -> None:
        """Set `inside` where x, y lie in a direction of the boom's range; uses the last two columns."""
        x, y, _, _, left, right = columns
        first, last = self.bounds.boom[0] - self.tolerance, self.bounds.boom[1] + self.tolerance
        if last - first >= tau:
            inside.fill(True)
            return
        np.multiply(x, cos(first), out=left)
        np.multiply(y, sin(first), out=right)
        np.greater_equal(left, right, out=inside)
        np.multiply(y, sin(last), out=left)
        np.multiply(x, cos(last), out=right)
        np.greater_equal(left, right, out=flags)
        join = np.logical_and if last - first < pi else np.logical_or
        join(inside, flags, out=inside)

    def _lengths(
        self, h: Floats, v: Floats, inside: Flags, flags: Flags, spare: tuple[Floats, Floats, Floats, Floats]
    ) -> None:
        """Clear `inside` where a line is too short or too long; leaves v² in the first of `spare`."""
        square, along, both, found = spare
        W = self.mechanism.width
        np.multiply(v, v, out=square)
        np.add(h, square, out=both)
        np.multiply(v, W, out=along)
        for stroke, join in ((self.bounds.line_b, np.add), (self.bounds.line_c, np.subtract)):
            join(both, along, out=found)
            short, long = stroke[0] - self.tolerance, stroke[1] + self.tolerance
            _within(found, (short * short - 0.25 * W * W, long * long - 0.25 * W * W), 0.0, inside, flags)

    def _pulls(self, h: Floats, v: Floats, inside: Flags, flags: Flags, square: Floats) -> None:
        """Clear `inside` where a line hangs slack or carries too much; `h` is h², `square` is v²."""
        W = self.mechanism.width
        pull = self.bounds.tension_limit * (1.0 + self.tolerance) * W
        np.abs(v, out=v)
        np.less_equal(v, 0.5 * W + self.tolerance, out=flags)
        np.logical_and(inside, flags, out=inside)
        np.add(v, 0.5 * W, out=v)
        np.multiply(v, v, out=v)
        np.subtract(pull * pull, v, out=v)
        np.multiply(v, h, out=v)
        np.subtract(0.25 * W * W, square, out=square)
        np.multiply(square, square, out=square)
        np.less_equal(square, v, out=flags)
        np.logical_and(inside, flags, out=inside)


def _within(column: Floats, stroke: Stroke, tolerance: float, inside: Flags, flags: Flags) -> None:
    np.greater_equal(column, stroke[0] - tolerance, out=flags)
    np.logical_and(inside, flags, out=inside)
    np.less_equal(column, stroke[1] + tolerance, out=flags)
    np.logical_and(inside, flags, out=inside)


def _blockwise(judge: Callable[[Flags, Flags, Floats], None], rows: Floats, out: Flags) -> Flags:
    """Have `judge` write to `out` about blocks of rows (n, 3), which it finds in the first three of six columns."""
    columns, flags = np.empty((6, _BLOCK)), np.empty(_BLOCK, dtype=np.bool_)
    with np.errstate(invalid="ignore", over="ignore"):
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            work = columns[:, : len(block)]
            np.copyto(work[:3], block.T)
            judge(out[start : start + _BLOCK], flags[: len(block)], work)
    return out
