"""How axes take part in a motion that is planned for several of them: its plan goes into their timelines."""

from __future__ import annotations

from collections.abc import Sequence

from maya_un.galil.codes import StopCode
from maya_un.virtual import limits
from maya_un.virtual.axis import Axis
from maya_un.virtual.plane import Plane


def follow(axes: Sequence[Axis], plane: Plane, now: float) -> None:
    """Put the plan of a sequence into the timelines of its axes from `now` [s] on."""
    for place, i in enumerate(plane.members):
        axis = axes[i]
        if axis.plane == plane.letter:
            pieces, axis.peak = plane.pieces(place, now)
            axis.timeline.plan(now, pieces)
            axis.turns = plane.turns(place, now)
            limits.watch(axis, now)


def finish(axes: Sequence[Axis], plane: Plane, now: float) -> None:
    """End the run of a sequence at `now` [s] and give its axes their stop code."""
    result = plane.finish(now)
    for i in plane.members:
        axis = axes[i]
        if axis.plane == plane.letter:
            axis.plane = ""
            axis.last_stop = axis.reference(now)
            if axis.stop_code is StopCode.SEQUENCE_RUNNING:
                axis.stop_code = result
