"""Limits of one axis: the switches that LD leaves in force, and the following error that it has at speed."""

from __future__ import annotations

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion.axis import FORWARD_OFF, REVERSE_OFF, Axis

CODES = (StopCode.FORWARD_LIMIT, StopCode.REVERSE_LIMIT)
"""Stop codes of an axis that a limit stopped."""

_FAR = 1e9


def enabled(axis: Axis, direction: int) -> bool:
    """Tell whether LD leaves the limit switch of a direction in force."""
    return not axis.virtual and not int(axis.registers["LD"]) & (1 if direction > 0 else 2)


def beyond(axis: Axis, direction: int, now: float) -> bool:
    """Tell whether the axis is past the soft limit of a direction at time `now` [s]."""
    if axis.virtual:
        return False
    here = axis.reference(now)
    if direction > 0:
        return axis.registers["FL"] < FORWARD_OFF and here > axis.registers["FL"]
    return axis.registers["BL"] > REVERSE_OFF and here < axis.registers["BL"]


def watch(axis: Axis, now: float, start: float | None = None) -> None:
    """Work out when after `now` [s] the reference passes FL or BL; with `start` it is known not to before then."""
    axis.soft_limit = None
    if axis.virtual or not axis.moving or axis.stop_code in CODES:
        return
    forward, reverse = axis.registers["FL"], axis.registers["BL"]
    after = now if start is None else start
    times: list[float | None] = []
    if forward < FORWARD_OFF:
        times.append(axis.timeline.crossing(forward + 1 - axis.offset, after, after + _FAR, True))
    if reverse > REVERSE_OFF:
        times.append(axis.timeline.crossing(reverse - 1 - axis.offset, after, after + _FAR, False))
    axis.soft_limit = min((t for t in times if t is not None), default=None)


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
