"""Quantities that people write: a plain number is SI, and a text may have a unit (30 deg, 120 mm).

A plain number that no robot reaches in m or rad, and that would be usual in mm or degrees, is refused: it was probably
written without its unit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import inf, isfinite, pi
from reprlib import repr
from typing import NamedTuple

from dmc41x3.i18n import Phrase, phrase
from maya_un.errors import InvalidValue
from maya_un.values import FARTHEST, WITHIN, Joints, Point

_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-zµ°%]*)")
_COMMA = re.compile(r"(?<=\d),(?=\d)")


class QuantityKind(NamedTuple):
    """A kind of quantity: its factors to SI by unit, and the sentence that refuses a text.

    A plain number above `most` is refused in favour of the unit `usual`, and so is a step of a jog above `most_step`.
    """

    units: Mapping[str, float]
    rule: str
    most: float = inf
    most_step: float = inf
    si: str = ""
    usual: str = ""


LENGTH = QuantityKind(
    {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    phrase("a length is a number in m, or with m, cm, mm or um behind it"),
    most=10.0,
    most_step=0.1,
    si="m",
    usual="mm",
)
ANGLE = QuantityKind(
    {"": 1.0, "rad": 1.0, "mrad": 1e-3, "deg": pi / 180.0, "°": pi / 180.0},
    phrase("an angle is a number in rad, or with rad, mrad or deg behind it"),
    most=10.0,
    most_step=0.2,
    si="rad",
    usual="deg",
)
DURATION = QuantityKind(
    {"": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0},
    phrase("a duration is a number in s, or with s, min, h or d behind it"),
)
SHARE = QuantityKind({"": 1.0, "%": 0.01}, phrase("a share is a number, or with % behind it"), most=1.0, usual="%")

UNITS = (LENGTH.units.keys() | ANGLE.units.keys() | SHARE.units.keys()) - {""}
"""Units of lengths, angles and shares."""


def length(text: str, key: str) -> float:
    """Return a text as a length [m]; raises `InvalidValue` naming `key`."""
    return _coordinate(text, key, LENGTH)


def angle(text: str, key: str) -> float:
    """Return a text as an angle [rad]; raises `InvalidValue` naming `key`."""
    return _coordinate(text, key, ANGLE)


def length_in(data: object, key: str) -> float:
    """Return a number [m], or a text with a unit, as a length [m]; raises `InvalidValue` naming `key`."""
    return _in_data(data, key, LENGTH)


def angle_in(data: object, key: str) -> float:
    """Return a number [rad], or a text with a unit, as an angle [rad]; raises `InvalidValue` naming `key`."""
    return _in_data(data, key, ANGLE)


def duration_in(data: object, key: str) -> float:
    """Return a number [s], or a text with a unit, as a duration [s]; raises `InvalidValue` naming `key`."""
    return _plain_or_text(data, key, DURATION)


def share_in(data: object, key: str) -> float:
    """Return a number (1 for 100 %), or a text with %, as a ratio; raises `InvalidValue` naming `key`."""
    return _plain_or_text(data, key, SHARE)


def _plain_or_text(data: object, key: str, kind: QuantityKind) -> float:
    if isinstance(data, str) and not _is_bare(data):
        return quantity(data, key, kind)
    if isinstance(data, bool) or not isinstance(data, int | float):
        raise InvalidValue(key=key, value=repr(data), reason=kind.rule)
    try:
        number = float(data)
    except OverflowError:
        number = inf
    if not isfinite(number):
        raise InvalidValue(key=key, value=repr(data), reason="it is not finite")
    _require_plausible(number, key, f"{number:g}", kind)
    return number


def has_units(data: object) -> bool:
    """Return whether plain data hold a text that is a number with a unit."""
    if isinstance(data, Mapping):
        return any(map(has_units, data.values()))
    if isinstance(data, list | tuple):
        return any(map(has_units, data))
    return isinstance(data, str) and not _is_bare(data) and _NUMBER.fullmatch(data.strip()) is not None


def step(text: str, key: str, kind: QuantityKind) -> float:
    """Return the distance of a jog in SI; raises `InvalidValue` naming `key`, also for a long one without a unit."""
    value = _coordinate(text, key, kind)
    if abs(value) > kind.most_step and _is_bare(text):
        raise InvalidValue(
            key=key,
            value=text,
            reason=phrase(
                "a step of more than {most:g} {si} needs its unit: write {text} {si} or {text} {usual}",
                most=kind.most_step,
                text=text.strip(),
                si=kind.si,
                usual=kind.usual,
            ),
        )
    return value


def point_of(x: str, y: str, z: str) -> Point:
    """Return a point [m]; raises `InvalidValue` naming the coordinate."""
    return Point(length(x, "x"), length(y, "y"), length(z, "z"))


def joints_of(a: str, b: str, c: str) -> Joints:
    """Return joints (rad, m, m); raises `InvalidValue` naming the joint."""
    return Joints(angle(a, "a"), length(b, "b"), length(c, "c"))


def share(text: str, key: str) -> float:
    """Return a ratio, 1 for 100 %; raises `InvalidValue` naming `key`."""
    return quantity(text, key, SHARE)


def duration(text: str, key: str) -> float:
    """Return a duration [s]; raises `InvalidValue` naming `key`."""
    return quantity(text, key, DURATION)


def quantity(text: str, key: str, kind: QuantityKind) -> float:
    """Return a text as a quantity of a kind, in SI; raises `InvalidValue` naming `key`."""
    found = _NUMBER.fullmatch(text.strip())
    if found is None or found[2] not in kind.units:
        raise InvalidValue(key=key, value=repr(text), reason=_with_point(text, kind) or kind.rule)
    value = float(found[1]) * kind.units[found[2]]
    if not isfinite(value):
        raise InvalidValue(key=key, value=repr(text), reason="it is not finite")
    if not found[2]:
        _require_plausible(value, key, found[1], kind)
    return value


def _coordinate(text: str, key: str, kind: QuantityKind) -> float:
    return _within(quantity(text, key, kind), text, key)


def _in_data(data: object, key: str, kind: QuantityKind) -> float:
    if isinstance(data, str) and not _is_bare(data):
        return _coordinate(data, key, kind)
    if isinstance(data, bool) or not isinstance(data, int | float):
        raise InvalidValue(
            key=key,
            value=repr(data),
            reason=phrase("it must be a number of {si}, or a text like 30 {usual}", si=kind.si, usual=kind.usual),
        )
    try:
        number = float(data)
    except OverflowError:
        number = inf
    _require_plausible(number, key, f"{number:g}", kind)
    return _within(number, data, key)


def join_units(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with each unit joined to its number: `90 deg` becomes `90deg`."""
    joined: list[str] = []
    for word in words:
        if joined and word in UNITS and _is_bare(joined[-1]):
            joined[-1] += word
        else:
            joined.append(word)
    return joined


def _with_point(text: str, kind: QuantityKind) -> Phrase | None:
    """Return the right form of a text with a decimal comma, None for another text."""
    right, commas = _COMMA.subn(".", text.strip())
    found = _NUMBER.fullmatch(right)
    if commas != 1 or found is None or found[2] not in kind.units:
        return None
    return phrase("a decimal number has a point: write {text}", text=right)


def _is_bare(text: str) -> bool:
    found = _NUMBER.fullmatch(text.strip())
    return found is not None and not found[2]


def _within(number: float, value: object, key: str) -> float:
    if not abs(number) <= FARTHEST:
        raise InvalidValue(key=key, value=repr(value), reason=WITHIN)
    return number


def _require_plausible(value: float, key: str, text: str, kind: QuantityKind) -> None:
    """Refuse a plain number that was probably meant in the usual unit; one beyond all bounds has its own reason."""
    if kind.most < abs(value) <= FARTHEST:
        if kind is SHARE:
            reason = phrase("it is more than 100 %; for percent write {text}%", text=text)
            raise InvalidValue(key=key, value=text, reason=reason)
        raise InvalidValue(
            key=key,
            value=text,
            reason=phrase(
                "no robot reaches {text} {si}; for {usual} write {text} {usual}",
                text=text,
                si=kind.si,
                usual=kind.usual,
            ),
        )
