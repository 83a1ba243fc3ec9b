"""The figures that only docs/explanation/the-mechanism.md needs; `draw_docs.py` writes them."""

from __future__ import annotations

from math import cos, degrees, hypot, radians, sin, sqrt

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Rectangle, Wedge
from numpy.typing import NDArray

from maya_un.config import Config
from maya_un.kinematics import Mechanism, Workspace, hanging, tension
from maya_un.kinematics.outline import outline
from maya_un.plots.style import (
    BOOM,
    GREY,
    INK,
    LINE_B,
    LINE_C,
    PALE,
    PURPLE,
    REACHABLE,
    YELLOW,
    blank,
    figure_style,
    quiet_grid,
)
from maya_un.values import Joints

CONFIG = Config()
WORKSPACE = Workspace.of(CONFIG)
MECHANISM = WORKSPACE.mechanism
W, HIGH = MECHANISM.width, MECHANISM.reach_down

SLACK_FROM, SLACK_TO = (0.05, 0.60), (0.30, 1.50)
"""Ends (u, h) [m] of the move that lets line c hang slack when each axis goes at its own speed."""

ARROW = {"arrowstyle": "<->", "color": GREY, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}


def triangle() -> Figure:
    """Return the side view with the letters of the formulas."""
    with figure_style():
        figure = blank(7.2, 5.6)
        axes = figure.add_subplot()
        d, z = 1.25, 0.75
        meeting = (d, z + MECHANISM.drop)
        _stand(axes, MECHANISM)
        for name, anchor, colour in (("b", MECHANISM.delta, LINE_B), ("c", MECHANISM.length, LINE_C)):
            axes.plot((anchor, d), (MECHANISM.height, meeting[1]), color=colour, linewidth=2.2, zorder=4)
            middle = (0.5 * (anchor + d), 0.5 * (MECHANISM.height + meeting[1]))
            _say(axes, name, middle, colour, (-11 if name == "b" else 6, -7), size=12)
        axes.plot((d, d), (meeting[1], z), color=INK, linewidth=2.6, zorder=4)
        axes.plot(d, z, marker="o", color=INK, markersize=8, zorder=5)
        _say(axes, "gripper point (d, z)", (d, z), INK, (10, -14))
        _say(axes, "meeting point", meeting, INK, (10, 5))
        _measures(axes, d, z)
        axes.set(aspect="equal", xlim=(-0.35, 2.72), ylim=(-0.1, 2.82))
        axes.set_axis_off()
    return figure


def robot() -> Figure:
    """Return the robot from the side and from above, with the workspace."""
    with figure_style():
        figure = blank(7.2, 3.9)
        side, above = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        _from_the_side(side, 1.3, 1.0)
        _from_above(above, radians(52.0), 1.3)
    return figure


def _from_the_side(axes: Axes, d: float, z: float) -> None:
    """Draw boom, lines, gripper with a part, and the workspace; the gripper point is at (d, z) [m]."""
    meeting = (d, z + MECHANISM.drop)
    axes.fill(*outline(WORKSPACE), facecolor=REACHABLE, edgecolor=GREY, linewidth=0.8)
    axes.plot((-0.15, 2.6), (0.0, 0.0), color=GREY, linewidth=1.4)
    axes.plot((0.0, 0.0), (0.0, MECHANISM.height), color=GREY, linewidth=6.0, solid_capstyle="butt")
    axes.plot((0.0, MECHANISM.length), (MECHANISM.height,) * 2, color=GREY, linewidth=5.0, zorder=2)
    for name, anchor, colour, aside in (("b", MECHANISM.delta, LINE_B, -12), ("c", MECHANISM.length, LINE_C, 6)):
        axes.plot((anchor, d), (MECHANISM.height, meeting[1]), color=colour, linewidth=2.0, zorder=4)
        axes.plot(anchor, MECHANISM.height, marker="o", color=colour, markersize=8, zorder=6)
        middle = (0.5 * (anchor + d), 0.5 * (MECHANISM.height + meeting[1]))
        _say(axes, f"line {name}", middle, colour, (3 * aside if aside < 0 else aside, -9))
        _say(axes, f"anchor {name}", (anchor, MECHANISM.height), colour, (0, 8), align="center")
    axes.plot((d, d), (meeting[1], z + 0.12), color=INK, linewidth=2.0, zorder=5)
    axes.plot((d - 0.08, d - 0.08, d + 0.08, d + 0.08), (z, z + 0.12, z + 0.12, z), color=INK, linewidth=2.0, zorder=5)
    axes.add_patch(Rectangle((d - 0.07, z - 0.07), 0.14, 0.14, color=YELLOW, zorder=4))
    _say(axes, "gripper with a part", (d + 0.12, z), INK, (6, -2), size=8)
    _say(axes, "workspace", (d, 0.45), GREY, (0, 0), align="center")
    _say(axes, "table, z = 0", (1.75, 0.0), GREY, (0, -12))
    _say(axes, "axis a", (0.0, 1.1), GREY, (-7, 0), rotation=90.0, align="right")
    axes.set(aspect="equal", xlim=(-0.35, 2.7), ylim=(-0.25, 2.65), title="From the side")
    axes.set_axis_off()


def _from_above(axes: Axes, angle: float, d: float) -> None:
    """Draw the boom at `angle` [rad] with the gripper at distance d [m], and all that the gripper can be above."""
    first, last = WORKSPACE.boom
    inner, outer = min(outline(WORKSPACE)[0]), max(outline(WORKSPACE)[0])
    turns = (90.0 - degrees(last), 90.0 - degrees(first))
    axes.add_patch(Wedge((0.0, 0.0), outer, *turns, width=outer - inner, facecolor=REACHABLE, edgecolor=GREY, lw=0.8))
    toward = (sin(angle), cos(angle))
    tip = (MECHANISM.length * toward[0], MECHANISM.length * toward[1])
    axes.plot((0.0, tip[0]), (0.0, tip[1]), color=GREY, linewidth=5.0, zorder=3)
    axes.plot(0.0, 0.0, marker="o", color=GREY, markersize=12, zorder=4)
    for anchor, colour in ((MECHANISM.delta, LINE_B), (MECHANISM.length, LINE_C)):
        axes.plot(anchor * toward[0], anchor * toward[1], marker="o", color=colour, markersize=8, zorder=6)
    axes.plot(d * toward[0], d * toward[1], marker="s", color=YELLOW, markeredgecolor=INK, markersize=7, zorder=6)
    for end, name in (((0.9, 0.0), "x"), ((0.0, 0.9), "y")):
        axes.annotate("", end, (0.0, 0.0), arrowprops={**ARROW, "arrowstyle": "-|>", "color": INK}, zorder=5)
        _say(axes, name, end, INK, (4, 3))
    axes.add_patch(Arc((0.0, 0.0), 1.2, 1.2, theta1=90.0 - degrees(angle), theta2=90.0, color=BOOM, lw=1.6, zorder=5))
    _say(axes, "α", (0.66 * sin(angle / 2.0), 0.66 * cos(angle / 2.0)), BOOM, (0, 0), size=11)
    _say(axes, "boom", tip, GREY, (4, 4))
    _say(axes, "axis a", (0.0, 0.0), GREY, (-8, -14), align="right")
    axes.set(aspect="equal", xlim=(-0.5, 2.7), ylim=(-1.35, 2.45), title="From above")
    axes.set_axis_off()


def _stand(axes: Axes, mechanism: Mechanism) -> None:
    axes.plot((-0.2, 2.7), (0.0, 0.0), color=GREY, linewidth=1.4)
    axes.plot((0.0, 0.0), (0.0, mechanism.height), color=GREY, linewidth=1.2, dashes=(8, 2, 1, 2))
    axes.plot((0.0, mechanism.length), (mechanism.height, mechanism.height), color=PALE, linewidth=5.0, zorder=2)
    axes.plot(mechanism.delta, mechanism.height, marker="o", color=LINE_B, markersize=8, zorder=6)
    axes.plot(mechanism.length, mechanism.height, marker="o", color=LINE_C, markersize=8, zorder=6)
    _say(axes, "axis a (α)", (0.0, 0.05), GREY, (5, 2))
    _say(axes, "table, z = 0", (2.1, 0.0), GREY, (0, 4))


def _measures(axes: Axes, d: float, z: float) -> None:
    """Draw the lengths that the formulas use."""
    top, meet = MECHANISM.height, z + MECHANISM.drop
    for begin, end, label, offset in (
        ((0.0, 2.72), (MECHANISM.length, 2.72), "D = 2.30", (0, 3)),
        ((MECHANISM.delta, 2.54), (MECHANISM.length, 2.54), "W = D − Δ = 2.00", (0, 3)),
        ((0.0, 2.54), (MECHANISM.delta, 2.54), "Δ = 0.30", (0, 3)),
        ((-0.2, 0.0), (-0.2, top), "H = 2.35", (-12, 0)),
        ((MECHANISM.delta, meet), (d, meet), "u", (0, 3)),
        ((d, top), (d, meet), "h", (7, 12)),
        ((d + 0.62, z), (d + 0.62, meet), "Φ = 0.20", (26, -3)),
        ((0.0, z - 0.16), (d, z - 0.16), "d = Δ + u", (0, -12)),
        ((2.55, 0.0), (2.55, z), "z", (7, -3)),
    ):
        axes.annotate("", end, begin, arrowprops=ARROW)
        middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
        upright = label.startswith("H")
        _say(axes, label, middle, INK, offset, align="center", rotation=90.0 if upright else 0.0)
    for begin, end in (((d, z), (2.6, z)), ((d, meet), (d + 0.7, meet)), ((d, z), (d, z - 0.2))):
        axes.plot(*zip(begin, end, strict=True), color=PALE, linewidth=0.8, zorder=1)
    for place in (MECHANISM.delta, MECHANISM.length):
        axes.plot((place, place), (top, 2.76), color=PALE, linewidth=0.8, zorder=1)


def forces() -> Figure:
    """Return the forces at the meeting point for a deep and a flat posture, and the tension over the depth."""
    with figure_style():
        figure = blank(7.2, 3.4)
        closed, over = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        for left, h in ((0.0, 1.0), (1.6, 0.25)):
            _polygon(closed, left, h)
        closed.set(aspect="equal", xlim=(-0.5, 3.7), ylim=(-1.35, 0.5))
        closed.set_axis_off()
        h = np.geomspace(0.02, 1.6, 200)
        pull = np.array([tension(1.0, float(at), W)[0] for at in h])
        quiet_grid(over)
        over.plot(h, pull, color=INK)
        over.axhline(WORKSPACE.tension_limit, color=INK, linestyle="dashed", linewidth=0.9)
        _say(over, "limit: 5 × load", (1.6, WORKSPACE.tension_limit), INK, (0, 3), align="right")
        for at in (1.0, 0.25):
            over.plot(at, tension(1.0, at, W)[0], marker="o", color=LINE_B, markersize=6)
        over.set(ylim=(0.0, 10.0), xlim=(0.0, 1.6), xlabel="depth h in the middle [m]")
        over.set_ylabel("tension of each line [× load]")
    return figure


def _polygon(axes: Axes, left: float, h: float) -> None:
    """Draw the load and both tensions head to tail: they close, because the point is at rest."""
    pull, _ = tension(1.0, h, W)
    length = hypot(1.0, h)
    top, bottom, tip = (left, 0.0), (left, -1.0), (left + pull / length, -1.0 + pull * h / length)
    for begin, end, colour, label, offset in (
        (top, bottom, INK, "load", (-14, -3)),
        (bottom, tip, LINE_C, f"T$_c$ = {pull:.2f}", (24, -19)),
        (tip, top, LINE_B, f"T$_b$ = {pull:.2f}", (24, 13)),
    ):
        arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.0, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", end, begin, arrowprops=arrow)
        _say(axes, label, (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1])), colour, offset, align="center")
    _say(axes, f"h = {h:g} m", (left - 0.1, 0.36), INK, (0, 0), size=10)


def between_the_ends() -> Figure:
    """Return two moves whose ends are good and whose ways are not."""
    with figure_style():
        figure = blank(7.2, 4.4)
        side, under = figure.subplots(1, 2, width_ratios=(1.0, 1.2))
        _slack(side)
        _ceiling(under)
    return figure


def _slack(axes: Axes) -> None:
    start, end = (_lines(*place) for place in (SLACK_FROM, SLACK_TO))
    _area(axes)
    together = start + np.linspace(0.0, 1.0, 101)[:, np.newaxis] * (end - start)
    fastest = CONFIG.axes.b.speed_counts / CONFIG.scale.pulses_per_metre
    moved = np.minimum(np.linspace(0.0, 25.0, 501)[:, np.newaxis] * fastest, np.abs(end - start))
    alone = start + np.sign(end - start) * moved
    _drawn(axes, together, BOOM)
    _drawn(axes, alone, PURPLE)
    _say(axes, "together", (0.40, 1.2), BOOM, (4, 0))
    _say(axes, "each at its\nown speed", (0.29, 1.22), PURPLE, (0, 0), align="right")
    _ends(axes, start, end)
    axes.set(xlim=(0.0, 0.85), ylim=(0.45, 1.72), xlabel="d [m]", ylabel="z [m]", aspect="equal")
    axes.set_title("Line c hangs slack", loc="left")


def _ceiling(axes: Axes) -> None:
    u = 0.6
    h = _shallowest(u)
    start, end = _lines(u, h), _lines(W - u, h)
    quiet_grid(axes)
    columns = [(at, WORKSPACE.section.depths(float(at))) for at in np.linspace(0.5, 1.5, 401)]
    d, top = np.array([(MECHANISM.delta + at, HIGH - depths[0]) for at, depths in columns if depths is not None]).T
    axes.fill_between(d, 2.0, top, facecolor=REACHABLE, edgecolor=INK, linewidth=1.4)
    _drawn(axes, start + np.linspace(0.0, 1.0, 101)[:, np.newaxis] * (end - start), PURPLE)
    _say(axes, "straight in b and c", (1.3, _height_between(u, h)), PURPLE, (0, 18), align="center")
    _ends(axes, start, end)
    axes.set(xlim=(0.78, 1.82), ylim=(2.03, 2.085), xlabel="d [m]", ylabel="z [m]")
    axes.set_title("The lines get too straight", loc="left")
    _say(axes, "reachable, at most 5 × load", (1.3, 2.036), GREY, (0, 0), align="center")


def stopping() -> Figure:
    """Return where a stop leads in the plane of b and c: on the path together, beside it axis by axis."""
    with figure_style():
        figure = blank(7.2, 3.0)
        axes = figure.add_subplot()
        quiet_grid(axes)
        speed, ratio = 45.0, 0.46
        axes.plot((-60.0, 240.0), (-60.0 * ratio, 240.0 * ratio), color=GREY, linewidth=1.0, linestyle="dashed")
        _say(axes, "the path", (205.0, 205.0 * ratio), GREY, (-2, 8), align="right")
        for deceleration, name in ((5.12, "5120 counts/s²"), (51.2, "51 200 counts/s²")):
            b, c = _braked(speed, deceleration), _braked(ratio * speed, deceleration)
            axes.plot(b, ratio * b, color=BOOM, linewidth=2.4)
            axes.plot(b, _held(c, len(b)), color=PURPLE, linewidth=1.8)
            axes.plot(b[-1], ratio * b[-1], marker="o", color=BOOM, zorder=5)
            axes.plot(b[-1], c[-1], marker="s", color=PURPLE, zorder=5)
            _say(axes, name, (b[-1], c[-1]), GREY, (8, -3), size=8.0)
        _say(axes, "all axes together, on the path", (100.0, 46.0), BOOM, (-6, 8), align="right")
        _say(axes, "each axis by itself", (112.0, 38.0), PURPLE, (0, -20), align="center")
        axes.set(aspect="equal", xlim=(-60.0, 280.0), ylim=(-30.0, 112.0))
        axes.set(xlabel="way of line b after the stop [mm]", ylabel="of line c [mm]")
    return figure


def _braked(speed: float, deceleration: float) -> NDArray[np.float64]:
    """Return the way of an axis that brakes from `speed` [mm/s] at `deceleration` [mm/s²], every 20 ms [mm]."""
    time = np.append(np.arange(0.0, speed / deceleration, 0.02), speed / deceleration)
    return speed * time - 0.5 * deceleration * time * time


def _held(way: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    return np.append(way, np.full(count - len(way), way[-1]))


def _shallowest(u: float) -> float:
    longer = max(u, W - u)
    return u * (W - u) / sqrt((WORKSPACE.tension_limit * W) ** 2 - longer * longer)


def _lines(u: float, h: float) -> NDArray[np.float64]:
    return np.array((hypot(u, h), hypot(W - u, h)))


def _height_between(u: float, h: float) -> float:
    """Return how high the gripper is half way between (u, h) and its mirror image [m]."""
    b, c = _lines(u, h)
    return HIGH - sqrt((0.5 * (b + c)) ** 2 - (0.5 * W) ** 2)


def _drawn(axes: Axes, lines: NDArray[np.float64], colour: str) -> None:
    places = np.array([hanging(float(b), float(c), W) for b, c in lines])
    axes.plot(MECHANISM.delta + places[:, 0], HIGH - places[:, 1], color=colour, zorder=5)


def _ends(axes: Axes, start: NDArray[np.float64], end: NDArray[np.float64]) -> None:
    for lines, name, offset in ((start, "A", (-4, 9)), (end, "B", (-4, 9))):
        point = MECHANISM.fk(Joints(0.0, float(lines[0]), float(lines[1])))
        axes.plot(point.y, point.z, marker="o", color=INK, markersize=6, zorder=6)
        _say(axes, name, (point.y, point.z), INK, offset, size=10)


def _area(axes: Axes) -> None:
    quiet_grid(axes)
    axes.fill(*outline(WORKSPACE), facecolor=REACHABLE, edgecolor=INK, linewidth=1.4)


def _say(
    axes: Axes,
    text: str,
    place: tuple[float, float],
    colour: str,
    offset: tuple[float, float],
    *,
    size: float = 9.0,
    align: str = "left",
    rotation: float = 0.0,
) -> None:
    axes.annotate(
        text,
        place,
        offset,
        textcoords="offset points",
        color=colour,
        fontsize=size,
        ha=align,
        va="center" if rotation else "baseline",
        rotation=rotation,
        zorder=7,
    )
