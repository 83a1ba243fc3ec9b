"""The figure that only docs/explanation/the-queue.md needs; `draw_docs.py` writes it."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maya_un.plots.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, YELLOW, blank, figure_style
from maya_un.schema.jobs import TRANSITIONS, TaskState

PLACES = {
    TaskState.HELD: (0.0, 2.0),
    TaskState.QUEUED: (0.0, 0.0),
    TaskState.RUNNING: (2.6, 0.0),
    TaskState.PAUSED: (2.6, 2.0),
    TaskState.INTERRUPTED: (2.6, -2.0),
}
"""The place of each state that is not final; a missing one fails the drawing."""

CAUSES = {
    (TaskState.HELD, TaskState.QUEUED): ("released", (0.66, 1.0)),
    (TaskState.QUEUED, TaskState.HELD): ("held", (-0.46, 1.0)),
    (TaskState.QUEUED, TaskState.RUNNING): ("its turn", (1.25, 0.2)),
    (TaskState.RUNNING, TaskState.PAUSED): ("paused", (2.08, 1.0)),
    (TaskState.PAUSED, TaskState.RUNNING): ("resumed", (3.18, 1.0)),
    (TaskState.RUNNING, TaskState.INTERRUPTED): ("program\nended", (3.2, -1.0)),
    (TaskState.PAUSED, TaskState.INTERRUPTED): ("program\nended", (4.1, 0.55)),
    (TaskState.INTERRUPTED, TaskState.RUNNING): ("continued", (1.92, -0.8)),
    (TaskState.INTERRUPTED, TaskState.QUEUED): ("step\nrepeated", (0.75, -1.4)),
}
"""The cause of each change between two states, and its place in the picture; a missing pair fails the drawing."""

ROUND_THE_SIDE = (TaskState.PAUSED, TaskState.INTERRUPTED)
"""The pair between which a third state lies."""

COLOURS = {
    TaskState.RUNNING: BLUE,
    TaskState.DONE: GREEN,
    TaskState.FAILED: ORANGE,
    TaskState.INTERRUPTED: YELLOW,
}


def states() -> Figure:
    """Return the life of jobs and of their steps, drawn from the table of states."""
    with figure_style():
        figure = blank(7.2, 3.9)
        life, ends = figure.subplots(1, 2, width_ratios=(1.12, 1.0))
        for old, following in TRANSITIONS.items():
            for new in TaskState:  # in the same order each time, which that of a set is not
                if new in following and not new.ended:
                    _arrow(life, old, new)
        for state, place in PLACES.items():
            _box(life, state, place)
        life.set(xlim=(-1.0, 4.8), ylim=(-2.5, 2.5), title="Before the end")
        life.set_axis_off()
        _ends(ends)
    return figure


def _box(axes: Axes, state: TaskState, place: tuple[float, float]) -> None:
    style = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": COLOURS.get(state, INK), "linewidth": 2.0}
    axes.text(*place, state.value, ha="center", va="center", fontsize=9, bbox=style, zorder=4)


def _arrow(axes: Axes, old: TaskState, new: TaskState) -> None:
    """Draw what may follow, with its cause; two arrows between the same two states lie side by side."""
    both = old in TRANSITIONS[new]
    (x0, y0), (x1, y1) = PLACES[old], PLACES[new]
    flat = y0 == y1
    bend, aside = 0.0, 0.0
    if (old, new) == ROUND_THE_SIDE:
        bend, x0, x1 = -0.62, x0 + 0.55, x1 + 0.8
    elif both:
        aside = -0.16 if y1 > y0 else 0.16
    start, end = (x0 + aside, y0), (x1 + aside, y1)
    arrow = {
        "arrowstyle": "-|>",
        "color": GREY,
        "linewidth": 0.9,
        "shrinkA": 28.0 if flat else 12.0 if not bend else 3.0,
        "shrinkB": 30.0 if flat else 12.0 if not bend else 3.0,
        "connectionstyle": f"arc3,rad={bend}",
    }
    axes.annotate("", end, start, arrowprops=arrow, zorder=1)
    cause, place = CAUSES[old, new]
    axes.text(*place, cause, ha="center", va="center", fontsize=8, color=GREY)


def _ends(axes: Axes) -> None:
    """Draw a table: in which final states each other state may end."""
    living = list(PLACES)
    final = [state for state in TRANSITIONS if state.ended]
    for column, end in enumerate(final):
        axes.text(column, -0.75, end.value, ha="center", fontsize=7.5, color=COLOURS.get(end, INK))
    for row, state in enumerate(living):
        axes.axhline(row + 0.5, color=PALE, linewidth=0.6)
        axes.text(-0.8, row, state.value, ha="right", va="center", fontsize=9)
        for column, end in enumerate(final):
            if end in TRANSITIONS[state]:
                axes.plot(column, row, marker="o", markersize=7, color=COLOURS.get(end, INK))
    axes.set(xlim=(-2.2, len(final) - 0.4), ylim=(len(living) + 1.2, -2.2), title="How each of them may end")
    axes.set_axis_off()
