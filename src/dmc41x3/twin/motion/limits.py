"""Limits of one axis: which of its switches LD leaves in force, and when its reference passes FL or BL."""

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
