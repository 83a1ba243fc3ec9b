"""Commands of the contour mode (CM, CD, DT) and of PVT sequences (PV, BT)."""

from __future__ import annotations

from dmc41x3.language.codes import ErrorCode
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, by_axis, mask, split
from dmc41x3.twin.motion.axis import Axis
from dmc41x3.twin.motion.feed import PAUSED, Contour, FeedRecord, Pvt
from dmc41x3.twin.registers import JOG

_LARGEST_STEP = 32_768
_LARGEST_INTERVAL = 8
_LARGEST_WAY = 30_000_000
_LONGEST = 2_048
_CLEAR = -1


def _members(context: CallerContext, text: str) -> Answer:
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
    """DT: the time of a record as a power of two of samples; -1 holds the axes at the end of the one under way."""
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
    # A contour that had come to its last record while it was held is over now.
    context.core.refresh()
    context.core.look()
    return None


def _distances(context: CallerContext, text: str) -> Answer:
    """CD: how far each axis goes in one interval, with =t in an interval of its own; =0 ends the contour."""
    contour = context.core.contour
    if not contour.members:
        raise Rejection(ErrorCode.NO_SEQUENCE)
    parts = split(text, "=")
    if len(parts) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    deltas = _steps(context, contour, parts[0])
    interval = context.integer(parts[1], 0, _LARGEST_INTERVAL) if len(parts) == 2 else None
    if interval == 0:
        return _end(context, contour, deltas)
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


def _end(context: CallerContext, contour: Contour, deltas: tuple[int, ...]) -> Answer:
    """End the contour behind its last record; one that has none leaves the mode at once."""
    if any(deltas):
        raise Rejection(ErrorCode.NO_TIME)
    if contour.running or not contour.empty:
        contour.append(FeedRecord(deltas, 0.0, 0.0), context.core.now)
    else:
        contour.select((), context.core.now)
    return None


def _begin_contour(context: CallerContext, contour: Contour) -> None:
    """Begin; where an axis may not, the records that waited are forgotten."""
    try:
        context.core.begin_feeds([contour])
    except Rejection:
        contour.clear(context.core.now)
        raise


def _pvt(context: CallerContext, axis: Axis) -> Pvt:
    return context.core.pvt[axis.index]


def _record(context: CallerContext, text: str) -> Answer:
    """PVA=p,v,t: way, velocity at its end, and samples; t 0 ends the sequence, t -1 empties the buffer."""
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
    """Return the duration of a record; those between 0 and 2 samples do not exist."""
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
    """BT: begin the PVT sequences of the axes named, without names of all that have one."""
    feeds = [_pvt(context, axis) for axis in context.axes(mask(text, context.unit.letters))]
    if not text.strip():
        feeds = [feed for feed in feeds if not feed.empty]
    if not feeds:
        raise Rejection(ErrorCode.NO_SEQUENCE)
    context.core.begin_feeds(feeds)
    return None


TABLE: dict[str, Handler] = {
    "CM": _members,
    "DT": _interval,
    "CD": _distances,
    "PV": _record,
    "BT": _begin,
}
