"""The one place that converts between SI and encoder counts."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from maya_un.config.model import Config
from maya_un.values import Joints


@dataclass(frozen=True, slots=True)
class Units:
    """Scale between joints (rad, m, m) and counts; zero counts is zero angle or zero length.

    `per_unit` holds counts per rad, per m, per m.
    """

    per_unit: tuple[float, float, float]

    @classmethod
    def of(cls, config: Config) -> Units:
        """Return the converter for a configuration."""
        line = config.scale.pulses_per_metre
        return cls((config.scale.pulses_per_degree * 180.0 / pi, line, line))

    def to_counts(self, joints: Joints) -> tuple[int, int, int]:
        """Return the nearest whole counts for joints (rad, m, m)."""
        a, b, c = self.per_unit
        return round(joints.a * a), round(joints.b * b), round(joints.c * c)

    def to_joints(self, counts: tuple[float, float, float]) -> Joints:
        """Return joints (rad, m, m) for counts."""
        a, b, c = self.per_unit
        return Joints(counts[0] / a, counts[1] / b, counts[2] / c)
