"""Commands of vector sequences: VM, VP, CR, the tangent axis TN and the ellipse scale ES.

Where the manual is silent: ES multiplies the axis of the higher resolution by the ratio, and speeds are those before
that; VP and CR without all their numbers are refused (50); VM takes the virtual axes N and M as dummies.
"""

from __future__ import annotations

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import join_positions
from dmc41x3.twin.commands.coordinated import LONGEST, current, speeds
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, place, split
from dmc41x3.twin.motion.axis import VIRTUAL, Axis
from dmc41x3.twin.motion.path import TANGENT, Arc, PathSegment, X, Y
from dmc41x3.twin.motion.plane import LINEAR, VECTOR, Plane

_SMALLEST_RADIUS, _LARGEST_RADIUS = 10.0, 6_000_000.0
_LARGEST_ANGLE = 32_000.0
_LARGEST_ARC = 450_000_000.0
_LARGEST_FACTOR = 127.0
_LARGEST_SCALE = 65_535
_POSITION = 2_147_483_647


def _members(context: CallerContext, text: str) -> Answer:
    """VM: two axes in the order of the coordinates x and y, and one that turns with the path, or N for none."""
    names = text.replace(" ", "")
    if names == QUERY:
        raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
    if not 2 <= len(names) <= 3 or not names.isalpha():
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS if len(names) < 2 else ErrorCode.OPERAND_ERROR)
    if len(names) == 3 and names[2] in VIRTUAL:
        names = names[:2]
    members = tuple(_axis(context, name).index for name in names)
    if len(set(members)) < len(members):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    current(context).select(VECTOR, members, (X, Y, TANGENT)[: len(members)])
    return None


def _axis(context: CallerContext, name: str) -> Axis:
    if name in VIRTUAL:
        return context.core.virtual[name]
    return context.unit.axes[place(name, context.unit.letters)]


def _ready(context: CallerContext) -> Plane:
    plane = current(context)
    if plane.mode != VECTOR:
        raise Rejection(ErrorCode.SEGMENT_KINDS_MIXED if plane.mode == LINEAR else ErrorCode.NO_SEQUENCE)
    return plane


def _point(context: CallerContext, text: str) -> Answer:
    """VP: a straight segment to a place that counts from the start of the sequence."""
    plane = _ready(context)
    text, start, end = speeds(context, text)
    x, y = _numbers(text, 2)
    place = (context.integer(x, -_POSITION - 1, _POSITION), context.integer(y, -_POSITION - 1, _POSITION))
    segment = PathSegment.of(tuple(to - at for to, at in zip(place, plane.tip, strict=True)), start, end)
    if segment.length > LONGEST:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    plane.append(segment, context.core.now)
    return None


def _arc(context: CallerContext, text: str) -> Answer:
    """CR: an arc by its radius, the angle of its start seen from the centre, and the angle along it."""
    plane = _ready(context)
    text, start, end = speeds(context, text)
    radius, angle, turn = (context.number(argument) for argument in _numbers(text, 3))
    if not _SMALLEST_RADIUS <= radius <= _LARGEST_RADIUS or max(abs(angle), abs(turn)) > _LARGEST_ANGLE:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    if radius * abs(turn) >= _LARGEST_ARC:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    plane.append(PathSegment.along(Arc.of(radius, angle, turn), start, end), context.core.now)
    return None


def _numbers(text: str, count: int) -> list[str]:
    arguments = split(text)
    if len(arguments) > count:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if len(arguments) < count or not all(arguments):
        raise Rejection(ErrorCode.NOT_ENOUGH_FIELDS)
    if QUERY in arguments:
        raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
    return arguments


def _tangent(context: CallerContext, text: str) -> Answer:
    """TN: counts of the tangent axis per degree, and where it stands at 0 degrees; from the next BG on."""
    plane = current(context)
    values, asked = list(plane.tangent), list[float]()
    arguments = split(text)
    if len(arguments) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    for index, argument in enumerate(arguments):
        if argument == QUERY:
            asked.append(values[index])
        elif argument:
            values[index] = context.number(argument)
    if abs(values[0]) > _LARGEST_FACTOR:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    plane.tangent = (values[0], int(values[1]))
    return join_positions([context.unit.value_text(value) for value in asked]) if asked else None


def _ellipse(context: CallerContext, text: str) -> Answer:
    """ES m,n: multiply y by n/m where n is the larger, x by m/n where m is; from the next BG on."""
    plane = current(context)
    if plane.running:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    m, n = (context.integer(argument, 1, _LARGEST_SCALE) for argument in _numbers(text, 2))
    plane.scale = (max(1.0, m / n), max(1.0, n / m))
    return None


TABLE: dict[str, Handler] = {
    "VM": _members,
    "VP": _point,
    "CR": _arc,
    "TN": _tangent,
    "ES": _ellipse,
}
