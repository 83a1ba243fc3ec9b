"""The controller's own homing: FE (edge of the home input), FI (index), HM (edge, edge again slowly, index).

The plant has no index pulse of its own, so every encoder is taken to show one each `INDEX_PITCH` motor counts. The
last stage goes straight to the index and rests there; a real one overshoots, latches and returns, to the same end.
"""

from __future__ import annotations

from math import ceil, floor

from maya_un.galil.codes import StopCode
from maya_un.virtual import profile
from maya_un.virtual.axis import Axis, Kind, Motion
from maya_un.virtual.profile import Profile

INDEX_PITCH = 4000
"""Motor counts from one index pulse to the next."""

SEEKING, BRAKING, RETURNING, TO_INDEX = 1, 2, 3, 4
"""Stages of a homing."""

KINDS = frozenset({Kind.FIND_EDGE, Kind.FIND_INDEX, Kind.HOME})


def start(axis: Axis, t: float, direction: int, level: bool) -> Motion:
    """Return the motion that begins a homing in `direction` (1 or -1) with the home input at `level`."""
    p, _ = axis.timeline.at(t)
    result = StopCode.FOUND_EDGE if axis.kind is Kind.FIND_EDGE else StopCode.HOMED
    if axis.kind is Kind.FIND_INDEX:
        way = _to_index(axis, t, p, direction, abs(axis.jog_speed))
        return Motion(axis.kind, way, result=result, stage=TO_INDEX)
    registers = axis.registers
    way = profile.jog(t, p, 0.0, direction * registers["SP"], registers["AC"], registers["DC"])
    return Motion(axis.kind, way, speed=direction * registers["SP"], result=result, level=level)


def edge(axis: Axis, motion: Motion, t: float) -> Profile | None:
    """Return what an axis does where its home input has just changed; None where it goes on."""
    p, v = axis.timeline.at(t)
    if motion.stage == SEEKING:
        motion.stage = BRAKING
        return profile.stop(t, p, v, axis.registers["DC"])
    if motion.stage == RETURNING:
        motion.stage = TO_INDEX
        return _to_index(axis, t, round(p), 1, axis.registers["HV"])
    return None


def rested(axis: Axis, motion: Motion, t: float, level: bool) -> Profile | None:
    """Return how an axis goes on that came to rest within its homing; None where it is done."""
    if motion.kind is not Kind.HOME or motion.stage != BRAKING or motion.stopping:
        return None
    motion.stage, motion.level = RETURNING, level
    motion.speed = -motion.speed / abs(motion.speed) * axis.registers["HV"] if motion.speed else 0.0
    p, _ = axis.timeline.at(t)
    return profile.jog(t, p, 0.0, motion.speed, axis.registers["AC"], axis.registers["DC"])


def _to_index(axis: Axis, t: float, p: float, direction: int, speed: float) -> Profile:
    place = p / INDEX_PITCH
    target = (floor(place) + 1 if direction > 0 else ceil(place) - 1) * INDEX_PITCH
    return profile.move(t, p, 0.0, target, speed, axis.registers["AC"], axis.registers["DC"])
