"""The controller's own homing: FE (edge of the home input), FI (index), HM (both).

The plant has no index pulse of its own, so every encoder is taken to show one each `INDEX_PITCH` motor counts; the
pulse is seen where the reference passes it. An axis passes the index, brakes, returns to it and calls it 0. A stepper
has no index: its HM ends at the second edge. The manual does not say what HM leaves there; it is called 0 as well.
"""

from __future__ import annotations

from math import ceil, floor

from dmc41x3.language.codes import StopCode
from dmc41x3.twin.motion import profile
from dmc41x3.twin.motion.axis import Axis, IndependentMotion, MotionKind
from dmc41x3.twin.motion.profile import AxisProfile

INDEX_PITCH = 4000
"""Motor counts from one index pulse to the next."""

SEEKING, BRAKING, RETURNING, TO_INDEX, TO_LATCHED = 1, 2, 3, 4, 5
"""Stages of a homing."""

KINDS = frozenset({MotionKind.FIND_EDGE, MotionKind.FIND_INDEX, MotionKind.HOME})


def start(axis: Axis, t: float, direction: int, level: bool) -> IndependentMotion:
    """Return the motion that begins a homing in `direction` (1 or -1) with the home input at `level`."""
    p, _ = axis.timeline.at(t)
    registers = axis.registers
    if axis.kind is MotionKind.FIND_INDEX:
        motion = IndependentMotion(axis.kind, profile.stop(t, p, 0.0, 1.0), result=StopCode.HOMED, stage=TO_INDEX)
        motion.profile = _to_index(axis, motion, t, p, axis.jog_speed)
        return motion
    result = StopCode.FOUND_EDGE if axis.kind is MotionKind.FIND_EDGE else StopCode.HOMED
    way = profile.jog(t, p, 0.0, direction * registers["SP"], registers["AC"], registers["DC"])
    return IndependentMotion(axis.kind, way, speed=direction * registers["SP"], result=result, level=level)


def edge(axis: Axis, motion: IndependentMotion, t: float) -> AxisProfile | None:
    """Return what an axis does where its home input has just changed; None where it goes on."""
    p, v = axis.timeline.at(t)
    if motion.stage == SEEKING:
        motion.stage = BRAKING
        return profile.stop(t, p, v, axis.registers["DC"])
    if motion.stage != RETURNING:
        return None
    if axis.stepper:
        motion.stage = TO_LATCHED
        return profile.stop(t, p, 0.0, axis.registers["DC"])
    motion.stage = TO_INDEX
    return _to_index(axis, motion, t, round(p), axis.registers["HV"])


def rested(axis: Axis, motion: IndependentMotion, t: float, level: bool) -> AxisProfile | None:
    """Return how an axis goes on that came to rest within its homing; None where it is done."""
    if motion.stopping:
        return None
    p, _ = axis.timeline.at(t)
    registers = axis.registers
    if motion.stage == TO_INDEX:
        motion.stage = TO_LATCHED
        return profile.move(t, p, 0.0, motion.target, registers["HV"], registers["AC"], registers["DC"])
    if motion.kind is not MotionKind.HOME or motion.stage != BRAKING:
        return None
    motion.stage, motion.level = RETURNING, level
    motion.speed = -motion.speed / abs(motion.speed) * registers["HV"] if motion.speed else 0.0
    return profile.jog(t, p, 0.0, motion.speed, registers["AC"], registers["DC"])


def _to_index(axis: Axis, motion: IndependentMotion, t: float, p: float, speed: float) -> AxisProfile:
    """Return the way past the next index at `speed` [counts/s, signed] and to rest behind it; note its place."""
    place = p / INDEX_PITCH
    motion.target = (floor(place) + 1 if speed >= 0.0 else ceil(place) - 1) * INDEX_PITCH
    axis.latched = motion.target + axis.offset
    return profile.past(t, p, motion.target, speed, axis.registers["AC"], axis.registers["DC"])
