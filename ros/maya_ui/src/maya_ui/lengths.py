"""Lengths as people write them: millimetres where nothing is said, a comma or a point, a unit if they like."""

from __future__ import annotations

import re
from math import isfinite

FARTHEST = 5.0
"""No place of the robot is farther than this from its axis or its table [m]."""

_METRES = {"": 1e-3, "mm": 1e-3, "cm": 1e-2, "m": 1.0}

_WRITTEN = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+))\s*(mm|cm|m|)", re.IGNORECASE)


class NotALength(ValueError):
    """What was written is no length; `key` is the word that says why."""

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self.key = key


def parsed(text: str) -> float:
    """Return a length [m] that was written, such as "410", "41,5 cm" or "0.41 m"; raises `NotALength`."""
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
    """Return a length [m] in millimetres, with a tenth, and without a sign where it is nothing."""
    return f"{length * 1e3:.1f}".replace("-0.0", "0.0") if abs(length) < 5e-5 else f"{length * 1e3:.1f}"


def metres(length: float) -> str:
    """Return a length [m] with its unit, to a tenth of a millimetre."""
    return f"{length:.4f} m"
