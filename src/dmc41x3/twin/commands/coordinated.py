"""Commands of coordinated motion in straight segments: CA, LM, LI, LE, CS and the rates of a plane."""

from __future__ import annotations

import re
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, by_axis, mask
from dmc41x3.twin.motion.path import PathSegment
from dmc41x3.twin.motion.plane import LINEAR, VECTOR, Plane
from dmc41x3.twin.registers import PLANE, Register, WriteCondition

LONGEST = 8_388_607
"""Largest count of one axis in one segment."""

PLANES = "ST"

_SEGMENT = re.compile(r"([^<>]*)(?:<([^<>]*))?(?:>([^<>]*))?")
_WHOLE: dict[tuple[int, ...], re.Pattern[str]] = {
    members: re.compile(f" ?{deltas}<([0-9]{{1,7}})>([0-9]{{1,7}})".replace("n", "(-?[0-9]{1,6})"))
    for members, deltas in {(0,): "n", (1, 2): ",n,n", (0, 1, 2): "n,n,n"}.items()
}
"""Segments of some members as hosts send them: nothing is to be evaluated, or out of range but `<o` below 2."""

_USE_VV = -1.0


def current(context: CallerContext) -> Plane:
    """Return the plane that CA selected."""
    return context.core.planes[context.unit.plane]


def _select_plane(context: CallerContext, text: str) -> Answer:
    name = text.strip()
    if name == QUERY:
        return context.unit.position_text([PLANES.index(context.unit.plane)])
    if len(name) != 1 or name not in PLANES:
        raise Rejection(ErrorCode.S_OPERAND_INVALID)
    context.unit.plane = name
    return None


def _members(context: CallerContext, text: str) -> Answer:
    if text.strip() == QUERY:
        return context.unit.position_text([current(context).free(context.core.now)])
    members = tuple(mask(text, context.unit.letters))
    current(context).select(LINEAR, members, tuple(range(len(members))))
    return None


def _segment(context: CallerContext, text: str) -> Answer:
    plane = current(context)
    if plane.mode != LINEAR or not plane.members:
        raise Rejection(ErrorCode.SEGMENT_KINDS_MIXED if plane.mode == VECTOR else ErrorCode.NO_SEQUENCE)
    plane.append(_in_whole_numbers(plane, text) or _evaluated(context, plane, text), context.core.now)
    return None


def _in_whole_numbers(plane: Plane, text: str) -> PathSegment | None:
    pattern = _WHOLE.get(plane.members)
    form = pattern and pattern.fullmatch(text)
    if form is None:
        return None
    *deltas, speed, end = map(int, form.groups())
    return PathSegment.of(tuple(deltas), speed // 2 * 2.0, end // 2 * 2.0) if speed >= 2 else None


def _evaluated(context: CallerContext, plane: Plane, text: str) -> PathSegment:
    text, start, end = speeds(context, text)
    return PathSegment.of(_deltas(context, plane, text), start, end)


def speeds(context: CallerContext, text: str) -> tuple[str, float | None, float | None]:
    """Return what stands before `<o>p`, and the two speeds [counts/s] where they are given; `<-1` stands for VV."""
    form = _SEGMENT.fullmatch(text)
    if form is None:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return form[1], _speed(context, form[2], _USE_VV), _speed(context, form[3], 0.0)


def _deltas(context: CallerContext, plane: Plane, text: str) -> tuple[int, ...]:
    deltas = dict.fromkeys(plane.members, 0)
    if text.strip():
        for place, argument in by_axis(text, context.unit.letters):
            if argument == QUERY:
                raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
            if place not in deltas:
                raise Rejection(ErrorCode.OPERAND_ERROR)
            deltas[place] = context.integer(argument, -LONGEST, LONGEST)
    return tuple(deltas.values())


def _speed(context: CallerContext, text: str | None, lowest: float) -> float | None:
    """Return a segment's own speed; `<-1` stands for VV, so that `lowest` is -1 there."""
    if text is None:
        return None
    value = context.number(text)
    if lowest < 0.0 and value == lowest:
        return value
    if not (2.0 if lowest < 0.0 else 0.0) <= value <= PLANE["VS"].maximum:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return int(value) // 2 * 2.0


def _end(context: CallerContext, text: str) -> Answer:
    plane = current(context)
    if text.strip() == QUERY:
        return context.unit.position_text([plane.total])
    plane.close()
    return None


def _clear(context: CallerContext, text: str) -> Answer:
    planes = mask(text, PLANES) if text.strip() else [PLANES.index(context.unit.plane)]
    for place in planes:
        context.core.planes[PLANES[place]].clear()
    return None


def _rate(name: str, register: Register, context: CallerContext, text: str) -> Answer:
    asked: list[float] = []
    changes: list[tuple[Plane, float]] = []
    for place, argument in by_axis(text, PLANES):
        plane = context.core.planes[PLANES[place]]
        if argument == QUERY:
            asked.append(plane.registers[name])
            continue
        if register.when is WriteCondition.RESTING and plane.running:
            raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
        changes.append((plane, register.rounded(context.number(argument))))
    for plane, value in changes:
        plane.registers[name] = value
        plane.rates_changed()
    if not asked:
        return None
    unit = context.unit
    return unit.fixed_text(asked, register.places) if register.places else unit.position_text(asked)


TABLE: dict[str, Handler] = {
    "CA": _select_plane,
    "LM": _members,
    "LI": _segment,
    "LE": _end,
    "VE": _end,
    "CS": _clear,
    **{name: partial(_rate, name, register) for name, register in PLANE.items()},
}
