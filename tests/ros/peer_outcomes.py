"""Outcomes of a goal of `peer.py`, by its `a`; a separate module, since the peer itself needs a ROS."""

from __future__ import annotations

from enum import IntEnum

MOVE = "maya_controller/Move"


class GoalOutcome(IntEnum):
    """The outcome of a goal."""

    SUCCEEDS = 0
    IS_REFUSED = 1
    LASTS = 2
    FAILS = 3
    BREAKS = 4
    TAKES_A_WHILE = 5
