"""All limits of the workspace except zones, for single joints; it needs no arrays, so it is quick to import."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING

from maya_un import manual
from maya_un.kinematics.closed import ClosedForm, tension
from maya_un.kinematics.limits import Margins
from maya_un.values import Joints

if TYPE_CHECKING:
    from maya_un.config import Config
    from maya_un.kinematics.limits import Stroke

TOLERANCE = 1e-9
"""Limits hold to this much (m, rad, and as a share of the tension limit): rounding of double precision."""


@dataclass(frozen=True, slots=True)
class Ranges:
    """Allowed joints of one machine, without zones: see `workspace.Workspace`."""

    mechanism: ClosedForm
    boom: Stroke
    line_b: Stroke
    line_c: Stroke
    tension_limit: float

    @classmethod
    def configured(cls, config: Config) -> Ranges:
        """Return the ranges of a configuration, without its zones."""
        a, b, c = ((axis.minimum, axis.maximum) for axis in (config.axes.a, config.axes.b, config.axes.c))
        return Ranges(ClosedForm.of(config), a, b, c, config.safety.tension_limit)

    @classmethod
    def of_the_manual(cls) -> Ranges:
        """Return the ranges of the manual's machine."""
        lengths = (manual.HEIGHT, manual.LENGTH, manual.DELTA, manual.GRIPPER_HEIGHT)
        mechanism = ClosedForm.measured(lengths, manual.STROKES[0])
        return Ranges(mechanism, *manual.STROKES, manual.TENSION_LIMIT)

    def within(self, joints: Joints) -> bool:
        """Return whether the joints keep every limit (to `TOLERANCE`); False for numbers that are not finite."""
        a, b, c = joints
        if not (
            self.boom[0] - TOLERANCE <= a <= self.boom[1] + TOLERANCE
            and self.line_b[0] - TOLERANCE <= b <= self.line_b[1] + TOLERANCE
            and self.line_c[0] - TOLERANCE <= c <= self.line_c[1] + TOLERANCE
        ):
            return False
        mechanism = self.mechanism
        W = mechanism.width
        u = 0.5 * W + (b - c) * (b + c) / (2.0 * W)
        square = (b - u) * (b + u)
        if not (-TOLERANCE <= u <= W + TOLERANCE and square > 0.0):
            return False
        deepest = mechanism.height - mechanism.drop + TOLERANCE
        pull = self.tension_limit * (1.0 + TOLERANCE) * W * sqrt(square)
        return square <= deepest * deepest and (W - u) * b <= pull and u * c <= pull

    def margins(self, joints: Joints) -> Margins:
        """Return the distance to every limit except zones (see `Margins`)."""
        a, b, c = joints
        W = self.mechanism.width
        u, square = self.mechanism.section(joints)
        h = sqrt(square) if square > 0.0 else 0.0
        pull_b, pull_c = tension(u, h, W)
        return Margins(
            coupling=b + c - W,
            boom=_inside(a, self.boom),
            inner=u,
            outer=W - u,
            floor=self.mechanism.reach_down - h,
            line_b=_inside(b, self.line_b),
            line_c=_inside(c, self.line_c),
            tension_b=self.tension_limit - pull_b,
            tension_c=self.tension_limit - pull_c,
        )


def _inside(value: float, stroke: Stroke) -> float:
    return min(value - stroke[0], stroke[1] - value)
