"""The workspace from the side: the vertical plane through the boom, distance from axis a against height.

The section's coordinates (u, h) of `maya_un.kinematics.section` are converted: d = Δ + u to the right and z = H − Φ − h
upwards, both of the gripper point. The ends of the strokes and the curves of tension are therefore drawn Φ below the
places where the lines meet.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, hypot, sin

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Polygon, Rectangle

from maya_un.kinematics import Floats, Workspace
from maya_un.kinematics.outline import outline
from maya_un.plots import overlays
from maya_un.plots.overlays import MarkedTarget, make_room
from maya_un.plots.style import FORBIDDEN, GREY, INK, LINE_B, LINE_C, PALE, REACHABLE, quiet_grid

TENSIONS = (1.0, 1.5, 2.0, 3.0, 5.0)
"""Multiples of the load whose curves are drawn."""

_GRID = 0.02


def manual_margin(workspace: Workspace, u: Floats, z: Floats) -> Floats:
    """Return the distance of places inside the area of the manual's listing [m], negative outside.

    The listing requires 0 ≤ z ≤ H, 0 ≤ u ≤ W and lines within their strokes. It ignores tension. Because it squares the
    depth, it treats a place above the anchors like one below (manual, "Workspace Validations").
    """
    mechanism = workspace.mechanism
    h = mechanism.reach_down - z
    b, c = np.hypot(u, h), np.hypot(mechanism.width - u, h)
    strokes = (b - workspace.line_b[0], workspace.line_b[1] - b, c - workspace.line_c[0], workspace.line_c[1] - c)
    return np.minimum.reduce([z, mechanism.height - z, u, mechanism.width - u, *strokes])


def draw_section(axes: Axes, workspace: Workspace, bearing: float, marked: MarkedTarget | None = None) -> None:
    """Draw the reachable section with all its limits, with the boom at the angle `bearing` [rad].

    A `marked` place is shown with the lines that hold it, or that hold the nearest reachable place.
    """
    _SectionDrawing(axes, workspace, bearing).all(marked)


@dataclass(frozen=True, slots=True)
class _SectionDrawing:
    axes: Axes
    workspace: Workspace
    bearing: float

    def all(self, marked: MarkedTarget | None) -> None:
        mechanism = self.workspace.mechanism
        quiet_grid(self.axes)
        self._frame()
        self._manual()
        edge = self._area()
        self._edges()
        self._strokes()
        self._tensions(edge)
        self._zones()
        self.axes.set(
            aspect="equal",
            xlim=(-0.14, mechanism.length + 0.32),
            ylim=(-0.14, mechanism.height + 0.2),
            xlabel="distance from axis a, d [m]",
            ylabel="height, z [m]",
        )
        if marked is not None:
            self._marked(marked)
        self.axes.set_title(f"From the side, boom at {degrees(self.bearing):.0f}°", loc="left")

    def _frame(self) -> None:
        """Draw the fixed parts: axis, boom, anchors, table."""
        axes, mechanism = self.axes, self.workspace.mechanism
        end = mechanism.length + 0.32
        axes.add_patch(Rectangle((-1.0, -1.0), end + 2.0, 1.0, facecolor="white", edgecolor=PALE, hatch="////", lw=0))
        axes.axhline(0.0, color=GREY, linewidth=1.2)
        axes.plot((0.0, 0.0), (0.0, mechanism.height), color=GREY, linewidth=1.0, dashes=(8, 2, 1, 2))
        boom = (0.0, mechanism.length + 0.06)
        axes.plot(boom, (mechanism.height, mechanism.height), color=GREY, linewidth=4.0, solid_capstyle="butt")
        for name, place, colour in (("b", mechanism.delta, LINE_B), ("c", mechanism.length, LINE_C)):
            axes.plot(place, mechanism.height, marker="o", markersize=6, color=colour, zorder=6)
            self._say(f"anchor {name}", (place, mechanism.height), colour, (0, 6))
        self._say("axis a", (0.0, 0.4), GREY, (-6, 0), rotation=90)
        self._say("table", (0.1, 0.0), GREY, (0, 3))

    def _area(self) -> Polygon:
        edge = Polygon(
            np.column_stack(outline(self.workspace)), facecolor=REACHABLE, edgecolor=INK, linewidth=1.6, zorder=2
        )
        self.axes.add_patch(edge)
        return edge

    def _manual(self) -> None:
        """Draw the area that the manual's listing accepts, dashed; its unreachable part stays visible."""
        axes, mechanism, limit = self.axes, self.workspace.mechanism, self.workspace.tension_limit
        u = np.arange(-2 * _GRID, mechanism.width + 2.5 * _GRID, _GRID)
        z = np.arange(-2 * _GRID, mechanism.height + 2.5 * _GRID, _GRID)
        d, margin = mechanism.delta + u, manual_margin(self.workspace, *np.meshgrid(u, z))
        axes.contourf(d, z, margin, levels=[0.0, np.inf], colors=[FORBIDDEN], zorder=1.5)
        axes.contour(d, z, margin, levels=[0.0], colors=[GREY], linewidths=1.0, linestyles="dashed", zorder=1.8)
        middle = mechanism.delta + 0.5 * mechanism.width
        self._say("accepted by the manual's listing", (middle, mechanism.height), GREY, (0, -14), fontsize=7)
        axes.plot((mechanism.delta, mechanism.length), (mechanism.reach_down,) * 2, color=GREY, lw=0.8, ls="dotted")
        self._say("lines straight", (middle, mechanism.reach_down), GREY, (0, 2), fontsize=7)
        self._say(f"limit: {limit:g} × load", (middle, self._top(middle)), INK, (0, 3), fontsize=7)

    def _top(self, d: float) -> float:
        u = d - self.workspace.mechanism.delta
        depths = self.workspace.section.depths(u)
        return self.workspace.mechanism.reach_down - (0.0 if depths is None else depths[0])

    def _edges(self) -> None:
        """Label the vertical edges, where a line begins to hang slack, and the lowest place."""
        workspace, mechanism = self.workspace, self.workspace.mechanism
        for u, name, side in ((0.0, "c", -4.0), (mechanism.width, "b", 11.0)):
            depths = workspace.section.depths(u)
            if depths is not None:
                place = (mechanism.delta + u, mechanism.reach_down - 0.5 * sum(depths))
                self._say(f"line {name} slack", place, GREY, (side, 0), rotation=90)
        d, z = outline(workspace)
        lowest = int(np.argmin(z))
        self._say(f"z = {z[lowest]:.3f} m", (float(d[lowest]), float(z[lowest])), INK, (0, 24))

    def _strokes(self) -> None:
        """Draw the ends of both strokes as arcs about the anchors, Φ lower."""
        mechanism, workspace = self.workspace.mechanism, self.workspace
        high = mechanism.reach_down
        lines = (
            ("b", mechanism.delta, workspace.line_b, 270.0, LINE_B, (-62.0, -38.0)),
            ("c", mechanism.length, workspace.line_c, 180.0, LINE_C, (242.0, 218.0)),
        )
        for name, centre, stroke, start, colour, places in lines:
            for radius, place, inward in zip(stroke, places, (-1.0, 1.0), strict=True):
                size = 2.0 * radius
                arc = Arc((centre, high), size, size, theta1=start, theta2=start + 90.0, color=colour, lw=0.9, zorder=3)
                self.axes.add_patch(arc)
                turn = np.radians(place)
                away = radius + inward * 0.055
                where = (centre + away * cos(turn), high + away * sin(turn))
                self._say(f"{name} = {radius:.3f} m", where, colour, rotation=_upright(place + 90.0), va="center")

    def _tensions(self, edge: Polygon) -> None:
        """Draw the curves where each line carries 1, 1.5, 2, 3 and 5 times the load."""
        mechanism = self.workspace.mechanism
        W = mechanism.width
        u = 0.5 * W * (1.0 - np.cos(np.linspace(0.01, np.pi - 0.01, 61)))
        for k in TENSIONS:
            for across, colour, place in ((W - u, LINE_B, 0.40), (u, LINE_C, 0.60)):
                z = mechanism.reach_down - u * (W - u) / np.sqrt((k * W) ** 2 - across**2)
                (line,) = self.axes.plot(mechanism.delta + u, z, color=colour, linewidth=0.8, zorder=4)
                line.set_clip_path(edge)
                if k < self.workspace.tension_limit:
                    at = place * W
                    self._label_of_tension(f"{k:g}", (mechanism.delta + at, float(np.interp(at, u, z))), colour)

        middle, low = mechanism.delta + 0.5 * W, mechanism.reach_down - 0.37 * W
        self._say("line b carries", (middle, low), LINE_B, (-32, 0), fontsize=7)
        self._say("line c carries", (middle, low), LINE_C, (32, 0), fontsize=7)
        self._say("so many times the load", (middle, low), INK, (0, -10), fontsize=7)

    def _label_of_tension(self, text: str, place: tuple[float, float], colour: str) -> None:
        box = {"facecolor": REACHABLE, "edgecolor": "none", "pad": 0.8}
        self.axes.text(*place, text, color=colour, fontsize=7, ha="center", va="center", bbox=box, zorder=5)

    def _zones(self) -> None:
        mechanism = self.workspace.mechanism
        d = np.arange(0.0, mechanism.length + 0.3, 0.5 * _GRID)
        z = np.arange(0.0, mechanism.height + 0.2, 0.5 * _GRID)
        across, up = np.meshgrid(d, z)
        places = np.stack((across * sin(self.bearing), across * cos(self.bearing), up))
        overlays.draw_zones(self.axes, self.workspace, d, z, places)

    def _marked(self, marked: MarkedTarget) -> None:
        """Draw the lines that hold the nearest place, and the target."""
        mechanism, axes = self.workspace.mechanism, self.axes
        d, z = hypot(marked.held.x, marked.held.y), marked.held.z
        for anchor, colour in ((mechanism.delta, LINE_B), (mechanism.length, LINE_C)):
            axes.plot((anchor, d), (mechanism.height, z + mechanism.drop), color=colour, linewidth=1.8, zorder=6)
        axes.plot((d, d), (z + mechanism.drop, z), color=INK, linewidth=2.2, zorder=6)
        target = (hypot(marked.target.x, marked.target.y), marked.target.z)
        marked.show(axes, target, (d, z))
        make_room(axes, target)

    def _say(
        self,
        text: str,
        place: tuple[float, float],
        colour: str,
        offset: tuple[float, float] = (0.0, 0.0),
        *,
        rotation: float = 0.0,
        fontsize: float = 8.0,
        va: str = "baseline",
    ) -> None:
        self.axes.annotate(
            text,
            place,
            offset,
            textcoords="offset points",
            rotation=rotation,
            rotation_mode="anchor",
            ha="center",
            va=va,
            color=colour,
            fontsize=fontsize,
            zorder=5,
        )


def _upright(angle: float) -> float:
    """Return a direction [°] turned so that text along it is not upside down."""
    return (angle + 90.0) % 180.0 - 90.0
