"""Commands of coordinated motion: linear (LM) and vector sequences (VM), contours (CM), PVT (PV).

Not in the manual: ES multiplies the axis of the higher resolution by the ratio, and speeds apply before the
multiplication; VP and CR without all their numbers are refused (50); VM takes the virtual axes N and M as dummies.
"""

from __future__ import annotations

import re
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.numbers import join_positions
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, axis_place, by_axis, mask, split
from dmc41x3.twin.motion.axis import VIRTUAL, Axis
from dmc41x3.twin.motion.coordination import PAUSED, Contour, FeedRecord, Pvt
from dmc41x3.twin.motion.path import TANGENT, Arc, PathSegment, X, Y
from dmc41x3.twin.motion.plane import LINEAR, VECTOR, Plane
from dmc41x3.twin.registers import JOG, PLANE, Register, WriteCondition

LONGEST = 8_388_607
"""Largest count of one axis in one segment."""

PLANES = "ST"

_SEGMENT = re.compile(r"([^<>]*)(?:<([^<>]*))?(?:>([^<>]*))?")
_WHOLE: dict[tuple[int, ...], re.Pattern[str]] = {
    members: re.compile(f" ?{deltas}<([0-9]{{1,7}})>([0-9]{{1,7}})".replace("n", "(-?[0-9]{1,6})"))
    for members, deltas in {(0,): "n", (1, 2): ",n,n", (0, 1, 2): "n,n,n"}.items()
}
"""Common segments of hosts, by members: they need no evaluation, and only a `<o` below 2 can be out of range."""

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


def _linear_members(context: CallerContext, text: str) -> Answer:
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
    """Return the text before `<o>p`, and the two speeds [counts/s], None if not given; `<-1` stands for VV."""
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
    """Return a segment's own speed [counts/s], None if not given; `lowest` is -1 if `<-1` may stand for VV."""
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


LINEAR_TABLE: dict[str, Handler] = {
    "CA": _select_plane,
    "LM": _linear_members,
    "LI": _segment,
    "LE": _end,
    "VE": _end,
    "CS": _clear,
    **{name: partial(_rate, name, register) for name, register in PLANE.items()},
}


_SMALLEST_RADIUS, _LARGEST_RADIUS = 10.0, 6_000_000.0
_LARGEST_ANGLE = 32_000.0
_LARGEST_ARC = 450_000_000.0
_LARGEST_FACTOR = 127.0
_LARGEST_SCALE = 65_535
_POSITION = 2_147_483_647


def _vector_members(context: CallerContext, text: str) -> Answer:
    """VM: two axes in the order of the coordinates x and y, and the tangent axis, or N for none."""
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
    return context.unit.axes[axis_place(name, context.unit.letters)]


def _ready(context: CallerContext) -> Plane:
    plane = current(context)
    if plane.mode != VECTOR:
        raise Rejection(ErrorCode.SEGMENT_KINDS_MIXED if plane.mode == LINEAR else ErrorCode.NO_SEQUENCE)
    return plane


def _point(context: CallerContext, text: str) -> Answer:
    """VP: a straight segment to a position relative to the start of the sequence."""
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
    """TN: counts of the tangent axis per degree, and its position at 0 degrees; effective from the next BG on."""
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
    """ES m,n: multiply y by n/m if n is larger, x by m/n if m is larger; effective from the next BG on."""
    plane = current(context)
    if plane.running:
        raise Rejection(ErrorCode.NOT_WHILE_RUNNING)
    m, n = (context.integer(argument, 1, _LARGEST_SCALE) for argument in _numbers(text, 2))
    plane.scale = (max(1.0, m / n), max(1.0, n / m))
    return None


VECTOR_TABLE: dict[str, Handler] = {
    "VM": _vector_members,
    "VP": _point,
    "CR": _arc,
    "TN": _tangent,
    "ES": _ellipse,
}


_LARGEST_STEP = 32_768
_LARGEST_INTERVAL = 8
_LARGEST_WAY = 30_000_000
_LONGEST = 2_048
_CLEAR = -1


def _contour_members(context: CallerContext, text: str) -> Answer:
    contour = context.core.contour
    if text.strip() == QUERY:
        return context.unit.position_text([contour.free(context.core.now)])
    if contour.running:
        raise Rejection(ErrorCode.NOT_WHILE_CONTOURING)
    members = mask(text, context.unit.letters)
    if any(axis.plane in context.core.planes for axis in context.axes(members)):
        raise Rejection(ErrorCode.NOT_IN_COORDINATED_MOVE)
    contour.select(tuple(members), context.core.now)
    return None


def _interval(context: CallerContext, text: str) -> Answer:
    """DT: the time of a record as a power of two of samples; -1 holds the axes at the end of the current record."""
    contour = context.core.contour
    if text.strip() == QUERY:
        return context.unit.position_text([contour.interval])
    interval = context.integer(text, PAUSED, _LARGEST_INTERVAL)
    if contour.running and interval == 0:
        raise Rejection(ErrorCode.NOT_WHILE_CONTOURING)
    before = contour.interval
    contour.set_interval(interval, context.core.sample)
    if before == PAUSED and interval > 0 and not contour.running and not contour.empty:
        _begin_contour(context, contour)
    # A contour that reached its last record while it was held has now ended.
    context.core.refresh()
    context.core.look()
    return None


def _distances(context: CallerContext, text: str) -> Answer:
    """CD: the distance of each axis in one interval; =t gives the interval; =0 ends the contour."""
    contour = context.core.contour
    if not contour.members:
        raise Rejection(ErrorCode.NO_SEQUENCE)
    parts = split(text, "=")
    if len(parts) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    deltas = _steps(context, contour, parts[0])
    interval = context.integer(parts[1], 0, _LARGEST_INTERVAL) if len(parts) == 2 else None
    if interval == 0:
        return _end_contour(context, contour, deltas)
    if interval is not None:
        contour.set_time(interval, context.core.sample)
    if contour.usual == 0.0:
        raise Rejection(ErrorCode.NO_TIME)
    contour.append(FeedRecord(deltas, 0.0, contour.usual), context.core.now)
    if not contour.running and not contour.paused:
        _begin_contour(context, contour)
    return None


def _steps(context: CallerContext, contour: Contour, text: str) -> tuple[int, ...]:
    deltas = dict.fromkeys(contour.members, 0)
    for place, argument in by_axis(text, context.unit.letters):
        if argument == QUERY:
            raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
        value = int(context.number(argument))
        if not -_LARGEST_STEP <= value <= _LARGEST_STEP:
            raise Rejection(ErrorCode.CONTOUR_RANGE)
        if place in deltas:
            deltas[place] = value
        elif value:
            raise Rejection(ErrorCode.OPERAND_ERROR)
    return tuple(deltas.values())


def _end_contour(context: CallerContext, contour: Contour, deltas: tuple[int, ...]) -> Answer:
    """End the contour after its last record; without records, leave the mode at once."""
    if any(deltas):
        raise Rejection(ErrorCode.NO_TIME)
    if contour.running or not contour.empty:
        contour.append(FeedRecord(deltas, 0.0, 0.0), context.core.now)
    else:
        contour.select((), context.core.now)
    return None


def _begin_contour(context: CallerContext, contour: Contour) -> None:
    """Begin the contour; if an axis cannot begin, drop the waiting records and raise `Rejection`."""
    try:
        context.core.begin_feeds([contour])
    except Rejection:
        contour.clear(context.core.now)
        raise


def _pvt(context: CallerContext, axis: Axis) -> Pvt:
    return context.core.pvt[axis.index]


def _record(context: CallerContext, text: str) -> Answer:
    """PVA=p,v,t: distance, velocity at its end, and samples; t 0 ends the sequence, t -1 empties the buffer."""
    name, equals, value = text.partition("=")
    if not equals:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    places = mask(name if name.strip() != "*" else "", context.unit.letters)
    arguments = [argument or "0" for argument in split(value)]
    if len(arguments) > 3:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if QUERY in arguments:
        raise Rejection(ErrorCode.QUESTION_MARK_INVALID)
    timed = len(arguments) == 3 and bool(split(value)[2])
    way, speed, time = ([context.number(argument) for argument in arguments] + [0.0, 0.0])[:3]
    samples = None if not timed else _samples(time)
    if abs(int(way)) > _LARGEST_WAY:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    speed = JOG.rounded(speed)
    for axis in context.axes(places):
        _take(context, _pvt(context, axis), int(way), speed, samples)
    return None


def _samples(time: float) -> int:
    """Return the duration of a record [samples], even and at least 2, or -1 or 0; raises `Rejection` (6)."""
    samples = int(time)
    if samples not in (_CLEAR, 0) and not 2 <= samples <= _LONGEST:
        raise Rejection(ErrorCode.OUT_OF_RANGE)
    return samples if samples <= 0 else samples // 2 * 2


def _take(context: CallerContext, pvt: Pvt, way: int, speed: float, samples: int | None) -> None:
    if samples == _CLEAR:
        pvt.clear(context.core.now)
        return
    if samples is None:
        samples = pvt.samples
        if samples == 0:
            raise Rejection(ErrorCode.NO_TIME)
    pvt.append(FeedRecord((way,), speed, samples * context.core.sample), context.core.now)
    if samples:
        pvt.samples = samples


def _begin(context: CallerContext, text: str) -> Answer:
    """BT: begin the PVT sequences of the named axes, without names those of all axes that have one."""
    feeds = [_pvt(context, axis) for axis in context.axes(mask(text, context.unit.letters))]
    if not text.strip():
        feeds = [feed for feed in feeds if not feed.empty]
    if not feeds:
        raise Rejection(ErrorCode.NO_SEQUENCE)
    context.core.begin_feeds(feeds)
    return None


CONTOUR_TABLE: dict[str, Handler] = {
    "CM": _contour_members,
    "DT": _interval,
    "CD": _distances,
    "PV": _record,
    "BT": _begin,
}
