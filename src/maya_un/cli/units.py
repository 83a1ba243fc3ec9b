"""The units of lengths and angles in the output: millimetres and degrees, or with `--units si` metres and radians.

JSON is always in SI.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import NamedTuple

from maya_un.axes import AXES
from maya_un.cli.settings import OutputSettings


class OutputUnits(NamedTuple):
    """A unit system: the units with the blank before them, their factors from SI, and the usual numbers of digits."""

    length_unit: str
    per_metre: float
    length_digits: int
    angle_unit: str
    per_radian: float
    angle_digits: int

    def length(self, metres: float, finer: int = 0) -> str:
        """Return a length [m] as text with its unit, with `finer` more digits."""
        return f"{self.bare_length(metres, finer)}{self.length_unit}"

    def bare_length(self, metres: float, finer: int = 0) -> str:
        """Return a length [m] as text without its unit, for a table that names the unit in its head."""
        return f"{metres * self.per_metre:z.{self.length_digits + finer}f}"

    def angle(self, radians: float, finer: int = 0) -> str:
        """Return an angle [rad] as text with its unit, with `finer` more digits."""
        return f"{radians * self.per_radian:z.{self.angle_digits + finer}f}{self.angle_unit}"

    def joint(self, axis: str, value: float, finer: int = 0) -> str:
        """Return the position of an axis, or its way (rad or m), as text with its unit."""
        return self.angle(value, finer) if axis == AXES[0] else self.length(value, finer)

    def joints(self, joints: Sequence[float], finer: int = 0) -> str:
        """Return joints (rad, m, m) as text with their names and units."""
        named = zip(AXES, joints, strict=True)
        return "  ".join(f"{axis} {self.joint(axis, value, finer)}" for axis, value in named)

    def point(self, point: Sequence[float], finer: int = 0) -> str:
        """Return a point [m] as text with names and units."""
        return "  ".join(f"{name} {self.length(value, finer)}" for name, value in zip("xyz", point, strict=True))

    def place(self, point: Sequence[float] | None, finer: int = 0) -> str:
        """Return a point [m] as text without names and units, for a table; a dash for none."""
        return "–" if point is None else " ".join(self.bare_length(value, finer) for value in point)

    @property
    def of_length(self) -> str:
        """The unit of lengths, for the head of a table."""
        return self.length_unit.strip()


MILLIMETRES = OutputUnits(" mm", 1e3, 1, "°", degrees(1.0), 2)
SI = OutputUnits(" m", 1.0, 4, " rad", 1.0, 4)


def units_of(settings: OutputSettings) -> OutputUnits:
    """Return the units that the command line, or $MAYA_UNITS, asks for."""
    return SI if settings.units == "si" else MILLIMETRES
