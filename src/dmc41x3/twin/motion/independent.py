"""Independent motion of one axis: profiles smoothed by IT, limits, and homing (FE, FI, HM).

In the real controller IT is a low-pass filter of first order. Here it is the mean of delayed copies of the profile,
with the same mean delay. That mean ends and is closed-form; the move takes longer by twice the filter's delay.

The plant has no index pulse, so every encoder is assumed to have one each `INDEX_PITCH` motor counts, which is
detected when the reference passes it. An axis passes the index, brakes, returns to it and defines it as 0. A stepper
has no index: its HM ends at the second edge. The manual does not specify the position there; it is defined as 0, too.
"""

from __future__ import annotations

from math import ceil, floor

from dmc41x3.language.codes import StopCode
from dmc41x3.twin import timeline
from dmc41x3.twin.motion.axis import FORWARD_OFF, REVERSE_OFF, Axis, IndependentMotion, MotionKind
from dmc41x3.twin.timeline import AxisProfile


def jog(axis: Axis, t: float, p: float, v: float, wanted: float, sample: float) -> AxisProfile:
    """Return the profile to the velocity `wanted` [counts/s] from `p` [counts] and `v` [counts/s] at time `t` [s].

    `sample` is the servo's sample time [s].
    """
    spread, registers = _spread(axis, sample), axis.registers
    way = timeline.jog_profile(t, p + 0.5 * spread * v, v, wanted, registers["AC"], registers["DC"])
    return timeline.smoothed_profile(way, t, p, v, spread) if spread else way


def move(axis: Axis, t: float, p: float, v: float, target: int, sample: float) -> AxisProfile:
    """Return the profile to rest at `target` [counts]; even a move of no counts takes a sample."""
    spread, registers = _spread(axis, sample), axis.registers
    way = timeline.move_profile(t, p + 0.5 * spread * v, v, target, registers["SP"], registers["AC"], registers["DC"])
    if spread:
        way = timeline.smoothed_profile(way, t, p, v, spread)
    return way._replace(end=max(way.end, t + sample))


def stop(axis: Axis, t: float, p: float, v: float, rate: float, sample: float) -> AxisProfile:
    """Return the profile to rest at `rate` [counts/s²]."""
    spread = _spread(axis, sample) if v else 0.0
    way = timeline.stop_profile(t, p + 0.5 * spread * v, v, rate)
    return timeline.smoothed_profile(way, t, p, v, spread) if spread else way


def _spread(axis: Axis, sample: float) -> float:
    return 2.0 * sample * (1.0 / axis.registers["IT"] - 1.0)


LIMIT_CODES = (StopCode.FORWARD_LIMIT, StopCode.REVERSE_LIMIT)
"""Stop codes of an axis that a limit stopped."""

_FAR = 1e9


def limit_enabled(axis: Axis, direction: int) -> bool:
    """Return whether LD leaves the limit switch of a direction enabled."""
    return not axis.virtual and not int(axis.registers["LD"]) & (1 if direction > 0 else 2)


def beyond_limit(axis: Axis, direction: int, now: float) -> bool:
    """Return whether the axis is past the soft limit of a direction at time `now` [s]."""
    if axis.virtual:
        return False
    here = axis.reference(now)
    if direction > 0:
        return axis.registers["FL"] < FORWARD_OFF and here > axis.registers["FL"]
    return axis.registers["BL"] > REVERSE_OFF and here < axis.registers["BL"]


def watch_limits(axis: Axis, now: float, start: float | None = None) -> None:
    """Compute when after `now` [s] the reference passes FL or BL; with `start` it does not do so before then."""
    axis.soft_limit = None
    if axis.virtual or not axis.moving or axis.stop_code in LIMIT_CODES:
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


def near_error_limit(axis: Axis) -> bool:
    """Return whether the speed of the plan could bring the following error to ER, by the error measured so far."""
    limit = axis.registers["ER"]
    if not axis.on or limit < 0:
        return False
    if axis.error_gain is None:
        return axis.peak > 0.0
    return axis.error_gain * axis.peak * _MARGIN >= limit


def learn_error(axis: Axis, error: float, wanted: float, actual: float) -> None:
    """Store the error [counts] per unit of speed if the axis follows its reference [counts/s]."""
    if wanted * actual > 0.0 and 0.8 * abs(wanted) <= abs(actual) <= _MARGIN * abs(wanted):
        axis.error_gain = error / abs(actual)


INDEX_PITCH = 4000
"""Motor counts from one index pulse to the next."""

SEEKING, BRAKING, RETURNING, TO_INDEX, TO_LATCHED = 1, 2, 3, 4, 5
"""Stages of a homing."""

HOMING_KINDS = frozenset({MotionKind.FIND_EDGE, MotionKind.FIND_INDEX, MotionKind.HOME})


def begin_homing(axis: Axis, t: float, direction: int, level: bool) -> IndependentMotion:
    """Return the motion that begins a homing in `direction` (1 or -1) with the home input at `level`."""
    p, _ = axis.timeline.at(t)
    registers = axis.registers
    if axis.kind is MotionKind.FIND_INDEX:
        motion = IndependentMotion(
            axis.kind, timeline.stop_profile(t, p, 0.0, 1.0), result=StopCode.HOMED, stage=TO_INDEX
        )
        motion.profile = _to_index(axis, motion, t, p, axis.jog_speed)
        return motion
    result = StopCode.FOUND_EDGE if axis.kind is MotionKind.FIND_EDGE else StopCode.HOMED
    way = timeline.jog_profile(t, p, 0.0, direction * registers["SP"], registers["AC"], registers["DC"])
    return IndependentMotion(axis.kind, way, speed=direction * registers["SP"], result=result, level=level)


def pass_home_edge(axis: Axis, motion: IndependentMotion, t: float) -> AxisProfile | None:
    """Return the next profile of an axis whose home input has just changed; None if the profile stays the same."""
    p, v = axis.timeline.at(t)
    if motion.stage == SEEKING:
        motion.stage = BRAKING
        return timeline.stop_profile(t, p, v, axis.registers["DC"])
    if motion.stage != RETURNING:
        return None
    if axis.stepper:
        motion.stage = TO_LATCHED
        return timeline.stop_profile(t, p, 0.0, axis.registers["DC"])
    motion.stage = TO_INDEX
    return _to_index(axis, motion, t, round(p), axis.registers["HV"])


def continue_homing(axis: Axis, motion: IndependentMotion, t: float, level: bool) -> AxisProfile | None:
    """Return the next profile of an axis that came to rest within its homing; None if the homing is complete."""
    if motion.stopping:
        return None
    p, _ = axis.timeline.at(t)
    registers = axis.registers
    if motion.stage == TO_INDEX:
        motion.stage = TO_LATCHED
        return timeline.move_profile(t, p, 0.0, motion.target, registers["HV"], registers["AC"], registers["DC"])
    if motion.kind is not MotionKind.HOME or motion.stage != BRAKING:
        return None
    motion.stage, motion.level = RETURNING, level
    motion.speed = -motion.speed / abs(motion.speed) * registers["HV"] if motion.speed else 0.0
    return timeline.jog_profile(t, p, 0.0, motion.speed, registers["AC"], registers["DC"])


def _to_index(axis: Axis, motion: IndependentMotion, t: float, p: float, speed: float) -> AxisProfile:
    """Return the profile past the next index at `speed` [counts/s, signed] and to rest after it; store its position."""
    place = p / INDEX_PITCH
    motion.target = (floor(place) + 1 if speed >= 0.0 else ceil(place) - 1) * INDEX_PITCH
    axis.latched = motion.target + axis.offset
    return timeline.pass_profile(t, p, motion.target, speed, axis.registers["AC"], axis.registers["DC"])
