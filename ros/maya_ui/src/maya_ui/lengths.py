"""Lengths as people write them: a comma or a point, with a unit or without one for millimetres."""

from __future__ import annotations

import re
from math import isfinite

FARTHEST = 5.0
"""Largest distance of a position of the robot from its axis or its table [m]."""

_METRES = {"": 1e-3, "mm": 1e-3, "cm": 1e-2, "m": 1.0}

_WRITTEN = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+))\s*(mm|cm|m|)", re.IGNORECASE)


class NotALength(ValueError):
    """A text that is no length; `key` is the word for the reason."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.key = key


def parsed(text: str) -> float:
    """Return the length [m] in a text such as "410", "41,5 cm" or "0.41 m"; raises `NotALength`."""
    if not text.strip():
        raise NotALength("length_missing")
    found = _WRITTEN.fullmatch(text.strip())
    if found is None:
        raise NotALength("length_unreadable")
    length = round(float(found.group(1).replace(",", ".")) * _METRES[found.group(2).lower()], 9)
    if not isfinite(length) or abs(length) > FARTHEST:
        raise NotALength("length_too_long")
    return length


def millimetres(length: float) -> str:
    """Return a length [m] in millimetres, to a tenth, without a sign if it is zero."""
    return f"{length * 1e3:.1f}".replace("-0.0", "0.0") if abs(length) < 5e-5 else f"{length * 1e3:.1f}"


def metres(length: float) -> str:
    """Return a length [m] with its unit, to a tenth of a millimetre."""
    return f"{length:.4f} m"
