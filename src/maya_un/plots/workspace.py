"""Figures of the workspace: from the side, from above, in space, or all three."""

from __future__ import annotations

from enum import StrEnum

import numpy as np
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d import Axes3D

from maya_un.kinematics import Workspace
from maya_un.kinematics.outline import outline
from maya_un.plots.overlays import MarkedTarget, draw_in_space, zone_key
from maya_un.plots.plan import draw_plan
from maya_un.plots.section import draw_section
from maya_un.plots.style import GREY, INK, LINE_B, LINE_C, blank, figure_style
from maya_un.values import Point

_SKIN = "#8DB8DC"
_TURNS = 25


def draw_surface(axes: Axes3D, workspace: Workspace, bearing: float, marked: MarkedTarget | None = None) -> None:
    """Draw the boundary of the workspace and the zones, with the boom at the angle `bearing` [rad]."""
    mechanism = workspace.mechanism
    d, z = outline(workspace)
    turned = np.linspace(*workspace.boom, _TURNS)
    axes.plot_surface(
        np.outer(d, np.sin(turned)),
        np.outer(d, np.cos(turned)),
        np.outer(z, np.ones(_TURNS)),
        rstride=1,
        cstride=1,
        color=_SKIN,
        alpha=0.35,
        linewidth=0,
    )
    for angle in workspace.boom:
        x, y = d * np.sin(angle), d * np.cos(angle)
        axes.plot(x, y, z, color=INK, linewidth=1.1)
    _machine(axes, workspace, bearing, marked)
    x, y = mechanism.length * np.sin(turned), mechanism.length * np.cos(turned)
    low = Point(min(0.0, float(x.min())), min(0.0, float(y.min())), 0.0)
    high = Point(max(0.0, float(x.max())), max(0.0, float(y.max())), mechanism.height)
    draw_in_space(axes, workspace.zones, (low, high))
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_title("In space", loc="left")
    axes.set(xlim=(low.x, high.x), ylim=(low.y, high.y), zlim=(low.z, high.z))
    axes.set_box_aspect((high.x - low.x, high.y - low.y, high.z - low.z))
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MultipleLocator(0.5))
    axes.view_init(elev=22.0, azim=-52.0)


def _machine(axes: Axes3D, workspace: Workspace, bearing: float, marked: MarkedTarget | None) -> None:
    """Draw column, boom and anchors, and the lines down to the held place."""
    mechanism = workspace.mechanism
    s, k, high = np.sin(bearing), np.cos(bearing), mechanism.height
    axes.plot((0.0, 0.0), (0.0, 0.0), (0.0, high), color=GREY, linewidth=2.5)
    axes.plot((0.0, mechanism.length * s), (0.0, mechanism.length * k), (high, high), color=GREY, linewidth=2.5)
    for radius, colour in ((mechanism.delta, LINE_B), (mechanism.length, LINE_C)):
        axes.plot(radius * s, radius * k, high, marker="o", markersize=4.5, color=colour)
        if marked is not None:
            x, y, z = marked.held
            axes.plot((radius * s, x), (radius * k, y), (high, z + mechanism.drop), color=colour, linewidth=1.4)
    if marked is not None:
        x, y, z = marked.held
        axes.plot((x, x), (y, y), (z + mechanism.drop, z), color=INK, linewidth=1.8)
        marked.show(axes, marked.target, marked.held)


class WorkspaceView(StrEnum):
    """The view of the workspace in a figure."""

    SECTION = "section"
    PLAN = "plan"
    SPACE = "3d"
    ALL = "all"


def workspace_figure(
    workspace: Workspace, height: float, view: WorkspaceView = WorkspaceView.ALL, target: Point | None = None
) -> Figure:
    """Return a figure of the workspace.

    `height` [m] is the height of the plan's cut. A `target` [m] is marked together with the reachable place nearest to
    it, and the boom points there; without one it points to the middle of its range.
    """
    marked = None if target is None else MarkedTarget.of(workspace, target)
    bearing = 0.5 * sum(workspace.boom) if marked is None else workspace.mechanism.ik(marked.held).a
    with figure_style():
        match view:
            case WorkspaceView.SECTION:
                figure = blank(7.2, 6.8)
                draw_section(figure.add_subplot(), workspace, bearing, marked)
            case WorkspaceView.PLAN:
                figure = blank(5.4, 7.0)
                draw_plan(figure.add_subplot(), workspace, height, bearing, marked)
            case WorkspaceView.SPACE:
                figure = blank(7.2, 6.4)
                draw_surface(_in_space(figure), workspace, bearing, marked)
            case WorkspaceView.ALL:
                figure = _all(workspace, height, bearing, marked)
        _explain(figure, workspace, marked, cut=view is not WorkspaceView.SPACE)
    return figure


def _all(workspace: Workspace, height: float, bearing: float, marked: MarkedTarget | None) -> Figure:
    figure = blank(12.6, 11.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1.0), height_ratios=(1.25, 1.0))
    draw_section(figure.add_subplot(grid[0, 0]), workspace, bearing, marked)
    draw_plan(figure.add_subplot(grid[:, 1]), workspace, height, bearing, marked)
    draw_surface(_in_space(figure, grid[1, 0]), workspace, bearing, marked)
    return figure


def _in_space(figure: Figure, place: SubplotSpec | None = None) -> Axes3D:
    axes = figure.add_subplot(projection="3d") if place is None else figure.add_subplot(place, projection="3d")
    assert isinstance(axes, Axes3D)
    return axes


def _explain(figure: Figure, workspace: Workspace, marked: MarkedTarget | None, *, cut: bool) -> None:
    """Add a legend of the marks and their places under the figure, and of the style of zones if they are `cut`."""
    handles, words = zone_key() if workspace.zones and cut else ([], [])
    if marked is not None:
        marks, labels = figure.axes[0].get_legend_handles_labels()
        places = ([] if marked.reachable else [marked.target]) + [marked.held]
        handles = [*marks, *handles]
        named = [f"{label} ({at.x:.3f}, {at.y:.3f}, {at.z:.3f}) m" for label, at in zip(labels, places, strict=True)]
        words = [*named, *words]
    if handles:
        figure.legend(handles, words, loc="outside lower center", ncols=2)
