"""The workspace in space: the edge of its section, swept over the boom's range."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import MultipleLocator
from mpl_toolkits.mplot3d import Axes3D

from maya_un.kinematics import Workspace
from maya_un.plots.marks import MarkedTarget
from maya_un.plots.section import outline
from maya_un.plots.style import GREY, INK, LINE_B, LINE_C
from maya_un.plots.zones import draw_in_space
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
    """Draw column, boom and anchors, and the lines down to the place that is held."""
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
