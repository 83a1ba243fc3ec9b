"""What may befall an axis that a program wants to know."""

from __future__ import annotations

from enum import Enum


class ProgramTrigger(Enum):
    """What a program may have a subroutine for."""

    LIMIT = "hard or soft limit in the direction of motion"
    POSITION_ERROR = "following error beyond ER"
    AMPLIFIER = "amplifier fault"
