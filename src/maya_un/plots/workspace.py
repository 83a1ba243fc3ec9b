"""Figures of the workspace: from the side, from above, in space, or all three."""

from __future__ import annotations

from enum import StrEnum

from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from mpl_toolkits.mplot3d import Axes3D

from maya_un.kinematics import Workspace
from maya_un.plots.marks import MarkedTarget
from maya_un.plots.plan import draw_plan
from maya_un.plots.section import draw_section
from maya_un.plots.style import blank, house_style
from maya_un.plots.surface import draw_surface
from maya_un.plots.zones import key
from maya_un.values import Point


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

    `height` [m] is where the plan is cut. A `target` [m] is marked together with the reachable place nearest to it,
    and the boom points there; without one it points to the middle of its range.
    """
    marked = None if target is None else MarkedTarget.of(workspace, target)
    bearing = 0.5 * sum(workspace.boom) if marked is None else workspace.mechanism.ik(marked.held).a
    with house_style():
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
    """Put what the marks mean, and where they are, under the figure, and how zones are drawn where they are `cut`."""
    handles, words = key() if workspace.zones and cut else ([], [])
    if marked is not None:
        marks, labels = figure.axes[0].get_legend_handles_labels()
        places = ([] if marked.reachable else [marked.target]) + [marked.held]
        handles = [*marks, *handles]
        named = [f"{label} ({at.x:.3f}, {at.y:.3f}, {at.z:.3f}) m" for label, at in zip(labels, places, strict=True)]
        words = [*named, *words]
    if handles:
        figure.legend(handles, words, loc="outside lower center", ncols=2)
