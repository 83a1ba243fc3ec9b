"""A recording and its replay: the axes over time, and the differences between the two."""

from __future__ import annotations

from matplotlib.figure import Figure

from maya_un.kinematics import Floats
from maya_un.plots.style import BOOM, INK, LINE_B, LINE_C, PALE, blank, figure_style, quiet_grid

_AXES = (("a", "°", BOOM), ("b", "m", LINE_B), ("c", "m", LINE_C))
_APART = ("°", "mm", "mm")


Course = tuple[Floats, Floats]
"""Times (n,) [s] and values of axes a, b, c (n, 3)."""


def replay_figure(commanded: Course, recorded: Course, replayed: Course, apart: Course, title: str = "") -> Figure:
    """Return the figure of a replay: commanded, recorded and replayed positions of the axes [°, m, m].

    `apart` is the difference of the replay from the recording [°, mm, mm].
    """
    with figure_style():
        figure = blank(10.0, 7.0)
        panels = figure.subplots(3, 2, sharex=True, width_ratios=(2.0, 1.0))
        for number, (name, unit, colour) in enumerate(_AXES):
            left, right = panels[number]
            left.plot(commanded[0], commanded[1][:, number], color=PALE, linewidth=3.0, label="commanded")
            left.plot(recorded[0], recorded[1][:, number], color=colour, label="recorded")
            left.plot(
                replayed[0], replayed[1][:, number], color=INK, linestyle="dashed", linewidth=0.9, label="replayed"
            )
            left.set_ylabel(f"{name} [{unit}]")
            right.plot(apart[0], apart[1][:, number], color=colour)
            right.set_ylabel(f"{name} [{_APART[number]}]")
            quiet_grid(left)
            quiet_grid(right)
        panels[0][0].set_title("Position", loc="left")
        panels[0][1].set_title("Replayed minus recorded", loc="left")
        panels[0][0].legend(loc="best")
        for axes in panels[-1]:
            axes.set_xlabel("time from the beginning [s]")
        if title:
            figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure
