"""Which key moves what, and how far."""

from __future__ import annotations

from math import radians
from typing import NamedTuple

AXES = "xyzrabc"
"""What moves: the gripper along x, y, z and away from the boom's axis (r), or one of the axes a, b, c."""


class KeyStep(NamedTuple):
    """How far one press of a key goes: `length` [m], of the boom `angle` [rad]."""

    length: float
    angle: float

    def of(self, axis: str) -> float:
        """Return the distance along an axis (rad or m)."""
        return self.angle if axis == "a" else self.length


STEPS = {
    "1": KeyStep(0.001, radians(0.1)),
    "2": KeyStep(0.010, radians(1.0)),
    "3": KeyStep(0.050, radians(5.0)),
}
"""The steps, by the key that chooses each."""

_ARROWS = {
    "right": ("x", 1),
    "left": ("x", -1),
    "up": ("y", 1),
    "down": ("y", -1),
    "pageup": ("z", 1),
    "pagedown": ("z", -1),
}

MOVES: dict[str, tuple[str, int]] = {
    **{axis: (axis, 1) for axis in AXES},
    **{axis.upper(): (axis, -1) for axis in AXES},
    **_ARROWS,
}
"""Axis and direction by the name of the key: a letter goes forth, its capital back."""
