"""Preview of a motion or a job: axes over time, the gripper's path, and the distance to every limit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Mechanism, Workspace
from maya_un.kinematics.outline import outline
from maya_un.kinematics.zones import clearances
from maya_un.plots import plan
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

_BAND = "#F3F3F3"
_NARROW = 0.011
"""Share of a panel's width that one letter of a phase's name takes."""


class MotionPhase(NamedTuple):
    """A named stretch of a motion, from `start` to `end` [s]; `short` is the name if space is scarce."""

    name: str
    start: float
    end: float
    short: str = ""


def job_figure(
    time: Floats,
    joints: Floats,
    velocity: Floats,
    phases: Sequence[MotionPhase],
    config: Config,
    workspace: Workspace | None = None,
    title: str = "",
) -> Figure:
    """Return the figure of a motion given by samples.

    `time` (n,) [s]; `joints` (n, 3) [rad, m, m], rows of nan if unknown; `velocity` (n, 3) [rad/s, m/s, m/s]. Without
    `workspace` it is the configuration's.
    """
    course = MotionSamples(time, joints, velocity, workspace or Workspace.of(config))
    with figure_style():
        figure = blank(12.6, 11.6)
        grid = figure.add_gridspec(2, 1, height_ratios=(3.0, 2.5))
        times = grid[0].subgridspec(3, 3)
        panels = [[figure.add_subplot(times[row, column]) for column in range(3)] for row in range(3)]
        _positions([row[0] for row in panels], course)
        _velocities([row[1] for row in panels], course, config)
        _gripper([row[2] for row in panels], course)
        for axes in (axes for row in panels for axes in row):
            _timeline(axes, course, phases)
        for axes in panels[0]:
            _names(axes, course, phases)
        for axes in panels[-1]:
            axes.set_xlabel("time [s]")
        above, side = (figure.add_subplot(place) for place in grid[1].subgridspec(1, 2, width_ratios=(1.0, 1.15)))
        _way_above(above, course)
        _way_beside(side, course)
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure


@dataclass(frozen=True, slots=True)
class MotionSamples:
    """Samples of a motion, and values computed from them."""

    time: Floats
    joints: Floats
    velocity: Floats
    workspace: Workspace

    @property
    def points(self) -> Floats:
        """Places of the gripper point, shape (n, 3) [m]."""
        return self.workspace.mechanism.fk_many(self.joints)

    @property
    def section(self) -> tuple[Floats, Floats]:
        """Coordinates u and h of the section [m], each (n,)."""
        mechanism, z = self.workspace.mechanism, self.points[:, 2]
        _, b, c = self.joints.T
        return 0.5 * mechanism.width + (b - c) * (b + c) / (2.0 * mechanism.width), mechanism.reach_down - z

    @property
    def tensions(self) -> tuple[Floats, Floats]:
        """Tensions of the lines b and c [loads], each (n,)."""
        u, h = self.section
        _, b, c = self.joints.T
        W = self.workspace.mechanism.width
        return (W - u) / W * b / h, u / W * c / h

    def margins(self) -> Iterator[tuple[str, Floats, str]]:
        """Yield the distance to each limit that is a length, and to each zone: name, values (n,) [m], colour."""
        u, h = self.section
        _, b, c = self.joints.T
        workspace = self.workspace
        mechanism = workspace.mechanism
        yield "stroke of b", _inside(b, *workspace.line_b), LINE_B
        yield "stroke of c", _inside(c, *workspace.line_c), LINE_C
        yield "slack", np.minimum(u, mechanism.width - u), PURPLE
        yield "table", mechanism.reach_down - h, GREY
        for name, clear in _zones(workspace, self.joints):
            yield name, clear, YELLOW


def _inside(values: Floats, least: float, most: float) -> Floats:
    return np.minimum(values - least, most - values)


def _zones(workspace: Workspace, joints: Floats) -> Iterable[tuple[str, Floats]]:
    if not workspace.zones:
        return
    known = np.isfinite(joints).all(axis=1)
    clear = np.full((len(joints), len(workspace.zones)), np.nan)
    clear[known] = clearances(workspace.zones, workspace.mechanism, joints[known])
    for zone, column in zip(workspace.zones, clear.T, strict=True):
        yield f"zone {zone.name}", column


def _positions(panels: Sequence[Axes], course: MotionSamples) -> None:
    workspace = course.workspace
    a, b, c = course.joints.T
    for axes, name, unit, values, ends, colour in (
        (panels[0], "a", "°", np.degrees(a), np.degrees(workspace.boom), BOOM),
        (panels[1], "b", "m", b, workspace.line_b, LINE_B),
        (panels[2], "c", "m", c, workspace.line_c, LINE_C),
    ):
        axes.plot(course.time, values, color=colour)
        _limits(axes, ends)
        axes.set_ylabel(f"{name} [{unit}]")
    panels[0].set_title("Position", loc="left", pad=14)


def _velocities(panels: Sequence[Axes], course: MotionSamples, config: Config) -> None:
    per_unit = Units.of(config).per_unit
    scales = (180.0 / np.pi, 1e3, 1e3)
    for index, (axes, colour, unit) in enumerate(
        zip(panels, (BOOM, LINE_B, LINE_C), ("°/s", "mm/s", "mm/s"), strict=True)
    ):
        fastest = config.axes[index].speed_counts / per_unit[index] * scales[index]
        axes.plot(course.time, course.velocity[:, index] * scales[index], color=colour)
        _limits(axes, (-fastest, fastest))
        axes.set_ylabel(f"{'abc'[index]} [{unit}]")
    panels[0].set_title("Velocity", loc="left", pad=14)


def _gripper(panels: Sequence[Axes], course: MotionSamples) -> None:
    height, pull, near = panels
    height.plot(course.time, course.points[:, 2], color=INK)
    height.set_ylabel("z [m]")
    height.set_title("Gripper", loc="left", pad=14)
    for name, values, colour in zip("bc", course.tensions, (LINE_B, LINE_C), strict=True):
        pull.plot(course.time, values, color=colour, label=f"line {name}")
    _limits(pull, (course.workspace.tension_limit,))
    pull.set_ylabel("tension [× load]")
    pull.set_ylim(bottom=0.0)
    for name, values, colour in course.margins():
        near.plot(course.time, values, color=colour, label=name)
    _limits(near, (0.0,))
    near.set_ylabel("distance to limit [m]")
    for axes in (pull, near):
        axes.legend(loc="upper left", ncols=3, handlelength=1.2, columnspacing=1.0)
        axes.set_ylim(top=axes.get_ylim()[1] * 1.4)


def _limits(axes: Axes, ends: Iterable[float]) -> None:
    for end in ends:
        axes.axhline(end, color=INK, linewidth=0.9, linestyle="dashed")


def _timeline(axes: Axes, course: MotionSamples, phases: Sequence[MotionPhase]) -> None:
    quiet_grid(axes)
    for phase in phases[::2]:
        axes.axvspan(phase.start, phase.end, color=_BAND, linewidth=0)
    begin, end = float(course.time[0]), float(course.time[-1])
    if end > begin:
        axes.set_xlim(begin, end)


def _names(axes: Axes, course: MotionSamples, phases: Sequence[MotionPhase]) -> None:
    """Write the names of the phases that are long enough over the panel."""
    whole = float(course.time[-1] - course.time[0])
    for phase in phases:
        share = (phase.end - phase.start) / whole if whole > 0.0 else 0.0
        name = phase.name if share > _NARROW * len(phase.name) else phase.short
        if name and share > _NARROW * len(name):
            middle = 0.5 * (phase.start + phase.end)
            axes.annotate(
                name,
                (middle, 1.0),
                (0, 2),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="center",
                fontsize=6.5,
                color=GREY,
            )


def _way_above(axes: Axes, course: MotionSamples) -> None:
    plan.frame(axes, course.workspace)
    _, _, z = course.points.T
    known = z[np.isfinite(z)]
    if known.size:
        plan.sectors(axes, course.workspace, float(known.min()))
        plan.zones_at(axes, course.workspace, float(known.min()))
        axes.set_title(f"The gripper's way from above; what is reachable at z = {known.min():.2f} m", loc="left")
    _way(axes, course.points[:, 0], course.points[:, 1])


def _way_beside(axes: Axes, course: MotionSamples) -> None:
    quiet_grid(axes)
    mechanism: Mechanism = course.workspace.mechanism
    axes.fill(*outline(course.workspace), facecolor=REACHABLE, edgecolor=INK, linewidth=1.4)
    axes.axhline(0.0, color=GREY, linewidth=1.2)
    axes.plot((0.0, mechanism.length), (mechanism.height,) * 2, color=PALE, linewidth=4.0)
    axes.set(aspect="equal", xlabel="distance from axis a, d [m]", ylabel="height, z [m]")
    axes.set_title("The gripper's way from the side", loc="left")
    _way(axes, np.hypot(course.points[:, 0], course.points[:, 1]), course.points[:, 2])


def _way(axes: Axes, across: Floats, up: Floats) -> None:
    axes.plot(across, up, color=LINE_C, linewidth=1.2, zorder=4)
    known = np.flatnonzero(np.isfinite(across + up))
    for index, marker, label in ((0, "o", "start"), (-1, "s", "end")):
        if known.size:
            at = known[index]
            axes.plot(across[at], up[at], marker=marker, color=INK, ms=6, ls="none", label=label, zorder=5)
    axes.legend(loc="lower right")
