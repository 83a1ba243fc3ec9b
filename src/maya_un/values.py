"""The values that cross layers: immutable, SI (m, rad, s), cheap to make.

`Joints` and `Point` are named tuples because they are made by the hundred thousand; everything a reader
looks at less often is a frozen, slotted dataclass.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, NamedTuple

from dmc41x3.i18n import PHRASE, marked, phrase

JogDirection = str | tuple[float, float, float]
"""The direction of a jog: one of `axes.JOG_AXES`, or a unit vector in which the gripper goes straight."""

FARTHEST = 1e4
"""Coordinates beyond this (rad, m) are refused everywhere, because no robot reaches them."""

WITHIN = phrase("it must be a number between {least:g} and {most:g}", least=-FARTHEST, most=FARTHEST)
"""Why a coordinate is refused that is not finite, or beyond `FARTHEST`."""

LEAST_OVERRIDE = 0.01
"""Least speed override: a hundredth of the planned speed. A pause stops the motion."""

LEAST_SPEED = 0.001
"""Least share of the full speed for a motion: without a bound it might never end."""


class Joints(NamedTuple):
    """Joint coordinates of Maya.

    `a` is the boom's angle [rad], measured clockwise from +y seen from above; `b` and `c` are the free
    lengths of the inner and the outer line [m] (manual, figures 7 to 9).
    """

    a: float
    b: float
    c: float


class Point(NamedTuple):
    """Place of the gripper point in the base frame [m]: x = d sin a, y = d cos a, z above the table top."""

    x: float
    y: float
    z: float


class Limit(StrEnum):
    """The limits of the workspace, in the order in which errors name them."""

    NUMBER = "number"
    COUPLING = "coupling"
    ANCHORS = "anchors"
    BOOM = "boom"
    INNER = "inner"
    OUTER = "outer"
    FLOOR = "floor"
    LINE_B = "line_b"
    LINE_C = "line_c"
    TENSION_B = "tension_b"
    TENSION_C = "tension_c"
    ZONE = "zone"


MarginUnit = Literal["m", "rad", "load"]
"""The units of the distance to a limit; "load" is a multiple of the load."""


class GripperState(StrEnum):
    """The known state of the gripper.

    `found`: closed since before this connection, as a controller's outputs are at power-up, and homed since; it counts
    as empty, like a gripper that a user has seen to be empty. `closed`: closed by command, or found closed under an
    adopted homing; it may hold a part.
    """

    OPEN = "open"
    FOUND = "found"
    CLOSED = "closed"


class Mode(StrEnum):
    """The activity of the controller layer; one at a time."""

    DISCONNECTED = marked("disconnected", PHRASE)
    NOT_HOMED = marked("not_homed", PHRASE)
    HOMING = marked("homing", PHRASE)
    IDLE = marked("idle", PHRASE)
    MOVING = marked("moving", PHRASE)
    PAUSED = marked("paused", PHRASE)
    STOPPING = marked("stopping", PHRASE)
    FAULT = marked("fault", PHRASE)


@dataclass(frozen=True, slots=True)
class Notice:
    """An error as data: stable code and the details its sentence is made of."""

    code: int
    message: str


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of the motion under way: `elapsed` of `duration` [s], in `phase`.

    Both hold for the present speed; time at rest in a pause does not count. In a homing, the phase is `number` (from 1)
    of `count`, and the `duration` is 0, because it is unknown; in other motions both numbers are 0.
    """

    phase: str
    elapsed: float
    duration: float
    number: int = 0
    count: int = 0

    @property
    def fraction(self) -> float:
        """Share of the duration that has passed, 0 to 1."""
        return 1.0 if self.duration <= 0.0 else max(0.0, min(1.0, self.elapsed / self.duration))


@dataclass(frozen=True, slots=True)
class State:
    """Latest known state of the machine; a new one replaces the old one, slow readers skip.

    `joints` and `point` are None before homing, when the counts say nothing about lengths.
    `counts` are the encoder positions, `velocity` is in rad/s and m/s, limits are True where active. `override` is
    the factor on the speed of all motion, `moving` also true of axes that a pause holds on their way.
    """

    time: float
    mode: Mode
    homed: bool
    counts: tuple[int, int, int]
    joints: Joints | None
    point: Point | None
    velocity: tuple[float, float, float]
    moving: bool
    motors_on: tuple[bool, bool, bool]
    forward_limit: tuple[bool, bool, bool]
    reverse_limit: tuple[bool, bool, bool]
    stop_code: tuple[int, int, int]
    gripper_closed: bool
    progress: Progress | None
    fault: Notice | None
    override: float = 1.0


@dataclass(frozen=True, slots=True)
class StopReport:
    """Report of a stop: the motion that was under way ends within `duration` [s] and `distance`.

    `distance` holds the remaining way of each axis (rad, m, m); all zero if nothing moved. `job` is the number of the
    job that the stop ends, None without one: a job may wait, for a person or an input, while nothing moves.
    """

    was_moving: bool
    duration: float
    distance: tuple[float, float, float]
    job: int | None = None
