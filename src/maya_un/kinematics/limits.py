"""The limits of the workspace by name, the distances to them, and the texts for broken ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import NamedTuple

from dmc41x3.i18n import PHRASE, marked, phrase
from maya_un.values import WITHIN, Joints, Limit, MarginUnit

Stroke = tuple[float, float]
"""Short and long end of an axis (rad or m)."""


class Margins(NamedTuple):
    """Distance to every limit, negative beyond it: `boom` in rad, tensions in loads, all others in m.

    `zones` has the name and the clearance of every zone.
    """

    coupling: float
    boom: float
    inner: float
    outer: float
    floor: float
    line_b: float
    line_c: float
    tension_b: float
    tension_c: float
    zones: tuple[tuple[str, float], ...] = ()

    @property
    def limits(self) -> dict[Limit, float]:
        """The distances to all limits except zones, in their order."""
        return {limit: getattr(self, limit) for limit in MEASURED}


MEASURED: tuple[Limit, ...] = tuple(Limit(name) for name in Margins._fields if name != "zones")
"""The limits to which `Margins` has a distance, without zones."""


NAMES: dict[str, str] = {
    Limit.COUPLING: marked("lines b and c meet"),
    Limit.BOOM: marked("range of the boom"),
    Limit.INNER: marked("inner anchor"),
    Limit.OUTER: marked("outer anchor"),
    Limit.FLOOR: marked("table top"),
    Limit.LINE_B: marked("ends of line b"),
    Limit.LINE_C: marked("ends of line c"),
    Limit.TENSION_B: marked("tension of line b"),
    Limit.TENSION_C: marked("tension of line c"),
    Limit.ZONE: marked("zone {zone}"),
    "boom_start": marked("start of the boom's range"),
    "boom_end": marked("end of the boom's range"),
    "line_b_short": marked("shortest length of line b"),
    "line_b_long": marked("greatest length of line b"),
    "line_c_short": marked("shortest length of line c"),
    "line_c_long": marked("greatest length of line c"),
}
"""The limits to which messages give a distance, as people read them: `MEASURED`, zones, and both ends of each axis."""


def unit(limit: Limit) -> MarginUnit:
    """Return the unit of the distance to a limit."""
    match limit:
        case Limit.BOOM:
            return "rad"
        case Limit.TENSION_B | Limit.TENSION_C:
            return "load"
        case _:
            return "m"


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a place is not reachable: which limit, by how much (in its `unit`), in words.

    For a zone, `zone` is its name, and `excess` the missing part of its margin, or the depth inside.
    """

    limit: Limit
    excess: float
    unit: MarginUnit
    text: str
    zone: str = ""

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result for one set of joints: the distance to every limit, and the reason if one is broken."""

    margins: Margins
    reason: Reason | None

    @property
    def reachable(self) -> bool:
        """Whether all limits are kept."""
        return self.reason is None


@dataclass(frozen=True, slots=True)
class ReasonBounds:
    """Data for the text of a reason: strokes of the axes (rad, m, m), tension limit in loads."""

    boom: Stroke
    line_b: Stroke
    line_c: Stroke
    tension_limit: float

    def reason(self, limit: Limit, excess: float, joints: Joints) -> Reason:
        """Return the reason for a limit that `joints` break by `excess`."""
        return Reason(limit, excess, unit(limit), self._words(limit, excess, joints))

    def _words(self, limit: Limit, excess: float, joints: Joints) -> str:
        match limit:
            case Limit.BOOM:
                return _boom_words(excess, joints.a, self.boom)
            case Limit.LINE_B:
                return _line_words("b", excess, joints.b, self.line_b)
            case Limit.LINE_C:
                return _line_words("c", excess, joints.c, self.line_c)
            case Limit.TENSION_B | Limit.TENSION_C:
                pull = self.tension_limit + excess
                return phrase(
                    "line {line} would carry {pull} times the load; the limit is {limit:g} times the load",
                    line=limit[-1],
                    pull=_digits(pull),
                    limit=self.tension_limit,
                )
            case _:
                return _WORDS[limit].format(length=length_text(excess))


def no_number() -> Reason:
    """Return the reason for coordinates that are not finite, or out of range."""
    return Reason(Limit.NUMBER, 0.0, "m", phrase("it is not a place: for every coordinate, {within}", within=WITHIN))


def above_anchors(height: float) -> Reason:
    """Return the reason for a place whose lines would have to meet `height` [m] above the anchors."""
    return Reason(Limit.ANCHORS, height, "m", _WORDS[Limit.ANCHORS].format(length=length_text(height)))


def in_zone(name: str, margin: float, clearance: float) -> Reason:
    """Return the reason for a place whose `clearance` of a zone with this `margin` [m] is negative."""
    distance = margin + clearance
    if distance >= 0.0:
        text = phrase(
            "the gripper or a line would be {distance} from zone {name}, whose margin is {margin}",
            distance=length_text(distance),
            name=name,
            margin=length_text(margin),
        )
    else:
        text = phrase(
            "the gripper or a line would be {distance} inside zone {name}", distance=length_text(-distance), name=name
        )
    return Reason(Limit.ZONE, -clearance, "m", text, name)


_WORDS = {
    Limit.COUPLING: marked("lines b and c together are {length} too short to meet", PHRASE),
    Limit.ANCHORS: marked("its lines would have to meet {length} above their anchors", PHRASE),
    Limit.INNER: marked(
        "it lies {length} nearer to the boom's axis than the inner anchor, so line c would be slack", PHRASE
    ),
    Limit.OUTER: marked(
        "it lies {length} farther from the boom's axis than the outer anchor, so line b would be slack", PHRASE
    ),
    Limit.FLOOR: marked("it lies {length} below the table top", PHRASE),
}


def _boom_words(excess: float, angle: float, stroke: Stroke) -> str:
    turned, beyond = f"{degrees(angle):z.1f}°", f"{_digits(degrees(excess))}°"
    if angle < stroke[0]:
        return phrase("the boom would have to turn to {angle}, {excess} below its minimum", angle=turned, excess=beyond)
    return phrase("the boom would have to turn to {angle}, {excess} above its maximum", angle=turned, excess=beyond)


def _line_words(line: str, excess: float, length: float, stroke: Stroke) -> str:
    own, beyond = length_text(length), length_text(excess)
    if length < stroke[0]:
        return phrase(
            "line {line} would have to be {length} long, {excess} shorter than its minimum",
            line=line,
            length=own,
            excess=beyond,
        )
    return phrase(
        "line {line} would have to be {length} long, {excess} longer than its maximum",
        line=line,
        length=own,
        excess=beyond,
    )


def length_text(length: float) -> str:
    """Return a length [m] with four digits: in m from 1 m upward, otherwise in mm."""
    return f"{_digits(length)} m" if length >= 1.0 else f"{_digits(length * 1e3)} mm"


def _digits(value: float) -> str:
    """Return a positive number with four digits and no exponent."""
    text = f"{value:.4g}"
    return f"{value:.0f}" if "e+" in text else f"{value:.6f}" if "e-" in text else text
