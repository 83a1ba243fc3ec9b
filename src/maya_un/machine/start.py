"""Where a machine stands when it is switched on, and how such starts are drawn."""

from __future__ import annotations

from typing import NamedTuple

from maya_un.machine.statics import Statics
from maya_un.machine.truth import Random, TrueConstants

TENSION = 5.0
"""A start is taut at no more than this [× load] ..."""
SLACK = 0.25
"""... or on a switch, with no more slack than this [m] (errata, "Homing, in numbers")."""
PARTS = 0.40
"""Height of the gripper above the parts [m] (errata, "The cell")."""
TABLE = 0.10
"""No start is lower than this [m]."""
OVERTRAVEL = 0.003
"""An axis on a switch stands up to this far beyond its trip point [m]; axis a up to as many tenths of a rad."""


class StartPose(NamedTuple):
    """True angle [rad] and line lengths [m] at power-up."""

    a: float = 1.0
    b: float = 1.5
    c: float = 1.5


def legal_start(rng: Random, truth: TrueConstants) -> StartPose:
    """Return a start that homing has to cope with, drawn for this machine.

    Most are inside the strokes, taut and above the parts; a fifth stand on one or more switches, perhaps with a
    slack line; an eighth are lower than the parts.
    """
    kind = rng.random()
    statics = Statics.of(truth)
    while True:
        on_switch = kind < 0.2
        start = StartPose(
            _place(rng, truth, 0, 0.4 if on_switch else 0.0),
            _place(rng, truth, 1, 0.5 if on_switch else 0.0),
            _place(rng, truth, 2, 0.5 if on_switch else 0.0),
        )
        if _legal(start, truth, statics, low=0.2 <= kind < 0.325, on_switch=on_switch):
            return start


def _place(rng: Random, truth: TrueConstants, axis: int, chance: float) -> float:
    reverse, forward = truth.switches[axis]
    place, choice, beyond = rng.uniform(reverse, forward), rng.random(), rng.random() * OVERTRAVEL
    beyond *= 10.0 if axis == 0 else 1.0
    if choice < 0.5 * chance:
        return reverse - beyond
    if choice < chance:
        return forward + beyond
    return place


def _legal(start: StartPose, truth: TrueConstants, statics: Statics, *, low: bool, on_switch: bool) -> bool:
    if start.b + start.c <= truth.width or on_switch != any(_beyond(start, truth)):
        return False
    hang = statics.hang(start.b, start.c)
    may_be_slack = any(_beyond(start, truth)[1:])
    if hang.tension > TENSION or hang.slack > (SLACK if may_be_slack else 0.0):
        return False
    return TABLE <= hang.z < PARTS if low else hang.z >= PARTS


def _beyond(start: StartPose, truth: TrueConstants) -> list[bool]:
    return [not reverse < q < forward for q, (reverse, forward) in zip(start, truth.switches, strict=True)]
