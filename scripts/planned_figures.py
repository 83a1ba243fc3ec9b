"""The figures of docs that show planned motion; `draw_docs.py` writes them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maya_un.config import Config, Units
from maya_un.kinematics import Floats, Workspace
from maya_un.motion.move import CoordinatedMove, lay
from maya_un.motion.path import Path
from maya_un.motion.profile import Limits
from maya_un.motion.timing import plan
from maya_un.plots.style import BOOM, GREY, INK, LINE_B, LINE_C, blank, figure_style, quiet_grid
from maya_un.values import Point

CONFIG = Config()
MECHANISM = Workspace.of(CONFIG).mechanism
LIMITS, UNITS = Limits.of(CONFIG), Units.of(CONFIG)

FROM, TO = Point(0.0, 1.0, 0.7), Point(2.0, 0.6, 1.3)
"""A straight way of the gripper [m], along which each axis in turn is the slowest."""


def straight_move() -> CoordinatedMove:
    """Return the fastest move straight from `FROM` to `TO`."""
    return plan(lay(Path.line(FROM, TO), MECHANISM, UNITS, LIMITS), LIMITS, UNITS)


def time_optimal() -> Figure:
    """Return the speed along a straight way of the gripper under the bounds of the axes, and its end over time."""
    move = straight_move()
    with figure_style():
        figure = blank(7.2, 3.6)
        whole, end = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        _bounds(whole)
        way, speed = _speeds(move, np.linspace(0.0, move.duration, 3000))
        whole.plot(way, speed, color=INK, linewidth=1.1, zorder=5)
        length = float(np.linalg.norm(np.subtract(TO, FROM)))
        whole.set(xlim=(0.0, length), ylim=(0.0, 120.0), xlabel="way of the gripper s [m]")
        whole.set_ylabel("its speed s' [mm/s]")
        whole.set_title("As fast as the slowest axis allows", loc="left")
        _stairs(end, move)
    return figure


def _bounds(axes: Axes) -> None:
    """Draw at which speed of the gripper each axis would be at its slew speed."""
    quiet_grid(axes)
    shares = np.linspace(0.0, 1.0, 601)
    length = float(np.linalg.norm(np.subtract(TO, FROM)))
    joints = MECHANISM.ik_many(np.array(FROM) + shares[:, np.newaxis] * np.subtract(TO, FROM))
    per_way = np.abs(np.gradient(joints, shares * length, axis=0)) * np.array(UNITS.per_unit)
    labels = ((0, "a", BOOM, (0.06, 57.0)), (2, "c", LINE_C, (1.12, 79.0)), (1, "b", LINE_B, (1.55, 107.0)))
    for index, name, colour, place in labels:
        bound = 1e3 * LIMITS.speed[index] / np.maximum(per_way[:, index], 1e-9)
        axes.plot(shares * length, np.where(bound < 130.0, bound, np.nan), color=colour, linestyle="dashed", zorder=4)
        axes.text(*place, f"{name} at slew speed", color=colour, fontsize=8)


def _stairs(axes: Axes, move: CoordinatedMove) -> None:
    """Draw the last of the slow-down over time: segments, each braked at VD to its end speed."""
    quiet_grid(axes)
    begin = move.duration - 0.9
    time = np.linspace(begin, move.duration, 4000)
    axes.plot(time - move.duration, [move.speed_at(float(t)) / 1e3 for t in time], color=INK, linewidth=1.2)
    ends = [piece.t for piece in move.profile.pieces if piece.t >= begin and piece.acceleration < 0.0]
    for t in ends:
        axes.axvline(t - move.duration, color=GREY, linewidth=0.4, zorder=1)
    axes.set(xlim=(-0.9, 0.0), xlabel="time before the end [s]", ylabel="speed along the path [1000 counts/s]")
    axes.set_ylim(bottom=0.0)
    axes.set_title("Slowing down, stair by stair", loc="left")


def _speeds(move: CoordinatedMove, times: Floats) -> tuple[Floats, Floats]:
    """Return way [m] and speed [mm/s] of the gripper along the straight line at `times` (n,) [s]."""
    joints = np.array([move.position_at(float(t)) for t in times])
    rates = np.array([move.velocity_at(float(t)) for t in times])
    along = np.subtract(TO, FROM) / np.linalg.norm(np.subtract(TO, FROM))
    way = (MECHANISM.fk_many(joints) - np.array(FROM)) @ along
    points = MECHANISM.fk_many(joints + 1e-6 * rates) - MECHANISM.fk_many(joints - 1e-6 * rates)
    return way, 1e3 * (points @ along) / 2e-6
