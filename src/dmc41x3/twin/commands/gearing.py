"""Commands of gearing and of the electronic cam: GA, and EA, EB, EC, EG, EP, EQ, ET, EW, EY.

GR, GM, GD and EM are registers of the axes.
"""

from __future__ import annotations

import re
from functools import partial

from dmc41x3.language.codes import ErrorCode
from dmc41x3.language.hardware import ALIASES, LETTERS
from dmc41x3.twin.commands.axis import addressed
from dmc41x3.twin.context import Answer, CallerContext, Handler
from dmc41x3.twin.expressions import QUERY, Rejection, axis_place, by_axis, split
from dmc41x3.twin.motion.gearing import ENTRIES, Cam, Master
from dmc41x3.twin.registers import POSITION

_MASTER = re.compile(r"([CDS]?)([A-HMNSTXYZW])")
_INDEXED = re.compile(r"\s*\[(.*?)\]\s*=(.*)")

LONGEST_INTERVAL = 32767
"""Largest distance between two table entries [counts of the master]."""

MOST_CYCLES = 2147483647


def _master(context: CallerContext, text: str) -> Master:
    """Return the master that a name denotes: `A`, `CA` (commanded), `DA` (auxiliary), `S`, `N`."""
    form = _MASTER.fullmatch(text)
    if form is None or form[1] == "S":
        raise Rejection(ErrorCode.OPERAND_ERROR)
    letter = form[2].translate(ALIASES)
    if letter in LETTERS:
        axis_place(letter, context.unit.letters)
    elif form[1]:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    return Master(letter, form[1] == "C", form[1] == "D")


def _gear(context: CallerContext, text: str) -> Answer:
    """GA: the master of each slave; `?` returns its number as in axis variables, -1 for none."""
    changes = [(context.unit.axes[index], argument) for index, argument in by_axis(text, context.unit.letters)]
    gearing = context.unit.gearing
    asked = [float(gearing.number_of_master(axis)) for axis, argument in changes if argument == QUERY]
    masters = [(axis, _master(context, argument)) for axis, argument in changes if argument != QUERY]
    for axis, master in masters:
        gearing.connect(axis, master)
    return context.unit.position_text(asked) if asked else None


def _cam_master(context: CallerContext, text: str) -> Answer:
    """EA: the master of the cam, an axis or a virtual axis."""
    master = _master(context, text.strip())
    if master.axis(context.core) is None:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    context.unit.cam.choose(master)
    return None


def _enable(context: CallerContext, text: str) -> Answer:
    if text.strip() == QUERY:
        return context.unit.position_text([context.unit.cam.enabled])
    context.unit.cam.enable(context.integer(text, 0, 1) == 1)
    return None


def _index(context: CallerContext, text: str) -> Answer:
    """EC: the table entry that the next ET without an index sets."""
    cam = context.unit.cam
    if text.strip() == QUERY:
        return context.unit.position_text([cam.index])
    cam.index = context.integer(text, 0, ENTRIES - 1)
    return None


def _cycles(context: CallerContext, text: str) -> Answer:
    cam = context.unit.cam
    if text.strip() == QUERY:
        return context.unit.position_text([cam.cycles])
    cam.cycles = context.integer(text, -MOST_CYCLES, MOST_CYCLES)
    return None


def _interval(context: CallerContext, text: str) -> Answer:
    """EP: the distance between two table entries, and the shift of the table along the master."""
    cam, arguments = context.unit.cam, split(text)
    if len(arguments) > 2:
        raise Rejection(ErrorCode.OPERAND_ERROR)
    present = [cam.interval, cam.shift]
    asked = [float(value) for value, argument in zip(present, arguments, strict=False) if argument == QUERY]
    if asked:
        return context.unit.position_text(asked)
    if cam.enabled:
        raise Rejection(ErrorCode.CAM_RUNS)
    interval = context.integer(arguments[0], 1, LONGEST_INTERVAL) if arguments[0] else cam.interval
    if len(arguments) == 2 and arguments[1]:
        cam.shift = context.integer(arguments[1], -MOST_CYCLES, MOST_CYCLES)
    cam.interval = interval
    return None


def _widen(context: CallerContext, text: str) -> Answer:
    """EW: up to two segments of the table with their own widths; -1 for none."""
    cam, arguments = context.unit.cam, split(text.replace("=", ","))
    widened = [number for pair in cam.widened.items() for number in pair]
    present = [*widened, *(-1, 0, -1, 0)[len(widened) :]]
    if len(arguments) > len(present):
        raise Rejection(ErrorCode.OPERAND_ERROR)
    if QUERY in arguments:
        return context.unit.position_text(
            [value for value, argument in zip(present, arguments, strict=False) if argument == QUERY]
        )
    if cam.enabled:
        raise Rejection(ErrorCode.CAM_RUNS)
    for place_of, argument in enumerate(arguments):
        if argument:
            most = LONGEST_INTERVAL if place_of % 2 else ENTRIES - 2
            present[place_of] = context.integer(argument, -1 if place_of % 2 == 0 else 0, most)
    pairs = zip(present[::2], present[1::2], strict=True)
    cam.widened = {segment: width for segment, width in pairs if segment >= 0 and width > 0}
    return None


def _entry(context: CallerContext, text: str) -> Answer:
    """ET: the entries at one index of the table, `[n]` or that of EC, which is then incremented."""
    cam = context.unit.cam
    form = _INDEXED.fullmatch(text)
    if form is None:
        index, values = cam.index, text
    else:
        index, values = int(context.number(form[1])), form[2]
    if not 0 <= index < ENTRIES:
        raise Rejection(ErrorCode.CAM_INDEX)
    entries = by_axis(values, context.unit.letters)
    axes = context.unit.axes
    asked = [cam.entry(axes[axis], index) for axis, argument in entries if argument == QUERY]
    if asked:
        return context.unit.position_text(asked)
    numbers = [(axis, POSITION.rounded(context.number(argument))) for axis, argument in entries]
    for axis, number in numbers:
        cam.set_entry(axes[axis], index, number)
    if form is None:
        cam.index = min(index + 1, ENTRIES - 1)
    return None


def _couple(engage: bool, context: CallerContext, text: str) -> Answer:
    """EG, EQ: engage or disengage axes at positions of the master's cycle."""
    cam: Cam = context.unit.cam
    asked: list[float] = []
    changes = []
    for axis, argument in addressed(context, text):
        if axis.virtual:
            raise Rejection(ErrorCode.INVALID_AXIS)
        if argument == QUERY:
            asked.append(cam.engaged(axis) if engage else cam.waiting(axis))
            continue
        changes.append((axis, POSITION.rounded(context.number(argument))))
    for axis, at in changes:
        if cam.master.letter == axis.letter:
            raise Rejection(ErrorCode.GEAR_MASTER_IS_SLAVE)
        (cam.engage if engage else cam.disengage)(axis, at)
    return context.unit.position_text(asked) if asked else None


TABLE: dict[str, Handler] = {
    "GA": _gear,
    "EA": _cam_master,
    "EB": _enable,
    "EC": _index,
    "EY": _cycles,
    "EP": _interval,
    "EW": _widen,
    "ET": _entry,
    "EG": partial(_couple, True),
    "EQ": partial(_couple, False),
}
