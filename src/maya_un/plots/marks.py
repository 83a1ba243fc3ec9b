"""A place that somebody asked about, and what the machine makes of it."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes

from maya_un.kinematics import Workspace
from maya_un.plots.style import INK, PURPLE
from maya_un.values import Point


@dataclass(frozen=True, slots=True)
class MarkedTarget:
    """A `target` and the reachable place nearest to it, `held`: the same where the target can be reached."""

    target: Point
    held: Point

    @classmethod
    def of(cls, workspace: Workspace, target: Point) -> MarkedTarget:
        """Return a target with its nearest place [m]."""
        return cls(target, workspace.nearest(target))

    @property
    def reachable(self) -> bool:
        """Whether the target itself can be reached."""
        return self.target == self.held

    def show(self, axes: Axes, target: tuple[float, ...], held: tuple[float, ...]) -> None:
        """Mark both places, given in the coordinates of `axes`, with a line between them."""
        if not self.reachable:
            axes.plot(*zip(target, held, strict=True), color=PURPLE, linewidth=1.0, linestyle="dotted", zorder=7)
            _mark(axes, target, "x", PURPLE, "target")
        _mark(axes, held, "o", INK, "target, reachable" if self.reachable else "nearest reachable place")


def make_room(axes: Axes, place: tuple[float, float]) -> None:
    """Widen a picture in a plane so that it shows `place` too, unless that is farther off than the picture is large."""
    limits = (axes.get_xlim(), axes.get_ylim())
    sizes = [high - low for low, high in limits]
    if all(low - size <= at <= high + size for (low, high), size, at in zip(limits, sizes, place, strict=True)):
        across, up = (
            (min(low, at - 0.04 * size), max(high, at + 0.04 * size))
            for (low, high), size, at in zip(limits, sizes, place, strict=True)
        )
        axes.set(xlim=across, ylim=up)


def _mark(axes: Axes, place: tuple[float, ...], marker: str, colour: str, label: str) -> None:
    columns = [[value] for value in place]
    axes.plot(*columns, marker=marker, color=colour, label=label, ls="none", ms=7.0, mew=2.0, zorder=8)
