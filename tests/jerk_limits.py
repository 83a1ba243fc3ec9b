"""The trajectory within the limits of jerk, as the planner finds it before segmentation."""

from __future__ import annotations

from maya_un.kinematics import Floats
from maya_un.motion import Knots, Limits
from maya_un.motion.jerk import Allowed, Fastest, Smooth, gentle
from maya_un.motion.speeds import Budget, Chords, Ramps, caps, knot_squares, peaks

BRISK = 46_080.0
"""The controller itself rises and falls no faster along the path [counts/s²]."""


def fastest_of(knots: Knots, limits: Limits) -> Fastest:
    """Return the search for the fastest way along `knots`."""
    chords = Chords.of(knots)
    budget = Budget.of(chords, limits, BRISK, BRISK)

    def fastest(within: Floats, at: Floats, share: Floats) -> Ramps:
        less = budget.less(share)
        squares = knot_squares(chords, less, at)
        tops, up, down = peaks(chords, less, within, squares)
        return Ramps(squares[:-1] ** 0.5, tops**0.5, squares[1:] ** 0.5, up, down)

    return fastest


def gentle_of(knots: Knots, limits: Limits, allowed: Allowed | None = None) -> list[Smooth]:
    """Return the ways over time between the rests of a path, at full speed."""
    within, at = caps(Chords.of(knots), limits, 1.0)
    return [smooth for _, smooth in gentle(knots, limits, within, at, fastest_of(knots, limits), allowed)]
