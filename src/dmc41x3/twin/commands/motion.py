"""Commands of independent motion: where to, begin, stop, servo on and off, define a position."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from dmc41x3.language.codes import ErrorCode, StopCode
from dmc41x3.twin.commands.setting import addressed, allowed, kept, named
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, axes_and_planes, mask
from dmc41x3.twin.motion.axis import Axis, Latch, MotionKind
from dmc41x3.twin.registers import JOG, POSITION, WriteCondition
from dmc41x3.twin.status import distance_set

_LATCHES = {"S": Latch.AUXILIARY, "T": Latch.INDEX}

_Reader = Callable[[CallerContext, Axis], float]
_Check = Callable[[CallerContext, Axis], None]
_Writer = Callable[[CallerContext, Axis, int], None]


def _per_axis(check: _Check, write: _Writer, read: _Reader, context: CallerContext, text: str) -> Answer:
    """Set or tell a whole number of each axis named; nothing is set where one of them is refused."""
    asked: list[float] = []
    changes: list[tuple[Axis, int]] = []
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            asked.append(read(context, axis))
            continue
        check(context, axis)
        changes.append((axis, int(POSITION.rounded(context.number(argument)))))
    for axis, value in changes:
        write(context, axis, value)
    return context.unit.position_text(asked) if asked else None


def _resting(_: CallerContext, axis: Axis) -> None:
    allowed(axis, WriteCondition.RESTING)


def _at_rest_or_tracking(_: CallerContext, axis: Axis) -> None:
    if not axis.tracking or axis.plane:
        allowed(axis, WriteCondition.RESTING)
    elif not axis.on:
        raise Rejection(ErrorCode.BEGIN_MOTOR_OFF)


def _any_time(_: CallerContext, _axis: Axis) -> None:
    return None


def _absolute(context: CallerContext, axis: Axis, value: int) -> None:
    if axis.tracking:
        context.core.track(axis, value)
    else:
        axis.kind, axis.destination = MotionKind.ABSOLUTE, value


def _relative(_: CallerContext, axis: Axis, value: int) -> None:
    axis.kind, axis.distance = MotionKind.RELATIVE, value


def _auxiliary(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.define_auxiliary(axis, value)


def _auxiliary_now(context: CallerContext, axis: Axis) -> float:
    return context.core.position(axis) if axis.stepper else axis.auxiliary


def _track(_: CallerContext, axis: Axis, value: int) -> None:
    if value not in (0, 1):
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    axis.tracking = value == 1


def _shift(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.shift(axis, value)


def _define(context: CallerContext, axis: Axis, value: int) -> None:
    context.core.define(axis, value)


def _jog_check(_: CallerContext, axis: Axis) -> None:
    if axis.motion is not None and axis.motion.kind is not MotionKind.JOG:
        raise Rejection(ErrorCode.JOG_ONLY_IN_JOG_MODE)
    if axis.plane:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)


def _jog(context: CallerContext, text: str) -> Answer:
    """JG: the jog mode and its signed speed; a jog under way follows at once, also backwards.

    Without any speed all axes get the mode and keep their speeds, as a program in use expects (Harvard, DPSS laser).
    """
    asked: list[float] = []
    changes: list[tuple[Axis, float]] = []
    if not text.strip():
        return _jog_mode(context)
    for axis, argument in addressed(context, text):
        if argument == QUERY:
            asked.append(abs(axis.jog_speed))
            continue
        _jog_check(context, axis)
        changes.append((axis, kept(context, axis, "JG", JOG, context.number(argument))))
    for axis, speed in changes:
        axis.kind, axis.jog_speed = MotionKind.JOG, speed
        axis.registers["SP"] = abs(speed)
        context.core.jog_at(axis, speed)
    return context.unit.position_text(asked) if asked else None


def _jog_mode(context: CallerContext) -> None:
    for axis in context.unit.axes:
        _jog_check(context, axis)
    for axis in context.unit.axes:
        axis.kind = MotionKind.JOG


def _begin(context: CallerContext, text: str) -> Answer:
    text, virtual = named(context, text)
    places, planes = axes_and_planes(text, context.unit.letters)
    if not places and not planes and not virtual:
        places = mask("", context.unit.letters)
    if places or virtual:
        context.core.begin([*context.axes(places), *virtual])
    for letter in planes:
        context.core.begin_plane(context.core.planes[letter])
    return None


def _stop(context: CallerContext, text: str) -> Answer:
    """ST: stop axes and planes; without any all of them, virtual axes too, and, from a host, the program."""
    text, virtual = named(context, text)
    places, planes = axes_and_planes(text, context.unit.letters)
    if not places and not planes and not virtual:
        places, planes, virtual = mask("", context.unit.letters), ["S", "T"], list(context.core.virtual.values())
        if context.thread is None:
            context.unit.threads.halt_all()
    for letter in planes:
        context.core.stop_plane(context.core.planes[letter])
    for axis in [*context.axes(places), *virtual]:
        context.core.stop(axis)
    return None


def _abort(context: CallerContext, text: str) -> Answer:
    """AB 0 also ends the program; AB 1 ends motion only."""
    motion_only = bool(text.strip()) and context.integer(text, 0, 1) == 1
    context.core.abort(StopCode.ABORTED)
    if not motion_only:
        context.unit.threads.halt_all()
    return None


def _servo(on: bool, context: CallerContext, text: str) -> Answer:
    axes = context.axes(mask(text, context.unit.letters))
    for axis in axes:
        allowed(axis, WriteCondition.RESTING)
        if on and axis.commutated and not axis.initialised:
            raise Rejection(ErrorCode.NOT_INITIALISED)
    for axis in axes:
        context.core.servo(axis, on)
    return None


def _seek(kind: MotionKind, context: CallerContext, text: str) -> Answer:
    """FE, FI, HM: choose a homing for the next BG."""
    axes = context.axes(mask(text, context.unit.letters))
    for axis in axes:
        allowed(axis, WriteCondition.RESTING)
    for axis in axes:
        axis.kind = kind
    return None


def _arm(context: CallerContext, text: str) -> Answer:
    """AL: arm latches; an S before a letter means the auxiliary encoder, a T the index."""
    latch = Latch.INPUT
    armed: list[tuple[int, Latch]] = []
    for name in text.replace(" ", ""):
        if name in _LATCHES:
            latch = _LATCHES[name]
            continue
        armed += [(place, latch) for place in mask(name, context.unit.letters)]
        latch = Latch.INPUT
    if latch is not Latch.INPUT:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for place, by in armed or [(place, latch) for place in mask("", context.unit.letters)]:
        context.unit.latches.arm(context.unit.axes[place], by)
    return None


TABLE: dict[str, Handler] = {
    "PA": partial(_per_axis, _at_rest_or_tracking, _absolute, lambda _, axis: axis.last_stop),
    "PR": partial(_per_axis, _resting, _relative, lambda context, axis: distance_set(context.unit, axis)),
    "IP": partial(_per_axis, _any_time, _shift, lambda context, axis: axis.reference(context.core.now)),
    "DP": partial(_per_axis, _resting, _define, lambda context, axis: context.core.position(axis)),
    "DE": partial(_per_axis, _any_time, _auxiliary, _auxiliary_now),
    "PT": partial(_per_axis, _resting, _track, lambda _, axis: axis.tracking),
    "JG": _jog,
    "BG": _begin,
    "ST": _stop,
    "AB": _abort,
    "SH": partial(_servo, True),
    "MO": partial(_servo, False),
    "FE": partial(_seek, MotionKind.FIND_EDGE),
    "FI": partial(_seek, MotionKind.FIND_INDEX),
    "HM": partial(_seek, MotionKind.HOME),
    "AL": _arm,
}
