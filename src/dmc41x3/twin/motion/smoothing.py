"""The profiles that an axis' registers ask for, made smoother as its IT says.

IT is a low-pass filter of first order in the real controller. Here it is the mean of late copies of the profile, with
the same mean delay, which ends and is closed-form: the move takes longer by twice the filter's delay.
"""

from __future__ import annotations

from dmc41x3.twin.motion import profile
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.profile import AxisProfile


def jog(axis: Axis, t: float, p: float, v: float, wanted: float, sample: float) -> AxisProfile:
    """Return the way to the velocity `wanted` [counts/s] from `p` [counts] and `v` [counts/s] at time `t` [s].

    `sample` is the servo's sample time [s].
    """
    spread, registers = _spread(axis, sample), axis.registers
    way = profile.jog(t, p + 0.5 * spread * v, v, wanted, registers["AC"], registers["DC"])
    return profile.smoothed(way, t, p, v, spread) if spread else way


def move(axis: Axis, t: float, p: float, v: float, target: int, sample: float) -> AxisProfile:
    """Return the way to rest at `target` [counts]; even a move of no counts takes a sample."""
    spread, registers = _spread(axis, sample), axis.registers
    way = profile.move(t, p + 0.5 * spread * v, v, target, registers["SP"], registers["AC"], registers["DC"])
    if spread:
        way = profile.smoothed(way, t, p, v, spread)
    return way._replace(end=max(way.end, t + sample))


def stop(axis: Axis, t: float, p: float, v: float, rate: float, sample: float) -> AxisProfile:
    """Return the way to rest at `rate` [counts/s²]."""
    spread = _spread(axis, sample) if v else 0.0
    way = profile.stop(t, p + 0.5 * spread * v, v, rate)
    return profile.smoothed(way, t, p, v, spread) if spread else way


def _spread(axis: Axis, sample: float) -> float:
    return 2.0 * sample * (1.0 / axis.registers["IT"] - 1.0)
