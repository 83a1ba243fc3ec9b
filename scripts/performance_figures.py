"""The figures of docs/explanation/performance.md; `draw_docs.py` writes them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from performance_results import BARE, OURS, Growth, number, read

from maya_un.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, blank, figure_style, quiet_grid

NO_PEERS = (OURS, BARE)
"""The first words of programs that no user would pick instead of Maya."""

WIDE = 10
"""An axis over more than this factor is logarithmic."""

COLOURS = (ORANGE, GREEN, PURPLE)
"""The colours of the other programs; Maya is blue."""


def peers() -> Figure:
    """Return the costs of the other programs as multiples of Maya's, on a logarithmic axis."""
    rows = [row for row in read()[-1].rows if row.ratio is not None and row.program != OURS]
    with figure_style():
        figure = blank(7.2, 0.6 + 0.3 * len(rows))
        axes = figure.subplots()
        axes.grid(visible=True, axis="x")
        axes.set(xscale="log", xlabel="cost of the same work, as a multiple of Maya's")
        for place, row in enumerate(reversed(rows)):
            assert row.ratio is not None
            colour = GREY if row.program.startswith(NO_PEERS) else BLUE if row.ratio >= 1.0 else ORANGE
            axes.plot((1.0, row.ratio), (place, place), color=colour, linewidth=2.0)
            axes.plot((row.ratio,), (place,), "o", color=colour, markersize=5)
            at, text = (row.ratio, place), number(row.ratio)
            axes.annotate(text, at, xytext=(0, 5), textcoords="offset points", ha="center", fontsize=7)
        axes.axvline(1.0, color=INK, linewidth=1.0)
        names = [f"{row.work}: {row.program}" for row in reversed(rows)]
        axes.set_yticks(range(len(rows)), names)
        axes.set_ylim(-0.6, len(rows) - 0.2)
        axes.margins(x=0.08)
        axes.set_title("blue: Maya is faster; orange: Maya is slower", loc="left")
    return figure


def growth() -> Figure:
    """Return the cost over the size of the work, a part for every subject."""
    found = [(subject, list(all_of)) for subject, all_of in groupby(read()[-1].growth, key=lambda one: one.subject)]
    with figure_style():
        figure = blank(7.2, 5.2)
        parts = figure.subplots(2, 2)
        for axes, (subject, sizes) in zip(parts.flat, found, strict=True):
            _over_size(axes, subject, sizes)
    return figure


def _over_size(axes: Axes, subject: str, sizes: Sequence[Growth]) -> None:
    quiet_grid(axes)
    programs = list(dict.fromkeys(one.program for one in sizes))
    colours = dict(zip([program for program in programs if program != OURS], COLOURS, strict=False)) | {OURS: BLUE}
    for program in programs:
        own = [one for one in sizes if one.program == program]
        axes.plot(
            [one.size for one in own],
            [one.cost for one in own],
            "o-",
            color=colours[program],
            label=program,
            markersize=3,
        )
    costs, largest = [one.cost for one in sizes], max(one.size for one in sizes)
    if largest > WIDE:
        axes.set(xscale="log")
    if max(costs) > WIDE * min(costs):
        axes.set(yscale="log")
    else:
        axes.set_ylim(0.0, 1.1 * max(costs))
    axes.set(xlabel=subject, ylabel=sizes[0].unit)
    axes.legend(loc="best")


def limit() -> Figure:
    """Return the durations of the standard motions as multiples of the least time."""
    motions = read()[-1].motions
    places = np.arange(len(motions), dtype=np.float64)
    with figure_style():
        figure = blank(7.2, 2.9)
        axes = figure.subplots()
        axes.grid(visible=True, axis="x")
        axes.barh(places - 0.2, [one.carried_out / one.least for one in motions], 0.36, color=BLUE, label="carried out")
        axes.barh(places + 0.2, [one.alone / one.least for one in motions], 0.36, color=PALE, label="each axis alone")
        axes.axvline(1.0, color=INK, linewidth=1.0)
        axes.set_yticks(places, [one.name for one in motions])
        axes.invert_yaxis()
        axes.set(xlabel="duration, as a multiple of the least time that the axes allow")
        axes.tick_params(axis="y", colors=GREY)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    return figure
