"""Residuals of measured points, before and after a calibration."""

from __future__ import annotations

from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from maya_un.kinematics.calibration import Calibration
from maya_un.plots.style import BLUE, GREY, INK, ORANGE, PAGE_WIDTH, blank, figure_style, quiet_grid

_HEIGHT = 5.6
_SHARE = 0.15
"""The longest arrow in the plan has this share of the extent of the points."""


def residuals_figure(result: Calibration) -> Figure:
    """Return the residuals of a calibration: x, y, z by point before and after [mm], and after it in the plan.

    A residual is model less measured. Outliers are crosses: by point they are clipped to the edge of the axes; in the
    plan they have no arrow if it is longer than those of all inliers. Arrows are enlarged; a key shows the scale.
    """
    with figure_style():
        figure = blank(PAGE_WIDTH, _HEIGHT)
        left, right = cast("list[SubFigure]", figure.subfigures(1, 2))
        rows = left.subplots(3, 1, sharex=True)
        for axis, axes in enumerate(rows):
            _by_point(axes, result, axis)
        rows[-1].set_xlabel("point")
        rows[0].set_title("Residuals by point")
        rows[0].legend(loc="upper right", ncols=3)
        _plan(right.subplots(), result)
    return figure


def _by_point(axes: Axes, result: Calibration, axis: int) -> None:
    number = np.arange(1, len(result.observations) + 1)
    before, after = result.residuals_before[:, axis] * 1e3, result.residuals_after[:, axis] * 1e3
    out = ~result.inliers
    quiet_grid(axes)
    axes.axhline(0.0, color=INK, lw=0.6)
    axes.plot(number, before, "o", ms=3.5, mfc="none", color=GREY, label="before")
    axes.plot(number, after, "o", ms=3.5, color=BLUE, label="after")
    shown = np.concatenate([before[result.inliers], after[result.inliers]])
    reach = 1.3 * float(np.max(np.abs(shown), initial=1e-3))
    if out.any():
        within = np.clip(after[out], -0.93 * reach, 0.93 * reach)
        axes.plot(number[out], within, "x", ms=8.0, mew=1.6, color=ORANGE, label="outlier")
    axes.set_ylabel(f"{'xyz'[axis]} [mm]")
    axes.set(xlim=(0.5, len(number) + 0.5), ylim=(-reach, reach))


def _plan(axes: Axes, result: Calibration) -> None:
    points, missed, out = result.observations.points, result.residuals_after, ~result.inliers
    quiet_grid(axes)
    longest = float(np.max(np.hypot(*missed[result.inliers, :2].T), initial=1e-6))
    span = float(np.max(np.ptp(points[:, :2], axis=0), initial=0.1))
    larger = _SHARE * span / longest
    drawn = result.inliers | (np.hypot(*missed[:, :2].T) <= longest)
    axes.plot(points[:, 0], points[:, 1], ".", ms=3.0, color=GREY)
    arrows = axes.quiver(
        *points[drawn, :2].T,
        *(missed[drawn, :2].T * larger),
        color=BLUE,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.004,
    )
    axes.quiverkey(arrows, 0.6, -0.14, larger * longest, f"{longest * 1e3:.2g} mm", labelpos="E", coordinates="axes")
    if out.any():
        axes.plot(points[out, 0], points[out, 1], "x", ms=8.0, mew=1.6, color=ORANGE)
    room = 1.2 * _SHARE * span
    low, high = points[:, :2].min(axis=0) - room, points[:, :2].max(axis=0) + room
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
    axes.set_title("After, from above")
