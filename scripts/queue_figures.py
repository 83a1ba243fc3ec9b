"""The figure that only docs/explanation/the-queue.md needs; `draw_docs.py` writes it."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maya_un.plots.style import BLUE, GREEN, GREY, INK, ORANGE, YELLOW, blank, house_style
from maya_un.schema.jobs import TRANSITIONS, TaskState

PLACES = {
    TaskState.SKIPPED: (0.0, 2.9),
    TaskState.HELD: (0.0, 0.3),
    TaskState.QUEUED: (2.0, 0.9),
    TaskState.INTERRUPTED: (2.0, 3.5),
    TaskState.RUNNING: (4.6, 1.9),
    TaskState.PAUSED: (4.6, 4.0),
    TaskState.DONE: (7.3, 3.1),
    TaskState.FAILED: (7.3, 1.4),
    TaskState.CANCELLED: (4.6, -0.3),
}
"""The place of each state in the picture; a missing state fails the drawing."""

BENDS = {(TaskState.PAUSED, TaskState.CANCELLED): 0.62, (TaskState.INTERRUPTED, TaskState.FAILED): -0.05}
"""How far an arrow is bent that would run through a box."""

COLOURS = {
    TaskState.RUNNING: BLUE,
    TaskState.DONE: GREEN,
    TaskState.FAILED: ORANGE,
    TaskState.INTERRUPTED: YELLOW,
}

WIDE, HIGH = 1.25, 0.46


def states() -> Figure:
    """Return the life of jobs and of their steps, drawn from the table of states."""
    with house_style():
        figure = blank(7.2, 4.2)
        axes = figure.add_subplot()
        for old, following in TRANSITIONS.items():
            for new in sorted(following):
                _arrow(axes, old, new)
        for state in TRANSITIONS:
            _box(axes, state)
        axes.set(aspect="equal", xlim=(-0.9, 8.1), ylim=(-0.7, 4.4))
        axes.set_axis_off()
    return figure


def _box(axes: Axes, state: TaskState) -> None:
    """Draw a state; one that nothing follows has a thin line."""
    style = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": COLOURS.get(state, INK)}
    width = 1.0 if state.ended else 2.0
    axes.text(*PLACES[state], state.value, ha="center", va="center", fontsize=9, bbox={**style, "linewidth": width})


def _arrow(axes: Axes, old: TaskState, new: TaskState) -> None:
    """Draw what may follow; two arrows between the same two states are bent apart."""
    both = old in TRANSITIONS[new]
    (x0, y0), (x1, y1) = PLACES[old], PLACES[new]
    start, end = _edge((x0, y0), (x1, y1)), _edge((x1, y1), (x0, y0))
    bend = BENDS.get((old, new), 0.22 if both else 0.06)
    arrow = {"arrowstyle": "-|>", "color": GREY, "linewidth": 0.9, "shrinkA": 2.0, "shrinkB": 2.0}
    axes.annotate("", end, start, arrowprops={**arrow, "connectionstyle": f"arc3,rad={bend}"}, zorder=0)


def _edge(middle: tuple[float, float], to: tuple[float, float]) -> tuple[float, float]:
    """Return where a line from the middle of a box to another leaves it."""
    dx, dy = to[0] - middle[0], to[1] - middle[1]
    scale = min(
        WIDE / 2.0 / abs(dx) if dx else float("inf"),
        HIGH / 2.0 / abs(dy) if dy else float("inf"),
    )
    return middle[0] + dx * scale, middle[1] + dy * scale
