"""How much following error an axis is known to have at speed, so that nobody looks for what cannot come."""

from __future__ import annotations

from dmc41x3.twin.motion.axis import Axis

_MARGIN = 1.25


def near_limit(axis: Axis) -> bool:
    """Tell whether the speed of the plan could bring the following error to ER, by what was seen so far."""
    limit = axis.registers["ER"]
    if not axis.on or limit < 0:
        return False
    if axis.error_gain is None:
        return axis.peak > 0.0
    return axis.error_gain * axis.peak * _MARGIN >= limit


def learn(axis: Axis, error: float, wanted: float, actual: float) -> None:
    """Note how much error [counts] a unit of speed causes, where the axis runs with its reference [counts/s]."""
    if wanted * actual > 0.0 and 0.8 * abs(wanted) <= abs(actual) <= _MARGIN * abs(wanted):
        axis.error_gain = error / abs(actual)
